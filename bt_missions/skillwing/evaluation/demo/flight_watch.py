"""End of a demo flight: the mission ends, or a process that it needs is gone."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType

from skillwing.evaluation.demo.flight_deck import FlightDeck
from skillwing.services.bus import RunnableBus
from skillwing.services.processes.child import ProcessExit
from skillwing.services.processes.launcher import ROUTER
from skillwing.services.processes.stop_signal import StopSignal
from skillwing.services.protocol import Keys

STALL = 30.0
"""Wall seconds without robot time after which the flight is ended."""
SILENCE = 5.0
"""Wall seconds that a running process may be unreachable; a busy machine needs some to restore a link."""
RETURN = 30.0
"""The same for a process that died and is restarted."""
PERIOD = 0.2
"""Wall seconds between two checks."""


class FlightWatch:
    """Monitor of the mission and of the processes that it needs.

    exits: grows on other threads while processes end. essential: names of the processes that a flight needs. stop:
    ends the flight with KeyboardInterrupt. wall: clock of the timeouts. hosts: names of the hosting processes, by node
    that shares a process.
    """

    def __init__(
        self,
        bus: RunnableBus,
        keys: Keys,
        deck: FlightDeck,
        exits: Sequence[ProcessExit],
        essential: frozenset[str],
        stop: StopSignal | None = None,
        wall: Callable[[], float] = time.monotonic,
        hosts: Mapping[str, str] = MappingProxyType({}),
    ) -> None:
        self._bus = bus
        self._deck = deck
        self._exits = exits
        self._essential = essential
        self._stop = stop or StopSignal()
        self._hosts = hosts
        self._prefix = keys.alive("")
        self._present: set[str] = set()
        self._silent: dict[str, float] = {}
        self._reported: set[str] = set()
        self._exits_reported = 0
        self._last_t = -1.0
        self._wall = wall
        self._last_tick = wall()
        bus.watch_alive(keys.alive("**"), self._on_alive)

    def follow(self) -> str:
        """Wait for the end. Returns the reason if the flight was cut short, empty if the mission ended it."""
        while not (self._deck.mission is not None and self._deck.mission.phase.over):
            reason = self._dead() or self._cut_off() or self._stalled()
            if reason:
                self._deck.print_line(f"{reason} The flight ends here.", "red")
                return reason
            self._bus.run_until(lambda: False, PERIOD)
            self._stop.check()
        return ""

    def _on_alive(self, key: str, alive: bool) -> None:
        name = key.removeprefix(self._prefix)
        if alive:
            self._present.add(name)
            self._reported.discard(self._process(name))
            self._silent.pop(name, None)
        else:
            self._present.discard(name)
            self._silent[name] = self._wall()

    def _dead(self) -> str:
        """Reason to end the flight if an essential process stays down. Other exits are only shown."""
        for exit_ in self._exits[self._exits_reported :]:
            self._exits_reported += 1
            if exit_.final and exit_.process in self._essential:
                return f"{exit_} {exit_.outlook}".strip()
            self._report(f"{exit_} {exit_.outlook}".strip())
        return ""

    def _cut_off(self) -> str:
        """Reason to end the flight if an essential process is silent: stopped, hung, or not back from its restart."""
        down = {exit_.process for exit_ in self._exits if exit_.final}
        returning = {exit_.process for exit_ in self._exits if not exit_.final}
        now = self._wall()
        for node, since in self._silent.items():
            name = self._process(node)
            if name in down or now - since < (RETURN if name in returning or ROUTER in returning else SILENCE):
                continue
            if not self._present:
                return f"Nobody answers any more; {ROUTER} must have stopped."
            if name in self._essential:
                return f"{name} does not answer any more."
            if name not in self._reported:
                self._reported.add(name)
                self._report(f"{name} does not answer any more.")
        return ""

    def _process(self, node: str) -> str:
        return self._hosts.get(node, node)

    def _stalled(self) -> str:
        now = self._bus.now()
        if now > self._last_t:
            self._last_t, self._last_tick = now, self._wall()
        stands_still = self._wall() - self._last_tick > STALL
        return f"Robot time has stood still for {STALL:g} s." if stands_still else ""

    def _report(self, text: str) -> None:
        self._deck.print_line(f"{text} The mission goes on as it can.", "red")
