"""Access units cut into pieces that fit a packet, and put together again where no more are missing than there is
parity."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from skillwing.onboard.topics.video import VideoPacket
from skillwing.onboard.video import erasure
from skillwing.onboard.video.codec import AccessUnit

LARGEST = 1200
"""Bytes of a piece: with its headers it fits an Ethernet frame on any route."""


def parts_of(size: int) -> int:
    """Into how many pieces so many bytes are cut."""
    return max(1, -(-size // LARGEST))


def _length(size: int, parts: int) -> int:
    """Of all pieces but the last, which may be shorter. They are of one length, so that parity costs least."""
    return -(-size // parts)


def cut(
    unit: AccessUnit, stream: str, frame: int, sequence: int, t: float, *, parity: int = 0
) -> Iterator[tuple[VideoPacket, bytes]]:
    """The pieces of picture number `frame`, taken at `t`, and so many of parity, or as many as the code allows; the
    first one gets this `sequence` number."""
    size = len(unit.data)
    parts = parts_of(size)
    length = _length(size, parts)
    pieces = [unit.data[part * length : (part + 1) * length] for part in range(parts)]
    parity = max(0, min(parity, erasure.ELEMENTS - parts))
    for part, data in enumerate((*pieces, *erasure.parity(pieces, parity, length))):
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
    """Puts the pieces of one stream together. The link keeps their order, so a piece of a later picture means that what
    is missing of an earlier one is lost. Pure."""

    _frame: int = -1
    _shape: tuple[int, int, int] = 0, 0, 0
    _pieces: dict[int, bytes] = field(default_factory=dict)
    _complete: bool = False

    def add(self, piece: VideoPacket, data: bytes) -> Received | None:
        """The access unit that this piece completes, if it does."""
        shape = piece.parts, piece.parity, piece.size
        if piece.frame != self._frame:
            self._frame, self._shape, self._pieces, self._complete = piece.frame, shape, {}, False
        if self._complete or shape != self._shape or not _possible(piece, data):
            return None
        self._pieces[piece.part] = data
        if len(self._pieces) < piece.parts:
            return None
        self._complete = True
        parts = erasure.restore(self._pieces, piece.parts, _length(piece.size, piece.parts))
        return Received(piece.frame, piece.t, AccessUnit(b"".join(parts)[: piece.size], piece.keyframe))


def _possible(piece: VideoPacket, data: bytes) -> bool:
    """Whether `cut` may have made this piece, as far as can be seen from it alone."""
    last = piece.parts + piece.parity
    return (
        piece.part < last
        and (not piece.parity or last <= erasure.ELEMENTS)
        and piece.parts == parts_of(piece.size)
        and len(data) <= LARGEST
    )
