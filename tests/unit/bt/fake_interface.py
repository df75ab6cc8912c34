"""A skillset interface whose goals change only when a test changes them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.dsl.expressions import Comparison, Name, NamedValue
from skillwing.dsl.model import (
    Effect,
    Field,
    Interrupt,
    Precondition,
    Predicate,
    Resource,
    Result,
    ScalarType,
    Skill,
    Skillset,
    Transition,
)
from skillwing.services.bus import Answer
from skillwing.services.core.values import fit_fields
from skillwing.services.errors import InvalidInputError
from skillwing.services.protocol import DataReading, Ending, State, Terminal


def _mover(name: str, *results: Result) -> Skill:
    """A skill that needs the axes, takes them, and gives them back."""
    free = Comparison("==", Name("axes", "resource"), NamedValue("FREE"))
    return Skill(
        name,
        inputs=(Field("speed", ScalarType("float64"), low=0.1, high=5.0, default=1.0),),
        effects=(Effect("take", (("axes", "USED"),)), Effect("release", (("axes", "FREE"),))),
        preconditions=Precondition((Predicate("axes_free", "resource", free),), success="take"),
        results=results,
        interrupt=Interrupt(apply="release"),
    )


SKILLSET = Skillset(
    "toy",
    resources=(
        Resource("axes", ("FREE", "USED"), "FREE", (Transition("FREE", "USED"), Transition("USED", "FREE"))),
        Resource("camera", ("OK", "FAILED"), "OK", (Transition("OK", "FAILED", extern=True),)),
    ),
    skills=(
        _mover("go", Result("ARRIVED", True), Result("BLOCKED", False)),
        _mover("turn", Result("ALIGNED", True)),
        Skill("look", results=(Result("NO_DATA", False),)),
    ),
)


class FakeGoal:
    def __init__(self, number: int, skill: str, inputs: Mapping[str, Any], cause: str | None) -> None:
        self.goal_id = f"goal-{number}"
        self.skill = skill
        self.inputs = dict(inputs)
        self.cause = cause
        self.state: State | None = None
        self.terminal: Terminal | None = None
        self.record: str | None = None
        self.progress: dict[str, Any] | None = None
        self.interrupts = 0
        self.interrupt_cause: str | None = None

    @property
    def done(self) -> bool:
        return self.terminal is not None

    def run(self) -> None:
        self.state = State.RUNNING

    def end(self, label: str, *, success: bool = False, **more: Any) -> None:
        """End as a label of the timeline says: `S_ARRIVED`, `NR`, ..."""
        ending, _, result = label.partition("_")
        self.state = State.TERMINATED
        self.record = f"{self.goal_id}:{label}"
        self.terminal = Terminal(
            ending=Ending(ending), reason=f"{label} for the test", result=result or None, success=success, **more
        )


class FakeInterface:
    def __init__(self, skillset: Skillset) -> None:
        self.skillset = skillset
        self.goals: list[FakeGoal] = []
        self.states = {resource.name: resource.initial for resource in skillset.resources}
        self.readings: dict[str, DataReading] = {}
        self.ready = True
        self.questions: list[tuple[str, Mapping[str, Any] | None, Callable[[Answer], None]]] = []

    def state(self, resource: str) -> str | None:
        return self.states.get(resource)

    def change_record(self, resource: str) -> str | None:
        return f"{resource}:changed"

    def reading(self, datum: str) -> DataReading:
        return self.readings.get(datum, DataReading(name=datum, value=None, t=None, age=None, stale=True))

    def know(self, datum: str, value: Any, *, stale: bool = False) -> None:
        self.readings[datum] = DataReading(name=datum, value=value, t=0.0, age=0.0, stale=stale)

    def ask_ready(
        self, skill: str, on_answer: Callable[[Answer], None], inputs: Mapping[str, Any] | None = None
    ) -> None:
        problems = fit_fields(self.skillset.skill(skill).inputs, inputs or {})[1]
        if inputs is not None and problems:
            raise InvalidInputError(skill, {each.path: each.sentence for each in problems})
        self.questions.append((skill, inputs, on_answer))

    def start(self, skill: str, inputs: Mapping[str, Any] | None = None, *, cause: str | None = None) -> FakeGoal:
        self.skillset.skill(skill)
        goal = FakeGoal(len(self.goals), skill, inputs or {}, cause)
        self.goals.append(goal)
        return goal

    def interrupt(self, goal: FakeGoal, *, cause: str | None = None) -> None:
        assert not goal.done, "the reaper leaves finished goals alone"
        goal.interrupts += 1
        goal.interrupt_cause = cause


class FakeMission:
    """A context on a fake interface, with a clock that the test moves and a journal that it can read.

    robot: its name in a mission on several robots.
    """

    def __init__(self, skillset: Skillset = SKILLSET, robot: str = "") -> None:
        self.time = 0.0
        self.interface = FakeInterface(skillset)
        self.journal: list[tuple[str, str | None, str, str, str | None]] = []
        self.context = MissionContext(self.interface, skillset, lambda: self.time, self._write, robot=robot)

    def _write(self, subject: str, before: str | None, after: str, text: str, cause: str | None) -> str:
        self.journal.append((subject, before, after, text, cause))
        return f"mission#{len(self.journal)}"

    @property
    def goals(self) -> list[FakeGoal]:
        return self.interface.goals
