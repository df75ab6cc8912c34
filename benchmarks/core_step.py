"""Time of a step of each core, and its ratio to that of another checkout.

python benchmarks/core_step.py [--rounds N] [--against PATH_OF_A_CHECKOUT]

A round is one process for each checkout, in turns, so that a busy machine slows both. Each process reports the fastest
of its batches. The other checkout's code runs with this interpreter. It may be older than `ResourceCore.step`.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from statistics import median
from typing import Any

from checkouts import ROOT, code_of, script

from skillwing.dsl import parse
from skillwing.services import protocol
from skillwing.services.core.resource_core import ResourceCore
from skillwing.services.core.skill_core import SkillCore
from skillwing.services.ids import RecordIds
from skillwing.services.protocol import (
    BeginGoal,
    DataSample,
    Ended,
    EndGoal,
    FireExtern,
    Granted,
    StartGoal,
)

try:
    from skillwing.services.core import skill_events
except ImportError:  # an older checkout
    skill_events = None

BATCHES, BATCH = 150, 20
SKILLS = ("arm", "base", "head")
SOURCE = f"""
    skillset bench {{
        data {{ battery: float64 }}
        resource authority {{ initial ON  extern ON -> OFF  extern OFF -> ON }}
        resource lamp {{ initial OFF  extern OFF -> ON  extern ON -> OFF }}
        {"".join(f"resource {name}_motor {{ initial FREE  FREE -> USED  USED -> FREE }}" for name in SKILLS)}
        {
    "".join(
        f'''
        skill {name} {{
            input {{ speed: float64 = 1.0 }}
            effect {{ take: {name}_motor -> USED  free: {name}_motor -> FREE }}
            precondition {{
                authority: resource=(authority == ON)
                free: resource=({name}_motor == FREE)
                charged: data=(battery > 20.0)
                success take
            }}
            invariant {{
                authority: resource=(authority == ON) violation=free
                charged: data=(battery > 10.0) violation=free
            }}
            interrupt {{ apply=free }}
            result {{ success DONE: apply=free post resource=(authority == ON) }}
        }}'''
        for name in SKILLS
    )
}
    }}
