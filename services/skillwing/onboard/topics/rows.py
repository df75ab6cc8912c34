"""Rows of topics by kind, each with its two sides, the duty of the offering process, rate [Hz] and occasion."""

from __future__ import annotations

from typing import TypeAlias

from skillwing.services.protocol import ErrorCode, Message
from skillwing.services.wire.channel import Channel, Duty, Each, Kind, Side

Sides: TypeAlias = tuple[Side, ...]
Class: TypeAlias = type[Message]


def stream(
    key: str, message: Class, offered_by: Side, used_by: Sides, duty: Duty, rate: float | None = None, when: str = ""
) -> Channel:
    """Row of a stream."""
    return Channel(key, Kind.STREAM, (offered_by,), used_by, message, duty=duty, rate=rate, when=when)


def arrays(
    key: str,
    header: Class,
    offered_by: Side,
    used_by: Sides,
    duty: Duty,
    array: str,
    rate: float | None = None,
    when: str = "",
) -> Channel:
    """Row of an array stream. array: content of the payload."""
    return Channel(key, Kind.ARRAYS, (offered_by,), used_by, header, duty=duty, rate=rate, when=when, array=array)


def events(
    key: str, message: Class, offered_by: Side, used_by: Sides, duty: Duty, when: str, each: Each | None = None
) -> Channel:
    """Row of events. each: kind of name at the end of the key."""
    return Channel(key, Kind.EVENTS, (offered_by,), used_by, message, each=each, duty=duty, when=when)


def query(
    key: str,
    request: Class,
    reply: Class,
    offered_by: Side,
    used_by: Sides,
    duty: Duty,
    *refusals: ErrorCode,
    array: str = "",
) -> Channel:
    """Row of a query. array: content of the reply's payload."""
    return Channel(key, Kind.QUERY, (offered_by,), used_by, request, reply, refusals, duty=duty, array=array)
