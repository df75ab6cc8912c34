"""A functional layer for tests: a fake peer on the real bus."""

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
    """A received publication. t: robot time [s]."""

    t: float
    key: str
    sample: Sample


@dataclass(frozen=True, slots=True)
class _Answer:
    kind: type[Any]
    reply: Callable[[Any], Message]


class FakeLayer:
    """A layer that publishes, answers requests, and records what it receives.

    A test can use it directly, or derive a robot's own layer and declare its answers in `setup`. Two fields cause
    faults. `refusal`: a sentence that refuses every request while it is set. `deaf`: number of next requests that are
    not received.
    """

    name = "functional_layer"
    owns_clock = False
    listens: ClassVar[tuple[str, ...]] = ("fl/**",)
    """Key expressions of the publications that `heard` returns."""

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
        """Declare answers with `answer`, subscribe, and start timers. Called once, on the bus."""

    # --- the node ----------------------------------------------------------------------------------------------------

    @property
    def bus(self) -> Bus:
        """The bus. Raises RuntimeError before the layer is attached."""
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
        """Do nothing: the layer holds no resources."""

    # --- publishing --------------------------------------------------------------------------------------------------

    def publish(self, key: str, message: Message | bytes, *, events: bool = False) -> None:
        """Publish one message. events: as in `Bus.advertise`, set by the first publication on a key."""
        payload = message if isinstance(message, bytes) else encode(message)
        self._publisher(key, events=events).put(payload)

    def publish_array(self, key: str, header: Message, payload: bytes) -> None:
        """Publish one array of a stream: raw bytes and their description."""
        self._publisher(key, events=False).put(payload, encode(header))

    def _publisher(self, key: str, *, events: bool) -> Publisher:
        if key not in self._publishers:
            self._publishers[key] = self.bus.advertise(key, events=events)
        return self._publishers[key]

    # --- answering ---------------------------------------------------------------------------------------------------

    def answer(self, key: str, kind: type[M], reply: Message | Callable[[M], Message]) -> None:
        """Answer every request of `kind` on a key with `reply`, or with the result of calling it.

        It may raise RefusedError to refuse a request. A later call for the same key replaces the earlier one.
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
        """The received requests on a key, refused ones included, the oldest first."""
        return [each.message for each in self.requests if each.key == key and isinstance(each.message, kind)]

    @overload
    def heard(self, key: str) -> list[bytes]: ...
    @overload
    def heard(self, key: str, kind: type[M]) -> list[M]: ...
    def heard(self, key: str, kind: type[M] | None = None) -> list[M] | list[bytes]:
        """The received publications on a key, the oldest first: as messages of `kind`, or raw without one."""
        payloads = [each.sample.payload for each in self.publications if each.key == key]
        return payloads if kind is None else [decode(payload, kind) for payload in payloads]

    def _hear(self, sample: Sample) -> None:
        if sample.key not in self._publishers:
            self.publications.append(ReceivedMessage(self.bus.now(), sample.key, sample))
