"""A network that notes who offers what and who uses it."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable
from typing import Any, cast

from skillwing.services.bus import Handle, Publisher, Request, RunnableBus, Sample
from skillwing.services.bus.inprocess import InProcessNetwork, SentMessage


class ObservedNetwork(InProcessNetwork):
    """Keys of the functional layer, by who advertised, served, subscribed to or asked them since the beginning.

    offers: with whether it was as events. puts: how many publications there were.
    """

    def __init__(self) -> None:
        super().__init__()
        self.offers: defaultdict[str, set[tuple[str, bool]]] = defaultdict(set)
        self.serves: defaultdict[str, set[str]] = defaultdict(set)
        self.uses: defaultdict[str, set[str]] = defaultdict(set)
        self.asks: defaultdict[str, set[str]] = defaultdict(set)
        self.puts: Counter[str] = Counter()
        self.tap = self._hear

    def bus(self, name: str, robot: str = "r1") -> RunnableBus:
        return cast(RunnableBus, _Observed(super().bus(name, robot), self))

    def rates(self, seconds: float) -> dict[str, float]:
        """Let time pass, and tell how often each key was published [Hz]."""
        before = Counter(self.puts)
        self.run_for(seconds)
        return {key: (count - before[key]) / seconds for key, count in self.puts.items()}

    def _hear(self, said: SentMessage) -> None:
        if said.what == "put":
            self.puts[said.key] += 1
        elif said.what == "ask":
            self.asks[said.key].add(said.source.name)


class _Observed:
    def __init__(self, bus: RunnableBus, ledger: ObservedNetwork) -> None:
        self._bus, self._ledger = bus, ledger

    def __getattr__(self, name: str) -> Any:
        return getattr(self._bus, name)

    def advertise(self, key: str, *, events: bool = False) -> Publisher:
        self._ledger.offers[key].add((self._bus.name, events))
        return self._bus.advertise(key, events=events)

    def serve(self, key: str, on_request: Callable[[Request], None]) -> Handle:
        self._ledger.serves[key].add(self._bus.name)
        return self._bus.serve(key, on_request)

    def subscribe(self, key: str, on_sample: Callable[[Sample], None], **how: bool) -> Handle:
        self._ledger.uses[key].add(self._bus.name)
        return self._bus.subscribe(key, on_sample, **how)
