"""Questions to all processes of a name at once. The bus takes only the first answer to a question."""

from __future__ import annotations

import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass, field

import msgspec
import zenoh

from skillwing.services.bus.identity import SessionIdentity, signed
from skillwing.services.bus.zenoh_entities import REFUSAL
from skillwing.services.diagnosis.evidence import ClockSeen, Probe, ProbeReply
from skillwing.services.protocol import CLOCK_KEY, ClockTick, ErrorReply, Message, ProtocolError, decode, encode

TIMEOUT = 1.5
"""Seconds in which a process can answer."""


@dataclass(frozen=True)
class ProbeRequest:
    """A question to a process, by its name, that changes nothing."""

    process: str
    key: str
    message: Message


def ask_all(
    session: zenoh.Session,
    identity: SessionIdentity | None,
    questions: tuple[ProbeRequest, ...],
    timeout: float = TIMEOUT,
) -> tuple[Probe, ...]:
    """Ask all questions at once and wait for all answers, at most `timeout` seconds.

    identity: of the session. Questions that its role may not ask are left out.
    """
    calls = [_Call(each) for each in questions if identity is None or identity.refusal(each.key) is None]
    for call in calls:
        key = call.question.key
        session.get(
            key if identity is None else signed(key, identity.name),
            zenoh.handlers.Callback(call.receive, call.done.set, indirect=False),
            payload=encode(call.question.message),
            target=zenoh.QueryTarget.ALL,
            consolidation=zenoh.ConsolidationMode.NONE,
            timeout=timeout,
        )
    deadline = time.monotonic() + 2 * timeout
    for call in calls:
        call.done.wait(max(0.0, deadline - time.monotonic()))
    return tuple(Probe(call.question.process, tuple(call.replies)) for call in calls)


def alive(session: zenoh.Session, key_expression: str) -> frozenset[str]:
    """The liveliness keys that exist now."""
    replies = session.liveliness().get(key_expression, timeout=TIMEOUT)
    return frozenset(str(reply.ok.key_expr) for reply in replies if reply.ok is not None)


def watch_clock(session: zenoh.Session, seconds: float) -> ClockSeen:
    """Listen to robot time for some wall seconds."""
    seen: list[tuple[float, ClockTick]] = []

    def receive(sample: zenoh.Sample) -> None:
        received = time.monotonic()
        try:
            seen.append((received, decode(sample.payload.to_bytes(), ClockTick)))
        except ProtocolError:
            return  # a clock that cannot be read is no clock

    subscriber = session.declare_subscriber(CLOCK_KEY, zenoh.handlers.Callback(receive, indirect=False))
    time.sleep(seconds)
    subscriber.undeclare()
    if not seen:
        return ClockSeen(watched=seconds)
    (begun, first), (ended, last) = seen[0], seen[-1]
    return ClockSeen(seconds, len(seen), elapsed=last.t - first.t, between=ended - begun, factor=last.factor)


@dataclass
class _Call:
    question: ProbeRequest
    replies: list[ProbeReply] = field(default_factory=list[ProbeReply])
    done: threading.Event = field(default_factory=threading.Event)

    def receive(self, reply: zenoh.Reply) -> None:
        who = str(reply.replier_id)
        if reply.ok is not None:
            payload = reply.ok.payload.to_bytes()
            self.replies.append(ProbeReply(who, _version(payload), payload))
        elif reply.err is not None and reply.err.encoding == REFUSAL:
            payload = reply.err.payload.to_bytes()
            self.replies.append(ProbeReply(who, _version(payload), payload, _refusal(payload)))


def _version(payload: bytes) -> int | None:
    """The protocol version of a message of any version."""
    try:
        fields = msgspec.msgpack.decode(payload)
    except (msgspec.DecodeError, ValueError, RecursionError):
        return None
    version = fields.get("v") if isinstance(fields, Mapping) else None
    return version if isinstance(version, int) else None


def _refusal(payload: bytes) -> ErrorReply | None:
    try:
        return decode(payload, ErrorReply)
    except ProtocolError:
        return None
