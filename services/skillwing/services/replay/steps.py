"""Recorded form of the steps of a resource manager.

A file holds a head, then created cores, each followed by its steps.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias

import msgspec

from skillwing.services.core.events import Event
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.resource_core import Step
from skillwing.services.core.snapshot import Snapshot
from skillwing.services.journal.schema import Identity
from skillwing.services.protocol import ErrorReply

FORMAT = 3
"""Format version. Increase it with the protocol version, and for each change of this module's types."""


class Head(msgspec.Struct, frozen=True):
    """Identity of the robot. text, file: source of the skillset, and its file name, which determines the language."""

    format: int
    robot: str
    skillset: str
    schema: str
    file: str
    text: str


def head_of(identity: Identity, source: Path) -> Head:
    """The head for the steps of a robot with that skillset. Raises OSError."""
    text = source.read_text(encoding="utf-8")
    return Head(FORMAT, identity.robot, identity.skillset, identity.schema, source.name, text)


class Made(msgspec.Struct, frozen=True, tag="made"):
    """A new core; arguments as of `ResourceCore`. same_data: it has the latest data of the core before it."""

    t: float
    found: dict[str, str] | None
    snapshot: Snapshot
    same_data: bool


class Taken(msgspec.Struct, frozen=True, tag="taken"):
    """A step at robot time t. answer: encoded, because replay compares the bytes."""

    t: float
    event: Event
    answer: msgspec.Raw


Line: TypeAlias = Made | Taken


class RefusedAnswer(msgspec.Struct, frozen=True, tag="refused"):
    """Answer of a core that refused."""

    error: ErrorReply


class BrokenAnswer(msgspec.Struct, frozen=True, tag="broken"):
    """Answer of a core that raised an unexpected exception."""

    error: str


Answer: TypeAlias = Step | RefusedAnswer | BrokenAnswer


def answer_of(outcome: Step | Exception) -> Answer:
    """The outcome of a step as a value."""
    match outcome:
        case RefusedError():
            return RefusedAnswer(outcome.reply)
        case Exception():
            return BrokenAnswer(f"{type(outcome).__name__}: {outcome}")
        case step:
            return step


_encoder = msgspec.msgpack.Encoder()
_line_decoder = msgspec.msgpack.Decoder(Line)
_head_decoder = msgspec.msgpack.Decoder(Head)

encoded: Callable[[object], bytes] = _encoder.encode
decoded_line: Callable[[bytes], Line] = _line_decoder.decode
decoded_head: Callable[[bytes], Head] = _head_decoder.decode
