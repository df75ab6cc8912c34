"""Packets of access units: cut on board, and assembled on the ground if parity covers the lost ones."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from skillwing.onboard.topics.video import VideoPacket
from skillwing.onboard.video import erasure
from skillwing.onboard.video.codec import AccessUnit

LARGEST = 1200
"""Most bytes of a packet's payload: with its headers it fits an Ethernet frame on any route."""


def parts_of(size: int) -> int:
    """Number of packets for so many bytes."""
    return max(1, -(-size // LARGEST))


def _length(size: int, parts: int) -> int:
    """Length of all packets but the last, which may be shorter. With one length parity costs least."""
    return -(-size // parts)


def cut(
    unit: AccessUnit, stream: str, frame: int, sequence: int, t: float, *, parity: int = 0
) -> Iterator[tuple[VideoPacket, bytes]]:
    """The packets of picture number `frame`, taken at `t`, and so many of parity, or as many as the code allows.

    The first one gets this `sequence` number.
    """
    size = len(unit.data)
    parts = parts_of(size)
    length = _length(size, parts)
    packets = [unit.data[part * length : (part + 1) * length] for part in range(parts)]
    parity = max(0, min(parity, erasure.ELEMENTS - parts))
    for part, data in enumerate((*packets, *erasure.parity(packets, parity, length))):
        header = VideoPacket(
            t=t,
            stream=stream,
            sequence=sequence + part,
            frame=frame,
            part=part,
            parts=parts,
            size=size,
            keyframe=unit.keyframe,
            parity=parity,
        )
        yield header, data


@dataclass(frozen=True, slots=True)
class Received:
    """A whole access unit: number and time of its picture."""

    frame: int
    t: float
    unit: AccessUnit


@dataclass(slots=True)
class Assembly:
    """Assembly of the packets of one stream. The link keeps their order, so a packet of a later picture means that the
    missing ones of an earlier picture are lost. Pure."""

    _frame: int = -1
    _shape: tuple[int, int, int] = 0, 0, 0
    _packets: dict[int, bytes] = field(default_factory=dict)
    _complete: bool = False

    def add(self, packet: VideoPacket, data: bytes) -> Received | None:
        """The access unit that this packet completes, if it does."""
        shape = packet.parts, packet.parity, packet.size
        if packet.frame != self._frame:
            self._frame, self._shape, self._packets, self._complete = packet.frame, shape, {}, False
        if self._complete or shape != self._shape or not _possible(packet, data):
            return None
        self._packets[packet.part] = data
        if len(self._packets) < packet.parts:
            return None
        self._complete = True
        parts = erasure.restore(self._packets, packet.parts, _length(packet.size, packet.parts))
        return Received(packet.frame, packet.t, AccessUnit(b"".join(parts)[: packet.size], packet.keyframe))


def _possible(packet: VideoPacket, data: bytes) -> bool:
    """Test for a packet that `cut` may have made, by its header and length."""
    last = packet.parts + packet.parity
    return (
        packet.part < last
        and (not packet.parity or last <= erasure.ELEMENTS)
        and packet.parts == parts_of(packet.size)
        and len(data) <= LARGEST
    )
