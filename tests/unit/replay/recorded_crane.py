"""A small skillset, whatever may happen to its resource manager, and cores whose steps are written down."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from hypothesis import strategies as st

from skillwing.dsl import parse
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.resource_core import Step
from skillwing.services.ids import RecordIds
from skillwing.services.journal.journal import Journal
from skillwing.services.journal.schema import Identity
from skillwing.services.protocol import (
    AttachManager,
    BeginGoal,
    DataSample,
    EndGoal,
    EndKind,
    FireEvent,
    FireExtern,
    Record,
    RenewGoal,
)
from skillwing.services.replay.files import FILE_BYTES, StepWriter
from skillwing.services.replay.recorded_core import RecordedCore
from skillwing.services.replay.steps import (
    FORMAT,
    Attach,
    Begin,
    Datum,
    End,
    Event,
    Extern,
    GoalSilent,
    Head,
    ManagerGone,
    Question,
    Renew,
    Resume,
    Tick,
)

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


def _begin(skill: str, goal: str, load: object, incarnation: str) -> Begin:
    inputs = {"load": load} if skill == "lift" else {}
    return Begin(
        BeginGoal(
            goal_id=goal,
            skill=skill,
            inputs=inputs,
            manager=f"skill/{skill}",
            owner="t",
            schema=CRANE.schema_hash,
            incarnation=incarnation,
        )
    )


def _end(skill: str, goal: str, token: int, how: EndKind) -> End:
    result = {"lift": "STUCK", "shine": "END"}.get(skill) if how is EndKind.RESULT else None
    return End(EndGoal(goal_id=goal, skill=skill, token=token, how=how, result=result))


QUESTIONS: st.SearchStrategy[Question] = st.one_of(
    st.builds(_begin, SKILLS, GOALS, st.sampled_from([1.0, 5, "heavy", {1: b"x"}]), st.sampled_from(["", "a", "b"])),
    st.builds(_end, SKILLS, GOALS, TOKENS, st.sampled_from(EndKind)),
    st.builds(
        lambda goal, skill, token: Renew(RenewGoal(goal_id=goal, skill=skill, token=token)), GOALS, SKILLS, TOKENS
    ),
    st.builds(
        lambda name, target: Extern(FireExtern(resource=name, target=target, source="grid")),
        st.sampled_from(["power", "hook", "pwoer"]),
        st.sampled_from(["ON", "OFF"]),
    ),
    st.just(Event(FireEvent(event="blackout", source="grid"))),
    st.builds(
        lambda name, value, t: Datum(DataSample(name=name, value=value, t=t)),
        st.sampled_from(["wind", "limit", "heat"]),
        st.sampled_from([0.5, 3, 10.0, 20.0, "much"]),
        st.floats(0.0, 30.0),
    ),
    st.builds(lambda each: Attach(AttachManager(manager="skill/lift", incarnation=each)), st.sampled_from(["a", "b"])),
    st.just(Tick()),
    st.just(ManagerGone("skill/lift", "its alive token is gone")),
    st.builds(lambda goal: GoalSilent(goal, "silent for 2.0 s"), GOALS),
)


class RecordedLife:
    """Cores on one journal, one after the other, whose steps go to a folder as those of a resource manager do."""

    def __init__(self, folder: Path, *, file_bytes: int = FILE_BYTES) -> None:
        self.journal = Journal(None, Identity("r1", CRANE.name, CRANE.schema_hash))
        self.writer = StepWriter(folder, HEAD, file_bytes=file_bytes)
        self._ids = RecordIds("rm")
        self.now = 0.0
        self.core = self._make(resumed=False)
        self.journal.write(self.core.initial_entries(), (), 0.0)

    def ask(self, questions: Iterable[tuple[Question, float]]) -> None:
        """Each question so many seconds after the one before."""
        for question, pause in questions:
            self.now += pause
            self._put(question)

    def go_back(self) -> None:
        """What a manager does that could not write a step down: it goes on from the journal, with the data it has."""
        self.core = self._make(resumed=True, data=True)

    def come_back(self) -> None:
        """Another process goes on from the journal."""
        self.writer.close()
        self.core = self._make(resumed=True)
        kept = self.journal.snapshot()
        assert kept is not None
        self._put(Resume(kept))

    def _make(self, *, resumed: bool, data: bool = False) -> RecordedCore:
        return RecordedCore(
            CRANE,
            source="resource_manager",
            new_record_id=self._ids,
            writer=self.writer,
            remembered=self.journal.kept,
            now=self.now,
            kept=self.journal.snapshot() if resumed else None,
            data=self.core.data if data else None,
        )

    def _put(self, question: Question) -> None:
        with suppress(RefusedError):
            step: Step[object] = question.put_to(self.core, self.now)
            records = [each for each in step.publications if isinstance(each, Record)]
            if step.entries or records:
                self.journal.write(step.entries, records, self.now)