"""
BENCH = parse(SOURCE, "bench.skillset")
OLD_METHODS = {"BeginGoal": "begin", "EndGoal": "end", "FireExtern": "fire_extern", "DataSample": "update_datum"}
AT_STEP: Any = {"step": 1} if hasattr(protocol, "ResourceStep") else {"revision": 1}
RESULT: Any = protocol.EndKind.RESULT if hasattr(protocol, "EndKind") else "result"


# --- one interface for both ages of the cores ------------------------------------------------------------------------


def resource_step(core: ResourceCore) -> Callable[[Any, float], Any]:
    """The way to take a step: `step`, or the old method for each kind of event."""
    if hasattr(core, "step"):
        return core.step
    return lambda event, now: getattr(core, OLD_METHODS[type(event).__name__])(event, now)


def live(core: Any, goal_id: str, number: int) -> None:
    """Take a skill core through the life of a goal, from start to result, in six steps."""
    start = StartGoal(goal_id=goal_id, inputs={}, client="bench", schema=BENCH.schema_hash)
    granted = Granted(goal_id=goal_id, token=number + 1, record="rm#1", **AT_STEP)
    ended = Ended(goal_id=goal_id, held=True, reason="", record="rm#2", **AT_STEP)
    if skill_events is not None:
        step = core.step
        step(start, 0.0)
        asked = _question(step(skill_events.Validated(goal_id, None), 0.0))
        step(skill_events.QuestionAnswered(asked, granted), 0.0)
        step(skill_events.Dispatched(goal_id), 0.0)
        asked = _question(step(skill_events.Terminated(goal_id, "DONE"), 0.0))
        step(skill_events.QuestionAnswered(asked, ended), 0.0)
        return
    core.start(start, 0.0)
    asked = _question(core.validated(goal_id, None, 0.0))
    core.answered(asked, granted, 0.0)
    core.dispatched(goal_id, 0.0)
    asked = _question(core.terminated(goal_id, "DONE", None, 0.0))
    core.answered(asked, ended, 0.0)


def _question(actions: tuple[Any, ...]) -> Any:
    return next(action for action in actions if type(action).__name__ == "AskResources")


# --- what is timed ---------------------------------------------------------------------------------------------------


def goals() -> Iterator[str]:
    """Goal ids without end."""
    number = 0
    while True:
        number += 1
        yield f"01890000-0000-7000-8000-{number:012d}"


def begin_of(skill: str, goal_id: str) -> BeginGoal:
    return BeginGoal(
        goal_id=goal_id,
        skill=skill,
        inputs={},
        manager=f"skill/{skill}",
        owner="bench",
        schema=BENCH.schema_hash,
        incarnation="one",
    )


def fed_core() -> Callable[[Any, float], Any]:
    """The way to step a resource core with known data."""
    step = resource_step(ResourceCore(BENCH, source="rm", new_record_id=RecordIds("rm")))
    step(DataSample(name="battery", value=80.0, t=0.0), 0.0)
    return step


def begin_and_end() -> Callable[[], None]:
    """A grant and its end; 2 steps."""
    step, ids = fed_core(), goals()

    def cycle() -> None:
        goal_id = next(ids)
        granted = step(begin_of("arm", goal_id), 0.0).reply
        end = EndGoal(goal_id=goal_id, skill="arm", token=granted.token, how=RESULT, result="DONE")
        assert step(end, 0.0).reply.held

    return cycle


def extern_with_invariants() -> Callable[[], None]:
    """An extern transition to and fro while three goals run, which have two invariants each; 2 steps."""
    step, ids = fed_core(), goals()
    for skill in SKILLS:
        assert isinstance(step(begin_of(skill, next(ids)), 0.0).reply, Granted)
    there, back = (FireExtern(resource="lamp", target=target, source="bench") for target in ("ON", "OFF"))

    def cycle() -> None:
        step(there, 0.0)
        step(back, 0.0)

    return cycle


def goal_life() -> Callable[[], None]:
    """The life of a goal in a skill core; 6 steps."""
    core, ids = SkillCore(BENCH, "arm", source="skill/arm", incarnation="one", new_record_id=RecordIds("arm")), goals()
    numbers = iter(range(1 << 40))
    return lambda: live(core, next(ids), next(numbers))


CASES: dict[str, tuple[Callable[[], Callable[[], None]], int]] = {
    "resource core: begin and end": (begin_and_end, 2),
    "resource core: extern, six invariants": (extern_with_invariants, 2),
    "skill core: life of a goal": (goal_life, 6),
}


def measure() -> dict[str, float]:
    """Microseconds a step in each case: the fastest batch."""
    times: dict[str, float] = {}
    for name, (make, steps) in CASES.items():
        cycle = make()
        batches: list[float] = []
        for _ in range(BATCHES):
            begun = time.process_time()
            for _ in range(BATCH):
                cycle()
            batches.append((time.process_time() - begun) / BATCH / steps)
        times[name] = min(batches) * 1e6
    return times


def run(tree: Path) -> dict[str, float]:
    """Measure the code of a checkout in a process of its own."""
    environment = {**os.environ, **code_of(tree)}
    done = subprocess.run(script("core_step.py", "--measure"), env=environment, stdout=subprocess.PIPE, check=True)
    return json.loads(done.stdout)


def table(rounds: list[tuple[dict[str, float], dict[str, float] | None]]) -> Iterator[str]:
    """Lines of Markdown: medians of the rounds, and the median of their ratios."""
    yield "| step | us | other checkout, us | ratio |"
    yield "|---|---|---|---|"
    for name in CASES:
        here = median(mine[name] for mine, _ in rounds)
        pairs = [(mine[name], other[name]) for mine, other in rounds if other is not None]
        if pairs:
            ratio = median(mine / other for mine, other in pairs)
            yield f"| {name} | {here:.1f} | {median(other for _, other in pairs):.1f} | {ratio:.2f} |"
        else:
            yield f"| {name} | {here:.1f} | | |"


def main() -> None:
    parser = argparse.ArgumentParser(description="Time of a step of each core.")
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--against", type=Path, metavar="TREE", help="another checkout of this repository")
    parser.add_argument("--measure", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.measure:
        json.dump(measure(), sys.stdout)
        return
    rounds = [
        (run(ROOT), None if options.against is None else run(options.against.resolve())) for _ in range(options.rounds)
    ]
    sys.stdout.write("\n".join(table(rounds)) + "\n")


if __name__ == "__main__":
    main()
