"""What a resource manager was asked and what it answered, as it is written down and as it is asked once more."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeAlias

import msgspec

from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.resource_core import ResourceCore, Step
from skillwing.services.core.snapshot import Snapshot
from skillwing.services.journal.schema import Identity
from skillwing.services.protocol import (
    AttachManager,
    BeginGoal,
    DataSample,
    EndGoal,
    ErrorReply,
    FireEvent,
    FireExtern,
    RecordOutcome,
    RenewGoal,
)

FORMAT = 3
"""Raised whenever what is written below changes its form."""


# --- questions: one for each kind of step that a core takes; each knows how to be put ---------------------------------


class Extern(msgspec.Struct, frozen=True, tag="extern"):
    request: FireExtern

    def put_to(self, core: ResourceCore, t: float) -> Step[Any]:
        return core.fire_extern(self.request, t)


class Event(msgspec.Struct, frozen=True, tag="event"):
    request: FireEvent

    def put_to(self, core: ResourceCore, t: float) -> Step[Any]:
        return core.fire_event(self.request, t)


class Datum(msgspec.Struct, frozen=True, tag="datum"):
    sample: DataSample

    def put_to(self, core: ResourceCore, t: float) -> Step[Any]:
        return core.update_datum(self.sample, t)


class Tick(msgspec.Struct, frozen=True, tag="tick"):
    def put_to(self, core: ResourceCore, t: float) -> Step[Any]:
        return core.tick(t)


class Attach(msgspec.Struct, frozen=True, tag="attach"):
    request: AttachManager

    def put_to(self, core: ResourceCore, t: float) -> Step[Any]:
        return core.attach_manager(self.request, t)


class Begin(msgspec.Struct, frozen=True, tag="begin"):
    request: BeginGoal

    def put_to(self, core: ResourceCore, t: float) -> Step[Any]:
        return core.begin(self.request, t)


class End(msgspec.Struct, frozen=True, tag="end"):
    request: EndGoal

    def put_to(self, core: ResourceCore, t: float) -> Step[Any]:
        return core.end(self.request, t)


class Outcome(msgspec.Struct, frozen=True, tag="outcome"):
    request: RecordOutcome

    def put_to(self, core: ResourceCore, t: float) -> Step[Any]:
        return core.record_outcome(self.request, t)


class Renew(msgspec.Struct, frozen=True, tag="renew"):
    request: RenewGoal

    def put_to(self, core: ResourceCore, t: float) -> Step[Any]:
        del t
        return core.renew(self.request)


class ManagerGone(msgspec.Struct, frozen=True, tag="manager_gone"):
    manager: str
    reason: str

    def put_to(self, core: ResourceCore, t: float) -> Step[Any]:
        return core.manager_lost(self.manager, t, self.reason)


class GoalSilent(msgspec.Struct, frozen=True, tag="goal_silent"):
    goal_id: str
    reason: str

    def put_to(self, core: ResourceCore, t: float) -> Step[Any]:
        return core.goal_lost(self.goal_id, t, self.reason)


class Resume(msgspec.Struct, frozen=True, tag="resume"):
    kept: Snapshot

    def put_to(self, core: ResourceCore, t: float) -> Step[Any]:
        return core.resume(self.kept, t)


Question: TypeAlias = (
    Extern | Event | Datum | Tick | Attach | Begin | End | Outcome | Renew | ManagerGone | GoalSilent | Resume
)


# --- answers ---------------------------------------------------------------------------------------------------------


class Done(msgspec.Struct, frozen=True, tag="done"):
    """reply: to the one who asked; said: what was published, in order; kept: what went into the journal."""

    reply: Any
    said: tuple[Any, ...]
    kept: tuple[Any, ...]


class Refused(msgspec.Struct, frozen=True, tag="refused"):
    error: ErrorReply


class Broken(msgspec.Struct, frozen=True, tag="broken"):
    """The core raised what it never should."""

    error: str


Answer: TypeAlias = Done | Refused | Broken


def answer_of(step: Step[Any] | Exception) -> Answer:
    """What a step that was taken, or what it raised instead, says to the world."""
    match step:
        case RefusedError():
            return Refused(step.reply)
        case Exception():
            return Broken(f"{type(step).__name__}: {step}")
        case Step(reply, publications, entries):
            return Done(reply, publications, entries)


# --- what is written, in this order: a head; then cores that were made, each followed by what it was asked ------------


class Head(msgspec.Struct, frozen=True):
    """Whose steps these are. text, file: the source of the skillset, and the name by which its language is known."""

    format: int
    robot: str
    skillset: str
    schema: str
    file: str
    text: str


def head_of(identity: Identity, source: Path) -> Head:
    """The head for the steps of that robot, whose skillset has this source. Raises OSError."""
    text = source.read_text(encoding="utf-8")
    return Head(FORMAT, identity.robot, identity.skillset, identity.schema, source.name, text)


class Made(msgspec.Struct, frozen=True, tag="made"):
    """A core was made: arguments as of `ResourceCore`. same_data: with the latest data of the core before it."""

    t: float
    found: dict[str, str] | None
    kept: Snapshot | None
    same_data: bool


class Asked(msgspec.Struct, frozen=True, tag="asked"):
    """t: robot time, for a renewal that of the step before. record_ids: those that the shell gave to new timeline
    records. answer: encoded, for that is how it is compared.
    """

    t: float
    question: Question
    record_ids: tuple[str, ...]
    answer: msgspec.Raw


Line: TypeAlias = Made | Asked

_encoder = msgspec.msgpack.Encoder()
_line_decoder = msgspec.msgpack.Decoder(Line)
_head_decoder = msgspec.msgpack.Decoder(Head)

encoded: Callable[[object], bytes] = _encoder.encode
decoded_line: Callable[[bytes], Line] = _line_decoder.decode
decoded_head: Callable[[bytes], Head] = _head_decoder.decode
