"""The tick of a mission tree of 100 nodes against py_trees alone: the same tree, of its own simplest leaves.

python benchmarks/tree_tick.py [--write]
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any

from performance_page import machine, make_parser, milliseconds, ratio, table, write_section
from py_trees import behaviours
from py_trees.behaviour import Behaviour
from py_trees.common import ParallelPolicy
from py_trees.composites import Parallel, Sequence

from skillwing.bt_missions.leaves.conditions import ResourceIs
from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.running.tree_snapshot import SnapshotBuilder
from skillwing.dsl import parse
from skillwing.services.bus import Answer
from skillwing.services.client.goal_handle import GoalHandle
from skillwing.services.protocol import DataReading, State

BRANCHES = 33
"""Number of branches below the root, of three nodes each."""
TICKS = 400
BLOCKS = 7
SKILLSET = parse(
    "skillset ticked { resource link { initial UP  extern UP -> DOWN  extern DOWN -> UP }\n"
    + "\n".join(f"skill work_{index} {{ interrupt {{ }} result {{ DONE: }} }}" for index in range(BRANCHES))
    + "}",
    "ticked.skillset",
)


class Flying:
    """A robot on which every goal runs. All data of a tick is already there, as in flight."""

    ready = True
    states: Mapping[str, str] = {"link": "UP"}

    def state(self, resource: str) -> str | None:
        return self.states[resource]

    def change_record(self, resource: str) -> str | None:
        return None

    def reading(self, datum: str) -> DataReading:
        raise NotImplementedError(datum)

    def ask_ready(
        self, skill: str, on_answer: Callable[[Answer], None], inputs: Mapping[str, Any] | None = None
    ) -> None:
        raise NotImplementedError(skill)

    def start(self, skill: str, inputs: Mapping[str, Any] | None = None, *, cause: str | None = None) -> GoalHandle:
        handle = GoalHandle(skill, skill)
        handle.state = State.RUNNING
        return handle

    def interrupt(self, goal: Any, *, cause: str | None = None) -> None:
        pass


def tree(leaves: Callable[[int], tuple[Behaviour, Behaviour]]) -> Behaviour:
    """Tree of a root with branches, each of a condition that holds and an action that runs."""
    root = Parallel("root", ParallelPolicy.SuccessOnAll())
    for index in range(BRANCHES):
        root.add_child(Sequence(f"branch {index}", memory=False, children=list(leaves(index))))
    return root


def ours() -> Behaviour:
    context = MissionContext(Flying(), SKILLSET, time.monotonic, _write_nothing)
    return tree(
        lambda index: (
            ResourceIs(f"link {index}", context, "link", "UP"),
            SkillAction(f"work {index}", context, f"work_{index}"),
        )
    )


def _write_nothing(subject: str, before: str | None, after: str, text: str, cause: str | None) -> str:
    return ""


def theirs() -> Behaviour:
    return tree(lambda index: (behaviours.Success(f"link {index}"), behaviours.Running(f"work {index}")))


def _seconds(tick: Callable[[], object]) -> list[float]:
    taken: list[float] = []
    for _ in range(TICKS):
        begun = time.process_time()
        tick()
        taken.append(time.process_time() - begun)
    return taken


def main() -> None:
    given = make_parser(__doc__).parse_args()
    alone, mission = theirs(), ours()
    portrait = SnapshotBuilder(mission)

    def followed() -> None:
        mission.tick_once()
        portrait.update()

    series: dict[str, list[list[float]]] = {}
    for _ in range(BLOCKS):
        for name, tick in (
            ("py_trees alone", alone.tick_once),
            ("mission tree", mission.tick_once),
            ("mission tree, and a look at what has changed in it", followed),
        ):
            series.setdefault(name, []).append(_seconds(tick))
    base = series["py_trees alone"]
    rows = [
        [name, *milliseconds([each for block in blocks for each in block]), ratio(list(zip(blocks, base, strict=True)))]
        for name, blocks in series.items()
    ]
    count = sum(1 for _ in mission.iterate())
    body = f"""One tick of a tree of {count} nodes, {BRANCHES} of which run a skill and {BRANCHES} look at a resource,
in processor time; nothing in it waits for the network. The budget is 1.5 times py_trees alone.
{machine()}.

{table(("tree", "p50, ms", "p99, ms", "ratio (blocks)"), rows)}"""
    write_section("tree_tick.py", "The tick of a mission tree", body, write=given.write)


if __name__ == "__main__":
    main()
