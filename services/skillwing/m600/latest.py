"""The latest message of one of the functional layer's topics."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

from skillwing.services.bus import Bus, Handle
from skillwing.services.bus.reading import message_reader
from skillwing.services.protocol import Message

M = TypeVar("M", bound=Message)


class Latest(Generic[M]):
    """Subscriber to a topic: `value` is its latest message, None before the first; `on_message` is called with each.

    received_at: robot time of the arrival of `value` [s], None before the first. Invalid messages are logged and
    dropped, so that a bad sender looks like a silent one.

    at_rest: do not subscribe before `follow`. An unused stream costs a process as much as a used one. So the manager of
    a skill follows streams only while it has a goal.
    """

    def __init__(
        self,
        bus: Bus,
        key: str,
        kind: type[M],
        on_message: Callable[[M], None] | None = None,
        *,
        events: bool = False,
        at_rest: bool = False,
    ) -> None:
        self.value: M | None = None
        self.received_at: float | None = None
        self._bus, self._key, self._kind, self._events = bus, key, kind, events
        self._on_message = on_message
        self._subscription: Handle | None = None
        if not at_rest:
            self.follow()

    def follow(self) -> None:
        """Subscribe. Idempotent."""
        if self._subscription is None:
            read = message_reader(self._kind, self._receive)
            self._subscription = self._bus.subscribe(self._key, read, events=self._events, latest_only=not self._events)

    def rest(self) -> None:
        """Unsubscribe and clear `value`, so that it cannot pass for a new one later. Idempotent."""
        if self._subscription is not None:
            self._subscription.cancel()
        self._subscription = self.value = self.received_at = None

    def is_fresh(self, limit: float) -> bool:
        """Test for a latest message that came in less than `limit` seconds ago."""
        return self.received_at is not None and self._bus.now() - self.received_at < limit

    def _receive(self, message: M) -> None:
        self.value, self.received_at = message, self._bus.now()
        if self._on_message is not None:
            self._on_message(message)
