"""Entities of a bus at its Zenoh session: declarations, publishers, and queries in both directions."""

from __future__ import annotations

from collections.abc import Callable

import zenoh
import zenoh.ext

from skillwing.services.bus import Answer, Answered, NoReply, Refused, Sample
from skillwing.services.bus.agenda import Entry
from skillwing.services.bus.identity import split_asker
from skillwing.services.protocol import ErrorCode, ErrorReply, ProtocolError, decode, encode

REFUSAL = zenoh.Encoding("application/vnd.skillwing.refusal+msgpack")
"""Encoding of our own error replies. Zenoh also sends error replies, for example at a query's timeout."""
TIMEOUT_REPLY = b"Timeout"

Entity = (
    zenoh.Subscriber[None]
    | zenoh.Queryable[None]
    | zenoh.LivelinessToken
    | zenoh.ext.AdvancedSubscriber[None]
    | zenoh.ext.SampleMissListener[None]
)


class Declared:
    """Declarations that are cancelled together. Messages that are still in the mailbox are then not delivered.

    Zenoh withdraws a token without references: `register` holds all that are not cancelled.
    """

    def __init__(self, register: set[Declared]) -> None:
        self._register = register
        self._entities: tuple[Entity, ...] = ()
        self._cancelled = False
        register.add(self)

    def hold(self, *entities: Entity) -> None:
        self._entities = entities

    def silence(self) -> None:
        """Deliver nothing more: the whole session closes."""
        self._cancelled = True

    def cancel(self) -> None:
        self._cancelled = True
        self._register.discard(self)
        entities, self._entities = self._entities, ()
        for entity in entities:
            entity.undeclare()

    def while_declared(self, action: Callable[[], None]) -> None:
        if not self._cancelled:
            action()


class ZenohPublisher:
    """A publisher that does nothing once its bus is closed. closed: tells that it is."""

    def __init__(self, publisher: zenoh.Publisher | zenoh.ext.AdvancedPublisher, closed: Callable[[], bool]) -> None:
        self._publisher = publisher
        self._closed = closed

    def put(self, payload: bytes, attachment: bytes = b"") -> None:
        if not self._closed():
            self._publisher.put(payload, attachment=attachment or None)


class ZenohQuestion:
    """A query under way. The first answer completes it."""

    def __init__(self, on_answer: Callable[[Answer], None]) -> None:
        self._on_answer = on_answer
        self._completed = False
        self.answered = False
        """True if an answer is in the mailbox. Only Zenoh's thread uses it."""
        self.expiry: Entry | None = None

    def complete(self, answer: Answer) -> None:
        if self._completed:
            return
        self._completed = True
        if self.expiry is not None:
            self.expiry.cancel()
        self._on_answer(answer)


class ZenohRequest:
    """A received query. It drops Zenoh's query after the answer, which ends the query for the asker."""

    def __init__(self, query: zenoh.Query, *, signed_keys: bool) -> None:
        self._query: zenoh.Query | None = query
        self._reply_key = str(query.key_expr)
        self._key, self._asker = split_asker(self._reply_key) if signed_keys else (self._reply_key, None)
        self._payload = query.payload.to_bytes() if query.payload is not None else b""
        self._attachment = query.attachment.to_bytes() if query.attachment is not None else b""

    @property
    def key(self) -> str:
        return self._key

    @property
    def asker(self) -> str | None:
        return self._asker

    @property
    def payload(self) -> bytes:
        return self._payload

    @property
    def attachment(self) -> bytes:
        return self._attachment

    def reply(self, payload: bytes, attachment: bytes = b"") -> None:
        with self._take() as query:
            query.reply(self._reply_key, payload, attachment=attachment or None)

    def refuse(self, error: ErrorReply) -> None:
        with self._take() as query:
            query.reply_err(encode(error), encoding=REFUSAL)

    def _take(self) -> zenoh.Query:
        query, self._query = self._query, None
        if query is None:
            raise RuntimeError(f"the query on `{self._key}` was answered twice; answer each query once")
        return query


def size_of(query: zenoh.Query) -> int:
    """Bytes of a query that waits."""
    return sum(len(each) for each in (query.payload, query.attachment) if each is not None)


def sample_of(sample: zenoh.Sample) -> Sample:
    """A copy. Zenoh's sample would keep alive the whole buffer in which it was received."""
    attachment = sample.attachment.to_bytes() if sample.attachment is not None else b""
    return Sample(str(sample.key_expr), sample.payload.to_bytes(), attachment)


def answer_of(reply: zenoh.Reply) -> Answer:
    """The answer in a reply: a payload, our own refusal, or silence for Zenoh's timeout and other errors."""
    if reply.ok is not None:
        sample = sample_of(reply.ok)
        return Answered(sample.payload, sample.attachment)
    error = reply.err
    if error is None:
        return NoReply(timed_out=False)
    payload = error.payload.to_bytes()
    if error.encoding != REFUSAL:
        return NoReply(timed_out=payload == TIMEOUT_REPLY)
    try:
        return Refused(decode(payload, ErrorReply))
    except ProtocolError as problem:
        return Refused(ErrorReply(code=ErrorCode.INTERNAL, message=f"The refusal itself is malformed: {problem}."))
