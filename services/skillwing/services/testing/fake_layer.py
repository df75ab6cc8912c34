"""A functional layer for tests: real code against a fake peer at the edge of the protocol."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, TypeVar, overload

from skillwing.services.bus import Bus, Publisher, Request, Sample
from skillwing.services.core.refusal import RefusedError
from skillwing.services.protocol import ErrorCode, ErrorReply, Message, decode, encode

M = TypeVar("M", bound=Message)


@dataclass(frozen=True, slots=True)
class ReceivedRequest:
    """A request that reached the layer. t: robot time [s]."""

    t: float
    key: str
    message: Message


@dataclass(frozen=True, slots=True)
class ReceivedMessage:
    """A publication that the layer listens to. t: robot time [s]."""

    t: float
    key: str
    sample: Sample


@dataclass(frozen=True, slots=True)
class _Answer:
    kind: type[Any]
    reply: Callable[[Any], Message]


class FakeLayer:
    """Publishes, answers requests, and remembers what it was asked and what it heard.

    Use it as it is and tell it what to do from the test, or derive a robot's own from it and declare that in `setup`.
    Two switches make it misbehave: `refusal`, a sentence with which it refuses every request while it is set, and
    `deaf`, the number of requests to come that it does not hear.
    """

    name = "functional_layer"
    owns_clock = False
    listens: ClassVar[tuple[str, ...]] = ("fl/**",)
    """Key expressions of what is remembered for `heard`."""

    def __init__(self) -> None:
        self.refusal: str | None = None
        self.deaf = 0
        self.requests: list[ReceivedRequest] = []
        self.publications: list[ReceivedMessage] = []
        self._answers: dict[str, _Answer] = {}
        self._publishers: dict[str, Publisher] = {}
        self._bus: Bus | None = None

    # --- to override -------------------------------------------------------------------------------------------------

    def setup(self) -> None:
        """Runs once, when the layer is on the bus: `answer` requests, subscribe, start timers."""

    # --- the node ----------------------------------------------------------------------------------------------------

    @property
    def bus(self) -> Bus:
        """The network. A RuntimeError before the layer is attached to it."""
        if self._bus is None:
            raise RuntimeError("The layer is on no bus yet. Use it after the test bench was made with it, or in setup.")
        return self._bus

    def attach(self, bus: Bus) -> None:
        self._bus = bus
        for expression in self.listens:
            bus.subscribe(expression, self._hear, events=True)
        for key in self._answers:
            bus.serve(key, self._take)
        self.setup()

    def detach(self) -> None:
        """Nothing outlives it."""

    # --- publishing --------------------------------------------------------------------------------------------------

    def publish(self, key: str, message: Message | bytes, *, events: bool = False) -> None:
        """Publish one message. events: as in `Bus.advertise`, decided by the first publication on a key."""
        payload = message if isinstance(message, bytes) else encode(message)
        self._publisher(key, events=events).put(payload)

    def publish_array(self, key: str, header: Message, payload: bytes) -> None:
        """Publish one array of a stream: raw bytes and what they mean."""
        self._publisher(key, events=False).put(payload, encode(header))

    def _publisher(self, key: str, *, events: bool) -> Publisher:
        if key not in self._publishers:
            self._publishers[key] = self.bus.advertise(key, events=events)
        return self._publishers[key]

    # --- answering ---------------------------------------------------------------------------------------------------

    def answer(self, key: str, kind: type[M], reply: Message | Callable[[M], Message]) -> None:
        """Answer every request of `kind` on a key with `reply`, or with what it returns for the request.

        It may raise RefusedError to refuse one. A later call for the same key replaces the earlier one.
        """
        known = key in self._answers
        self._answers[key] = _Answer(kind, reply if callable(reply) else lambda _: reply)
        if self._bus is not None and not known:
            self._bus.serve(key, self._take)

    def _take(self, request: Request) -> None:
        if self.deaf > 0:
            self.deaf -= 1
            return
        answer = self._answers[request.key]
        message = decode(request.payload, answer.kind)
        self.requests.append(ReceivedRequest(self.bus.now(), request.key, message))
        if self.refusal is not None:
            request.refuse(ErrorReply(code=ErrorCode.NOT_ALLOWED, message=self.refusal))
            return
        try:
            reply = answer.reply(message)
        except RefusedError as error:
            request.refuse(error.reply)
        else:
            request.reply(encode(reply))

    # --- what came in ------------------------------------------------------------------------------------------------

    def asked(self, key: str, kind: type[M]) -> list[M]:
        """The requests on a key that were heard, the refused ones included, the oldest first."""
        return [each.message for each in self.requests if each.key == key and isinstance(each.message, kind)]

    @overload
    def heard(self, key: str) -> list[bytes]: ...
    @overload
    def heard(self, key: str, kind: type[M]) -> list[M]: ...
    def heard(self, key: str, kind: type[M] | None = None) -> list[M] | list[bytes]:
        """What was published on a key, the oldest first: as messages of `kind`, or as it came without one."""
        payloads = [each.sample.payload for each in self.publications if each.key == key]
        return payloads if kind is None else [decode(payload, kind) for payload in payloads]

    def _hear(self, sample: Sample) -> None:
        if sample.key not in self._publishers:
            self.publications.append(ReceivedMessage(self.bus.now(), sample.key, sample))
