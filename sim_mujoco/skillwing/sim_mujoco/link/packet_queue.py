"""One direction of the radio: a queue that is served at the radio's rate, and the channel behind it."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from skillwing.sim_mujoco.link.radio import Conditions

CAPACITY = 48_000
"""Capacity of the modem's queue [bytes]; further packets are dropped."""
BURST = 3_000
"""Data that an idle modem may send at once, above its rate [bytes]."""
LONGEST_WAIT = 2.0
"""Waiting time after which a packet is dropped, so that a recovered link starts with new data [s]."""
HEADER = 60
"""Overhead of every packet: IP, UDP and RTP headers with an extension [bytes]."""


@dataclass(frozen=True, slots=True)
class Packet:
    """A packet. Its attachment stands for a real packet's header."""

    payload: bytes
    attachment: bytes

    @property
    def size(self) -> int:
        """Bytes on the channel."""
        return len(self.payload) + HEADER


class PacketQueue:
    """A token bucket in front of a lossy delay. Pure; packets stay in their order.

    Times must not run backwards. The loss is drawn from `rng`, once for each packet that is sent.
    """

    def __init__(self, rng: np.random.Generator, capacity: int = CAPACITY) -> None:
        self._rng, self._capacity = rng, capacity
        self._queue: deque[tuple[float, Packet]] = deque()
        self._held = 0
        self._tokens = float(BURST)
        self._served_until: float | None = None
        self._flying: deque[tuple[float, Packet]] = deque()
        self.sent = self.dropped = self.lost = 0
        """Bytes sent, packets for which the queue had no room, and packets that the channel lost."""

    @property
    def idle(self) -> bool:
        """No packet waits or is under way."""
        return not self._queue and not self._flying

    @property
    def held(self) -> int:
        """Bytes that wait to be sent."""
        return self._held

    def put(self, t: float, packet: Packet) -> None:
        """Add a packet; if the queue is full it is dropped."""
        if self._held + packet.size > self._capacity:
            self.dropped += 1
            return
        self._queue.append((t, packet))
        self._held += packet.size

    def serve(self, t: float, conditions: Conditions) -> list[Packet]:
        """Advance to `t` under these conditions, and return the packets that have arrived by then."""
        elapsed = 0.0 if self._served_until is None else t - self._served_until
        self._served_until = t
        self._tokens += elapsed * conditions.bandwidth / 8.0
        while self._queue and self._queue[0][0] < t - LONGEST_WAIT:
            self._held -= self._queue.popleft()[1].size
            self.dropped += 1
        while self._queue and self._queue[0][1].size <= self._tokens:
            self._send(t, self._queue.popleft()[1], conditions)
        if not self._queue:
            self._tokens = min(self._tokens, float(BURST))
        arrived: list[Packet] = []
        while self._flying and self._flying[0][0] <= t + 1e-9:
            arrived.append(self._flying.popleft()[1])
        return arrived

    def _send(self, t: float, packet: Packet, conditions: Conditions) -> None:
        self._tokens -= packet.size
        self._held -= packet.size
        self.sent += packet.size
        if self._rng.random() < conditions.loss:
            self.lost += 1
            return
        last = self._flying[-1][0] if self._flying else 0.0
        self._flying.append((max(last, t + conditions.latency), packet))
