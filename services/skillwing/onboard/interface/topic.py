"""One row of the interface: a key, what travels there, between whom, and who cannot do without it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from skillwing.services.protocol import ErrorCode, Message

VEHICLE, GUIDANCE, BRIDGE = "sim", "guidance", "bridge"
OBSTACLES, MAPPING = "obstacles", "mapping"
VIDEO, LINK, GROUND = "video", "link", "ground"
SKILLS, RECORDER = "skill managers", "recorder"
"""Names of processes; the managers of all skills go by one name. `sim` is what a vehicle stands in for."""
EVERYBODY = "everybody"


class Kind(StrEnum):
    """How a key is used, hence what is owed to it."""

    STREAM = "stream"
    ARRAYS = "array stream"
    EVENTS = "events"
    QUERY = "query"


class Duty(StrEnum):
    """How badly it is needed, of whoever stands in the place of the one who offers it."""

    MUST = "must"
    SHOULD = "should"
    SOME = "for some skills"
    TRIALS = "trials only"


@dataclass(frozen=True, slots=True)
class Topic:
    """One row.

    message: the publication, the header of an array, or the request. rate: publications per second [Hz], None for
    those that come when there is something to say, and then `when` says when; both where the rate holds only at times.
    used_by: who listens, or who asks. array: what the payload holds, in C order and little-endian. without: what
    becomes of the robot when it is missing or late. refusals: besides BAD_REQUEST, which every query has to expect.
    each: what the last part of the key names, where there are several keys.
    """

    key: str
    kind: Kind
    message: type[Message]
    duty: Duty
    offered_by: str
    used_by: tuple[str, ...]
    meaning: str
    without: str
    rate: float | None = None
    when: str = ""
    reply: type[Message] | None = None
    array: str = ""
    refusals: tuple[ErrorCode, ...] = ()
    each: str = ""

    @property
    def pattern(self) -> str:
        """The key, with a placeholder in capitals where there are several."""
        return f"{self.key}/{self.each.upper()}" if self.each else self.key

    def facts(self) -> dict[str, Any]:
        """The row for programs."""
        return {
            "key": self.pattern,
            "kind": self.kind,
            "message": self.message.__name__,
            "reply": None if self.reply is None else self.reply.__name__,
            "array": self.array,
            "rate": self.rate,
            "when": self.when,
            "duty": self.duty,
            "offered_by": self.offered_by,
            "used_by": self.used_by,
            "refusals": (ErrorCode.BAD_REQUEST, *self.refusals) if self.kind is Kind.QUERY else (),
            "meaning": self.meaning,
            "without": self.without,
        }
