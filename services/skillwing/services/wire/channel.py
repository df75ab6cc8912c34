"""One row of a table of keys: the traffic at a key, the roles of its two sides, and its rate."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, TypeAlias

from skillwing.services.protocol import ErrorCode, Keys, Message

ANY_QUERY = (ErrorCode.BAD_REQUEST, ErrorCode.DENIED, ErrorCode.INTERNAL)
"""Refusals that every query has to expect."""


class Role(StrEnum):
    """Role of a process, a person or a station in the traffic of a robot. Each value is a noun for people."""

    RESOURCE_MANAGER = "resource manager"
    DATA_MANAGER = "data manager"
    SKILL_MANAGER = "skill manager"
    FUNCTIONAL_LAYER = "functional layer"
    MOCKED_WORLD = "mocked world"
    MISSION = "mission"
    RECORDER = "recorder"
    LAUNCHER = "launcher"
    VIEWER = "viewer"
    CLIENT = "client"
    OPERATOR = "operator"


PEOPLE = (Role.VIEWER, Role.CLIENT, Role.OPERATOR)
"""Roles of people and stations. Each one includes those before it."""
PROCESSES = tuple(role for role in Role if role not in PEOPLE)
EVERYBODY = tuple(Role)
Side: TypeAlias = str
"""A `Role`, or a process of the functional layer by its name."""


def words(sides: tuple[Side, ...]) -> str:
    """Sides of a key for people: `everybody`, `every process, client, operator`."""
    if set(sides) == set(EVERYBODY):
        return "everybody"
    some = set(sides) >= set(PROCESSES)
    rest = (side for side in sides if side not in PROCESSES) if some else iter(sides)
    return ", ".join((*(("every process",) if some else ()), *rest))


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
    name. offered_by, used_by: its two sides. message: the publication, the header of an array, or the request; a class
    or a union of tagged ones, None for a token. reply: of a query. refusals: in addition to `ANY_QUERY`. duty: only in
    the functional layer. rate: publications per second [Hz]. when: the condition or occasion of publications. array:
    content of the payload, in C order and little-endian. The Markdown template of a key's page explains the key.
    """

    key: str | Callable[[Keys, str], str]
    kind: Kind
    offered_by: tuple[Side, ...]
    used_by: tuple[Side, ...]
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
