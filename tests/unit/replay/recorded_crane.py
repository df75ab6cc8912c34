"""A small skillset, whatever may happen to its resource manager, and cores whose steps are written down."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from hypothesis import strategies as st

from skillwing.dsl import parse
from skillwing.services.core.events import Event, GoalSilent, ManagerGone, Resumed, TimePassed
from skillwing.services.core.latest_data import LatestData
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.resource_core import ResourceCore
from skillwing.services.core.snapshot import EMPTY_SNAPSHOT
from skillwing.services.ids import RecordIds
from skillwing.services.journal.journal import Journal
from skillwing.services.journal.schema import Identity
from skillwing.services.protocol import (
    AttachManager,
    BeginGoal,
    DataSample,
    EndGoal,
    Ending,
    EndKind,
    FireEvent,
    FireExtern,
    Record,
    RecordOutcome,
    RenewGoal,
    Terminal,
)
from skillwing.services.replay.files import FILE_BYTES, StepWriter
from skillwing.services.replay.recorded_core import RecordedCore
from skillwing.services.replay.steps import FORMAT, Head, Made

SOURCE = """
skillset crane {
    data { wind: float64 [m/s] period=1.0  limit: float64 [kg] }
    resource power { initial ON  extern ON -> OFF  extern OFF -> ON }
    resource hook { initial FREE  FREE -> TAKEN  TAKEN -> FREE }
    resource lamp { initial DARK  DARK -> LIT  LIT -> DARK }
    event blackout { guard resource=(power == ON) effect { power -> OFF } }
    skill lift {
        input { load: float64 [kg] = 1.0 }
        effect { take: hook -> TAKEN  free: hook -> FREE }
        precondition {
            free: resource=(hook == FREE)
            calm: data=(wind < 9.0)
            light: data=(limit > load)
            success take
        }
        invariant {
            power: resource=(power == ON) violation=free
            calm: data=(wind < 12.0) violation=free
        }
        interrupt { apply=free }
        result { success DONE: apply=free  failure STUCK: apply=free post resource=(lamp == DARK) }
    }
    skill shine {
        effect { light: lamp -> LIT  dark: lamp -> DARK }
        precondition { dark: resource=(lamp == DARK)  success light }
        invariant { busy: resource=(hook == TAKEN or power == ON) violation=dark }
        interrupt { apply=dark }
        result { END: apply=dark }
    }
}
"""
CRANE = parse(SOURCE, "crane.skillset")
HEAD = Head(FORMAT, "r1", CRANE.name, CRANE.schema_hash, "crane.skillset", SOURCE)

GOALS = st.sampled_from(["g1", "g2", "g3"])
SKILLS = st.sampled_from(["lift", "shine", "fly"])
TOKENS = st.integers(0, 5)


def _begin(skill: str, goal: str, load: object, incarnation: str) -> BeginGoal:
    return BeginGoal(
        goal_id=goal,
        skill=skill,
        inputs={"load": load} if skill == "lift" else {},
        manager=f"skill/{skill}",
        owner="t",
        schema=CRANE.schema_hash,
        incarnation=incarnation,
    )


def _end(skill: str, goal: str, token: int, how: EndKind) -> EndGoal:
    result = {"lift": "STUCK", "shine": "END"}.get(skill) if how is EndKind.RESULT else None
    return EndGoal(goal_id=goal, skill=skill, token=token, how=how, result=result)


def _outcome(skill: str, goal: str, ending: Ending, incarnation: str) -> RecordOutcome:
    terminal = Terminal(ending=ending, reason="It says so.")
    return RecordOutcome(
        goal_id=goal, skill=skill, terminal=terminal, manager=f"skill/{skill}", incarnation=incarnation
    )


EVENTS: st.SearchStrategy[Event] = st.one_of(
    st.builds(_begin, SKILLS, GOALS, st.sampled_from([1.0, 5, "heavy", {1: b"x"}]), st.sampled_from(["", "a", "b"])),
    st.builds(_end, SKILLS, GOALS, TOKENS, st.sampled_from(EndKind)),
    st.builds(_outcome, SKILLS, GOALS, st.sampled_from([Ending.BUSY, Ending.INTERRUPTED]), st.sampled_from(["a", "b"])),
    st.builds(lambda goal, skill, token: RenewGoal(goal_id=goal, skill=skill, token=token), GOALS, SKILLS, TOKENS),
    st.builds(
        lambda name, target: FireExtern(resource=name, target=target, source="grid"),
        st.sampled_from(["power", "hook", "pwoer"]),
        st.sampled_from(["ON", "OFF"]),
    ),
    st.just(FireEvent(event="blackout", source="grid")),
    st.builds(
        lambda name, value, t: DataSample(name=name, value=value, t=t),
        st.sampled_from(["wind", "limit", "heat"]),
        st.sampled_from([0.5, 3, 10.0, 20.0, "much"]),
        st.floats(0.0, 30.0),
    ),
    st.builds(lambda each: AttachManager(manager="skill/lift", incarnation=each), st.sampled_from(["a", "b"])),
    st.just(TimePassed()),
    st.just(ManagerGone("skill/lift")),
    st.builds(lambda goal: GoalSilent(goal, "silent for 2.0 s"), GOALS),
)


class RecordedLife:
    """Cores on one journal, one after the other, whose steps are recorded as a resource manager does it."""

    def __init__(self, folder: Path, *, file_bytes: int = FILE_BYTES) -> None:
        self.journal = Journal(None, Identity("r1", CRANE.name, CRANE.schema_hash))
        self.writer = StepWriter(folder, HEAD, file_bytes=file_bytes)
        self._ids = RecordIds("rm")
        self.now = 0.0
        self._make()
        self.journal.write(self.core.initial_entries(), (), 0.0, 0)

    def take(self, events: Iterable[tuple[Event, float]]) -> None:
        """Let each event happen so many seconds after the one before."""
        for event, pause in events:
            self.now += pause
            self._step(event)

    def go_back(self) -> None:
        """Continue from the journal with the present data, as a manager does whose write failed."""
        self._make(data=self.core.data)

    def come_back(self) -> None:
        """Continue from the journal in another process."""
        self.writer.close()
        self._make()
        self._step(Resumed())

    def _make(self, data: LatestData | None = None) -> None:
        snapshot = self.journal.snapshot() or EMPTY_SNAPSHOT
        self.core = ResourceCore(
            CRANE, source="resource_manager", new_record_id=self._ids, snapshot=snapshot, data=data
        )
        made = Made(self.now, None, snapshot, same_data=data is not None)
        self._recorded = RecordedCore(self.core, made, self.writer, self.journal.snapshot)

    def _step(self, event: Event) -> None:
        with suppress(RefusedError):
            step = self._recorded.step(event, self.now)
            records = [each for each in step.publications if isinstance(each, Record)]
            if step.entries or records:
                self.journal.write(step.entries, records, self.now, step.number)
