"""The latest message of one of the functional layer's topics."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

from skillwing.services.bus import Bus, Handle
from skillwing.services.bus.reading import message_reader
from skillwing.services.protocol import Message

M = TypeVar("M", bound=Message)


class Latest(Generic[M]):
    """Follows a topic: `value` is its latest message, None before the first; `on_message` is called with each.

    received_at: robot time in seconds at which `value` came in, None before the first. What is not a message of
    this kind is logged and dropped, so that a bad sender looks like a silent one.

    at_rest: hear nothing before `follow`. A stream that a process receives but does not use costs it about as much as
    one that it uses, so a skill's manager follows streams only while it has a goal.
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
        """Hear the topic from now on. Idempotent."""
        if self._subscription is None:
            read = message_reader(self._kind, self._receive)
            self._subscription = self._bus.subscribe(self._key, read, events=self._events, latest_only=not self._events)

    def rest(self) -> None:
        """Hear nothing any more, and forget what was heard: nobody is to take it for news later. Idempotent."""
        if self._subscription is not None:
            self._subscription.cancel()
        self._subscription = self.value = self.received_at = None

    def is_fresh(self, limit: float) -> bool:
        """Tell whether the latest message came in less than `limit` seconds ago."""
        return self.received_at is not None and self._bus.now() - self.received_at < limit

    def _receive(self, message: M) -> None:
        self.value, self.received_at = message, self._bus.now()
        if self._on_message is not None:
            self._on_message(message)
