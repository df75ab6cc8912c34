"""A small skillset with one of everything, and cores on a workbench."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from soundness import assert_all_sound

from skillwing.dsl import parse
from skillwing.dsl.model import Skillset
from skillwing.services.core.manager_state import Publication
from skillwing.services.core.resource_core import ResourceCore, Step
from skillwing.services.core.snapshot import Entry
from skillwing.services.ids import RecordIds
from skillwing.services.protocol import (
    AttachManager,
    BeginGoal,
    DataSample,
    EndGoal,
    EndKind,
    FireEvent,
    FireExtern,
    GoalVerdict,
    Granted,
    Record,
    RecordKind,
    RenewGoal,
    Violated,
)

RIG = parse(
    """
    skillset rig {
        data { battery: float64 [%] period=1.0 }
        resource authority { initial ON  extern ON -> OFF  extern OFF -> ON }
        resource door { initial CLOSED  extern CLOSED -> OPEN  extern OPEN -> CLOSED }
        resource axes { initial FREE  FREE -> USED  USED -> FREE }
        resource lamp {
            state { OFF LIT BROKEN }
            initial OFF
            OFF -> LIT
            LIT -> OFF
            extern * -> BROKEN
            extern BROKEN -> OFF
        }
        event storm { guard resource=(authority == ON) effect { authority -> OFF  door -> OPEN } }

        skill move {
            deadline=60.0
            progress=0.5 { distance: float64 [m] }
            input { speed: float64 [m/s] in 0.1..3.0 = 1.0 modifiable  label: string = "a" }
            output { distance: float64 [m] }
            effect { take: axes -> USED  release: axes -> FREE }
            precondition {
                authority: resource=(authority == ON)
                free: resource=(axes == FREE)
                charged: data=(battery > 15.0)
                success take
            }
            invariant {
                authority: resource=(authority == ON) violation=release
                charged: data=(battery > 10.0) violation=release
            }
            interrupt { apply=release timeout=2.0 }
            result {
                success DONE: apply=release
                failure STUCK: apply=release post resource=(door == CLOSED)
            }
        }

        skill shine {
            effect { light: lamp -> LIT  dark: lamp -> OFF }
            precondition { off: resource=(lamp == OFF)  success light }
            invariant { moving: resource=(axes == USED) violation=dark }
            interrupt { apply=dark timeout=2.0 }
            result { END: apply=dark }
        }

        skill watch {
            effect { none {} }
            precondition { success none }
            invariant { something: resource=(lamp == LIT or axes == USED or authority == ON) violation=none }
            result { END: apply=none }
        }

        skill carry {
            effect { take { axes -> USED  lamp -> LIT }  release { axes -> FREE  lamp -> OFF } }
            precondition { free: resource=(axes == FREE)  success take }
            result { END: apply=release }
        }
    }
    """,
    "rig.skillset",
)


def granted(verdict: object) -> Granted:
    """The grant that an answer is."""
    assert isinstance(verdict, Granted)
    return verdict


class Bench:
    """A resource core and everything that it has published; requests in short."""

    def __init__(self, skillset: Skillset = RIG) -> None:
        self.skillset = skillset
        self.core = ResourceCore(skillset, source="rm", new_record_id=RecordIds("rm"))
        self.published: list[Publication] = []
        self.kept: list[Entry] = []
        self.now = 0.0

    def perform(self, step: Step) -> Any:
        assert_all_sound((*step.publications, step.reply), self.now)
        self.published += step.publications
        self.kept += step.entries
        return step.reply

    def begin(
        self,
        skill: str,
        goal_id: str,
        manager: str = "",
        incarnation: str = "",
        cause: str | None = None,
        **inputs: Any,
    ) -> GoalVerdict:
        request = BeginGoal(
            goal_id=goal_id,
            skill=skill,
            inputs=inputs,
            manager=manager or f"skill/{skill}",
            owner="test",
            schema=self.skillset.schema_hash,
            cause=cause,
            incarnation=incarnation,
        )
        return self.perform(self.core.step(request, self.now))

    def end(
        self,
        skill: str,
        goal_id: str,
        token: int,
        how: EndKind = EndKind.RESULT,
        result: str | None = None,
        incarnation: str = "",
        cause: str | None = None,
    ) -> GoalVerdict:
        request = EndGoal(
            goal_id=goal_id, skill=skill, token=token, how=how, result=result, cause=cause, incarnation=incarnation
        )
        return self.perform(self.core.step(request, self.now))

    def attach(self, manager: str, incarnation: str) -> Any:
        request = AttachManager(manager=manager, incarnation=incarnation)
        return self.perform(self.core.step(request, self.now))

    def renew(self, skill: str, goal_id: str, token: int) -> GoalVerdict:
        return self.perform(self.core.step(RenewGoal(goal_id=goal_id, skill=skill, token=token), self.now))

    def fire(self, event: str, cause: str | None = None) -> Any:
        return self.perform(self.core.step(FireEvent(event=event, source="test", cause=cause), self.now))

    def extern(self, resource: str, target: str, cause: str | None = None) -> Any:
        request = FireExtern(resource=resource, target=target, source="test", cause=cause)
        return self.perform(self.core.step(request, self.now))

    def battery(self, percent: Any) -> None:
        self.datum("battery", percent)

    def datum(self, name: str, value: Any) -> None:
        sample = DataSample(name=name, value=value, t=self.now)
        self.perform(self.core.step(sample, self.now))

    def of(self, kind: type[Any], where: Callable[[Any], bool] = lambda publication: True) -> list[Any]:
        return [publication for publication in self.published if isinstance(publication, kind) and where(publication)]

    @property
    def violations(self) -> list[tuple[str, str]]:
        return [(violated.skill, violated.invariant) for violated in self.of(Violated)]

    @property
    def changes(self) -> list[tuple[str, str]]:
        """Resources that changed, with their new states."""
        changes = self.of(Record, lambda record: record.kind is RecordKind.RESOURCE)
        return [(change.subject, change.after) for change in changes]

    def chain(self, record_id: str | None) -> list[str]:
        """Causes of a record, the root first, as `subject after`."""
        records = {record.id: record for record in self.of(Record)}
        steps: list[str] = []
        while record_id is not None:
            record = records.get(record_id)
            steps.append(f"{record.subject} {record.after}" if record else record_id)
            record_id = record.cause if record else None
        return steps[::-1]
