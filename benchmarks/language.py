"""Processor time to read and check a generated file of many skills of the size of the m600's `goto`.

python benchmarks/language.py [--skills 1000] [--seed 1] [--runs 7] [--write]

`--write` puts the figures into docs/performance.md; `--print` shows the generated file instead.
"""

from __future__ import annotations

import gc
import random
import sys
import time
from collections.abc import Callable

from performance_page import against, machine, make_parser, table, write_section

from skillwing.dsl.checking.analysis import analyse
from skillwing.dsl.checking.checker import check, paused_collector
from skillwing.dsl.checking.resolver import resolve
from skillwing.dsl.diagnostics.report import DiagnosticReport
from skillwing.dsl.reading.dialect import lex
from skillwing.dsl.reading.parser import parse_file

RESOURCES = {
    "axes_authority": ("AVAILABLE", "USED"),
    "heading_authority": ("AVAILABLE", "USED"),
    "gripper": ("FREE", "HELD"),
    "camera": ("IDLE", "RECORDING"),
}
CONDITIONS = {
    "SDK_authority": ("AVAILABLE", "LOST"),
    "flight_status": ("IN_AIR", "ON_GROUND"),
    "battery_status": ("GOOD", "LOW", "CRITICAL"),
    "link_status": ("UP", "DOWN"),
}
WHOLE = "check, all of it"
BUDGET, TARGET = 1.0, 0.5
"""Processor time of the whole check of 1000 skills [s]."""
DATA = {"battery": "[%]", "altitude": "[m]", "wind": "[m/s]"}


def generated(skills: int, seed: int) -> str:
    """A valid skillset of that many skills: one or two resources taken, guards of both kinds, results with `post`."""
    chance = random.Random(seed)
    lines = [
        "skillset generated {",
        "    type Position { x: float64 [m]  y: float64 [m]  z: float64 [m] }",
        "    data {",
        "        position: Position period=0.1",
        *(f"        {name}: float64 {unit} period=1.0" for name, unit in DATA.items()),
        "    }",
    ]
    for name, (free, used) in RESOURCES.items():
        lines.append(f"    resource {name} {{ initial {free}  {free} -> {used}  {used} -> {free} }}")
    for name, states in CONDITIONS.items():
        edges = "  ".join(f"extern {one} -> {other}" for one in states for other in states if one != other)
        lines.append(f"    resource {name} {{ initial {states[0]}  {edges} }}")
    for index in range(skills):
        lines += _skill(f"skill_{index}", chance)
    return "\n".join([*lines, "}", ""])


def _skill(name: str, chance: random.Random) -> list[str]:
    taken = chance.sample(sorted(RESOURCES), chance.randint(1, 2))
    watched = chance.sample(sorted(CONDITIONS), chance.randint(1, 2))
    datum = chance.choice(sorted(DATA))
    take = "  ".join(f"{resource} -> {RESOURCES[resource][1]}" for resource in taken)
    release = "  ".join(f"{resource} -> {RESOURCES[resource][0]}" for resource in taken)
    free = [f"            {resource}_free: resource=({resource} == {RESOURCES[resource][0]})" for resource in taken]
    good = {condition: f"resource=({condition} == {CONDITIONS[condition][0]})" for condition in watched}
    post = f" post resource=({taken[0]} == {RESOURCES[taken[0]][0]})"
    return [
        "",
        f"    // What {name} does.",
        f"    skill {name} {{",
        "        progress=0.5 { distance: float64 [m] }",
        "        input {",
        "            target: Position",
        f"            speed:  float64 [m/s] in 0.1..{chance.randint(2, 9)}.0 = 1.5",
        "        }",
        "        output { stopped_at: Position }",
        "        effect {",
        f"            take    {{ {take} }}",
        f"            release {{ {release} }}",
        "        }",
        "        precondition {",
        *free,
        *(f"            {condition}: {predicate}" for condition, predicate in good.items()),
        f"            measured: data=({datum} > {chance.randint(1, 50)}.5{chance.choice(('', ' and speed < 9.0'))})",
        "            success take",
        "        }",
        "        invariant {",
        *(f"            {condition}: {predicate} violation=release" for condition, predicate in good.items()),
        "        }",
        *chance.choice(([], ["        interrupt { apply=release timeout=5.0 }"])),
        "        result {",
        f"            success ARRIVED: apply=release{chance.choice(('', post))}",
        "            failure BLOCKED: apply=release   // an obstacle on the way",
        "            failure ABORTED: apply=release",
        "        }",
        "    }",
    ]


def _seconds(work: Callable[[], object], runs: int) -> float:
    """The least processor time of a piece of work: whatever else the machine does can only add to it."""
    taken: list[float] = []
    for _ in range(runs):
        gc.collect()
        with paused_collector():  # as `check` does
            begin = time.process_time()
            result = work()
            taken.append(time.process_time() - begin)
        del result
    return min(taken)


def measured(text: str, runs: int) -> dict[str, float]:
    """Processor seconds of each step, and of `check`, which is all of them."""
    file = "generated.skillset"
    checked = check(text, file)
    assert checked.skillset is not None, checked.diagnostics[:3]
    skillset = checked.skillset
    root = parse_file(text, file).root
    assert root is not None
    lexing = _seconds(lambda: lex(text, file), runs)
    return {
        "lex": lexing,
        "parse": _seconds(lambda: parse_file(text, file), runs) - lexing,
        "resolve": _seconds(lambda: resolve(root, DiagnosticReport()), runs),
        "analyse": _seconds(lambda: analyse(skillset, DiagnosticReport()), runs),
        WHOLE: _seconds(lambda: check(text, file), runs),
    }


def section(skills: int, text: str, figures: dict[str, float]) -> str:
    """The figures as a piece of a Markdown page."""
    words = len(lex(text, ""))
    rows = [[step, f"{seconds:.2f}", ""] for step, seconds in figures.items()]
    rows[-1][-1] = f"{TARGET:g}: {against(TARGET, figures[WHOLE])}"
    return f"""A generated file of {skills} skills of the size of the m600's `goto`: {len(text) // 1000} kB, {words}
words and signs, which is {words // skills} a skill. Least processor time of several runs on one core; the budget is
{BUDGET:g} s for all of it: {against(BUDGET, figures[WHOLE])}. {machine()}.

{table(("step", "seconds", "target, s"), rows)}"""


def main() -> None:
    options = make_parser(__doc__)
    options.add_argument("--skills", type=int, default=1000)
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--runs", type=int, default=7)
    options.add_argument("--print", action="store_true", help="show the generated file instead")
    given = options.parse_args()
    text = generated(given.skills, given.seed)
    if given.print:
        sys.stdout.write(text)
        return
    body = section(given.skills, text, measured(text, given.runs))
    write_section("language.py", "The language", body, write=given.write)


if __name__ == "__main__":
    main()
