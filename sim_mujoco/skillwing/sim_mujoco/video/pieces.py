"""Access units cut into pieces that fit a packet, and put together again where none is missing."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from skillwing.sim_mujoco.topics import VideoPiece
from skillwing.sim_mujoco.video.codec import AccessUnit

LARGEST = 1200
"""Bytes of a piece: with its headers it fits an Ethernet frame on any route."""


def cut(unit: AccessUnit, stream: str, frame: int, sequence: int, t: float) -> Iterator[tuple[VideoPiece, bytes]]:
    """The pieces of picture number `frame`, taken at `t`; the first one gets this `sequence` number."""
    parts = max(1, -(-len(unit.data) // LARGEST))
    for part in range(parts):
        header = VideoPiece(
            t=t,
            stream=stream,
            sequence=sequence + part,
            frame=frame,
            part=part,
            parts=parts,
            keyframe=unit.keyframe,
        )
        yield header, unit.data[part * LARGEST : (part + 1) * LARGEST]


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
    _pieces: list[bytes] = field(default_factory=list)

    def add(self, piece: VideoPiece, data: bytes) -> Received | None:
        """The access unit that this piece completes, if it does."""
        if piece.part == 0:
            self._frame, self._pieces = piece.frame, []
        if piece.frame != self._frame or piece.part != len(self._pieces):
            self._frame = -1
            return None
        self._pieces.append(data)
        if len(self._pieces) < piece.parts:
            return None
        self._frame = -1
        return Received(piece.frame, piece.t, AccessUnit(b"".join(self._pieces), piece.keyframe))
