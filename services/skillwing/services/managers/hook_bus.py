"""The bus of a skill's developer: an exception in a callback ends the goal, not the process."""

from __future__ import annotations

from collections.abc import Callable
from typing import ParamSpec

from skillwing.services.bus import Answer, Bus, Handle, Request, Sample
from skillwing.services.bus.identity import SessionIdentity

P = ParamSpec("P")
Guard = Callable[[str, Callable[[], None]], None]
"""Function that runs a callback, gets its name, and handles its exceptions."""


class HookBus:
    """A `Bus` that runs every callback under a guard. Its other members are those of the bus."""

    def __init__(self, bus: Bus, guard: Guard) -> None:
        self._bus = bus
        self._guard = guard
        self.name = bus.name
        self.follows_time = bus.follows_time
        self.now, self.wall, self.new_id = bus.now, bus.wall, bus.new_id
        self.advertise, self.declare_alive, self.close = bus.advertise, bus.declare_alive, bus.close

    @property
    def identity(self) -> SessionIdentity | None:
        return self._bus.identity

    @property
    def connected(self) -> bool:
        return self._bus.connected

    @property
    def routed(self) -> bool:
        return self._bus.routed

    def subscribe(
        self,
        key_expression: str,
        on_sample: Callable[[Sample], None],
        *,
        events: bool = False,
        latest_only: bool = False,
    ) -> Handle:
        guarded = self._guarded(on_sample)
        return self._bus.subscribe(key_expression, guarded, events=events, latest_only=latest_only)

    def serve(self, key_expression: str, on_request: Callable[[Request], None]) -> Handle:
        return self._bus.serve(key_expression, self._guarded(on_request))

    def ask(
        self,
        key: str,
        payload: bytes,
        on_answer: Callable[[Answer], None],
        *,
        timeout: float = 2.0,
        attachment: bytes = b"",
    ) -> None:
        self._bus.ask(key, payload, self._guarded(on_answer), timeout=timeout, attachment=attachment)

    def watch_alive(self, key_expression: str, on_change: Callable[[str, bool], None]) -> Handle:
        return self._bus.watch_alive(key_expression, self._guarded(on_change))

    def after(self, delay: float, action: Callable[[], None], *, wall: bool = False) -> Handle:
        return self._bus.after(delay, self._guarded(action), wall=wall)

    def every(self, period: float, action: Callable[[], None]) -> Handle:
        return self._bus.every(period, self._guarded(action))

    def post(self, action: Callable[[], None]) -> None:
        self._bus.post(self._guarded(action))

    def _guarded(self, callback: Callable[P, None]) -> Callable[P, None]:
        name = getattr(callback, "__name__", "callback")

        def run(*args: P.args, **kwargs: P.kwargs) -> None:
            self._guard(name, lambda: callback(*args, **kwargs))

        return run
