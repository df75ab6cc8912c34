"""The latest message of one of the functional layer's topics."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

from skillwing.services.bus import Bus
from skillwing.services.bus.reading import message_reader
from skillwing.services.protocol import Message

M = TypeVar("M", bound=Message)


class Latest(Generic[M]):
    """Follows a topic: `value` is its latest message, None before the first; `on_message` is called with each.

    received_at: robot time in seconds at which `value` came in, None before the first. What is not a message of
    this kind is logged and dropped, so that a bad sender looks like a silent one.
    """

    def __init__(
        self,
        bus: Bus,
        key: str,
        kind: type[M],
        on_message: Callable[[M], None] | None = None,
        *,
        events: bool = False,
    ) -> None:
        self.value: M | None = None
        self.received_at: float | None = None
        self._bus, self._on_message = bus, on_message
        bus.subscribe(key, message_reader(kind, self._receive), events=events, latest_only=not events)

    def is_fresh(self, limit: float) -> bool:
        """Tell whether the latest message came in less than `limit` seconds ago."""
        return self.received_at is not None and self._bus.now() - self.received_at < limit

    def _receive(self, message: M) -> None:
        self.value, self.received_at = message, self._bus.now()
        if self._on_message is not None:
            self._on_message(message)
