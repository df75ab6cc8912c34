"""Access units cut into pieces that fit a packet, and put together again where no more than one is missing.

On a link that loses packets a parity piece goes with each picture: the exclusive or of all its pieces, as in RFC 5109.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import reduce
from operator import xor

from skillwing.sim_mujoco.topics import VideoPiece
from skillwing.sim_mujoco.video.codec import AccessUnit

LARGEST = 1200
"""Bytes of a piece: with its headers it fits an Ethernet frame on any route."""


def cut(
    unit: AccessUnit, stream: str, frame: int, sequence: int, t: float, *, parity: bool = False
) -> Iterator[tuple[VideoPiece, bytes]]:
    """The pieces of picture number `frame`, taken at `t`, and their parity if that is wanted; the first one gets this
    `sequence` number."""
    size = len(unit.data)
    parts = max(1, -(-size // LARGEST))
    pieces = [unit.data[part * LARGEST : (part + 1) * LARGEST] for part in range(parts)]
    if parity:
        pieces.append(_parity(pieces, min(size, LARGEST)))
    for part, data in enumerate(pieces):
        header = VideoPiece(
            t=t,
            stream=stream,
            sequence=sequence + part,
            frame=frame,
            part=part,
            parts=parts,
            size=size,
            keyframe=unit.keyframe,
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
    _pieces: dict[int, bytes] = field(default_factory=dict)
    _complete: bool = False

    def add(self, piece: VideoPiece, data: bytes) -> Received | None:
        """The access unit that this piece completes, if it does."""
        if piece.frame != self._frame:
            self._frame, self._pieces, self._complete = piece.frame, {}, False
        if self._complete or piece.part > piece.parts or len(data) > LARGEST:
            return None
        self._pieces[piece.part] = data
        if len(self._pieces) < piece.parts:
            return None
        self._complete = True
        whole = b"".join(self._part(part, piece) for part in range(piece.parts))
        return Received(piece.frame, piece.t, AccessUnit(whole, piece.keyframe))

    def _part(self, part: int, piece: VideoPiece) -> bytes:
        """What arrived, or what the parity says about the one that did not."""
        if part in self._pieces:
            return self._pieces[part]
        return _parity(self._pieces.values(), max(0, min(LARGEST, piece.size - part * LARGEST)))


def _parity(pieces: Iterable[bytes], size: int) -> bytes:
    """The exclusive or of pieces that are filled up with zeros; its first `size` bytes."""
    numbers = (int.from_bytes(piece.ljust(LARGEST, b"\0"), "big") for piece in pieces)
    return reduce(xor, numbers, 0).to_bytes(LARGEST, "big")[:size]
