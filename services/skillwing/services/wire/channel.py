"""One row of a table of keys: the traffic at a key, its two sides, and its rate."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from skillwing.services.protocol import ErrorCode, Keys, Message

ANY_QUERY = (ErrorCode.BAD_REQUEST, ErrorCode.INTERNAL)
"""Refusals that every query has to expect."""


class Kind(StrEnum):
    """Use of a key: answers, publications, or a sign of life."""

    QUERY = "query"
    EVENTS = "events"
    STREAM = "stream"
    ARRAYS = "array stream"
    TOKEN = "liveliness token"


class Each(StrEnum):
    """Kind of name in the changing part of a key."""

    SKILL = "skill"
    DATUM = "datum"
    EVENT = "event"
    PROCESS = "process"
    SENSOR = "sensor"


class Duty(StrEnum):
    """Importance of a key of the functional layer, for the process that offers it."""

    MUST = "must"
    SHOULD = "should"
    SOME = "for some skills"
    TRIALS = "trials only"


@dataclass(frozen=True, slots=True)
class Channel:
    """A key, or one key for each name of a kind.

    key: its text, without the last part if that is a name; or a function that spells it for one name. each: the kind of
    name. message: the publication, the header of an array, or the request; a class or a union of tagged ones, None for
    a token. reply: of a query. refusals: in addition to `ANY_QUERY`. duty: only in the functional layer. rate:
    publications per second [Hz]. when: the condition or occasion of publications. array: content of the payload, in C
    order and little-endian. The Markdown template of a key's page explains the key.
    """

    key: str | Callable[[Keys, str], str]
    kind: Kind
    offered_by: str
    used_by: tuple[str, ...]
    message: type[Message] | Any = None
    reply: type[Message] | Any = None
    refusals: tuple[ErrorCode, ...] = ()
    each: Each | None = None
    duty: Duty | None = None
    rate: float | None = None
    when: str = ""
    array: str = ""

    @property
    def pattern(self) -> str:
        """The key with placeholders: `SKILLSET/skill/SKILL/start`."""
        return self.spell(Keys("SKILLSET"), self.each.upper() if self.each else "")

    def spell(self, keys: Keys, name: str) -> str:
        """The key of one name."""
        if callable(self.key):
            return self.key(keys, name)
        return f"{self.key}/{name}" if self.each else self.key

    @property
    def rate_text(self) -> str:
        """Rate and occasion of publications in a few words."""
        hertz = "" if self.rate is None else f"{self.rate:g} Hz"
        together = " " if self.when.startswith("and ") else ", "
        return together.join(each for each in (hertz, self.when) if each)
