"""Parity from which lost pieces are computed again: a systematic Reed-Solomon code, made from a Cauchy matrix.

Any `parts` of the `parts + parity` pieces of a picture are enough for all of it. Parity piece i is the sum over the
pieces j, each times 1 / (x_i + y_j), in the field of 256 elements, where all x and y differ: every square part of such
a matrix can be inverted (Bloemer et al., "An XOR-Based Erasure-Resilient Coding Scheme", 1995). Columns are scaled so
that the first row is all ones, and the first parity piece the exclusive or of all others, as in RFC 5109.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cache, lru_cache

import numpy as np
from numpy.typing import NDArray

ELEMENTS = 256
"""Pieces and parity of one picture together cannot be more."""
_POLYNOMIAL = 0x11D
"""x^8 + x^4 + x^3 + x^2 + 1, of which x is a primitive root."""
Bytes = NDArray[np.uint8]
LOSSY = 0.005
"""Above this share of lost packets pictures are protected."""
RISK = 0.02
"""How often a picture may be lost all the same. One that is takes those after it with it, until a keyframe comes."""
MOST_PARITY = 8
HIGHEST_LOSS = 0.5
"""Against more than this nothing is planned."""


def _powers() -> Bytes:
    """x to the power of 0 to 254."""
    powers = [1]
    while len(powers) < ELEMENTS - 1:
        double = 2 * powers[-1]
        powers.append(double ^ _POLYNOMIAL if double >= ELEMENTS else double)
    return np.array(powers, dtype=np.uint8)


_POWERS = _powers()
_LOGARITHMS = np.argsort(_POWERS)
"""Of 1 to 255: the exponent of element e stands at e - 1."""
_PRODUCTS = np.zeros((ELEMENTS, ELEMENTS), dtype=np.uint8)
_PRODUCTS[1:, 1:] = _POWERS[np.add.outer(_LOGARITHMS, _LOGARITHMS) % (ELEMENTS - 1)]


def _inverse(element: int) -> int:
    return int(_POWERS[-_LOGARITHMS[element - 1] % (ELEMENTS - 1)])


@cache
def _factor(row: int, part: int) -> int:
    """How often piece `part` counts in parity piece `row`."""
    top = ELEMENTS - 1
    return int(_PRODUCTS[_inverse((top - row) ^ part), top ^ part])


def parity(pieces: Sequence[bytes], count: int, length: int) -> list[bytes]:
    """So many parity pieces of `length` bytes, of pieces that are at most as long; shorter ones end in zeros.

    Raises ValueError if there are more pieces than the field has elements.
    """
    if count and len(pieces) + count > ELEMENTS:
        raise ValueError(f"{len(pieces)} pieces cannot have {count} of parity; both together can be {ELEMENTS}")
    rows = {part: _filled(piece, length) for part, piece in enumerate(pieces)}
    return [_sum(row, rows, length).tobytes() for row in range(count)]


def restore(received: Mapping[int, bytes], parts: int, length: int) -> list[bytes]:
    """All `parts` pieces, each filled up to `length`, from any `parts` of those numbered 0 to `parts` + parity - 1.

    Raises ValueError if there are not enough of them.
    """
    known = {part: _filled(piece, length) for part, piece in received.items() if part < parts}
    missing = [part for part in range(parts) if part not in known]
    rows = sorted(number - parts for number in received if number >= parts)[: len(missing)]
    if len(rows) < len(missing):
        raise ValueError(f"{len(missing)} pieces are missing, and {len(rows)} of parity are there")
    # What the missing pieces add up to in each row, solved for them by elimination; no pivot of such a matrix is 0.
    left = [_filled(received[parts + row], length) ^ _sum(row, known, length) for row in rows]
    matrix = np.array([[_factor(row, part) for part in missing] for row in rows], dtype=np.uint8)
    for k in range(len(missing)):
        scale = _inverse(int(matrix[k, k]))
        matrix[k], left[k] = _PRODUCTS[scale, matrix[k]], _PRODUCTS[scale, left[k]]
        for other in range(len(missing)):
            if other != k:
                share = int(matrix[other, k])
                matrix[other] ^= _PRODUCTS[share, matrix[k]]
                left[other] ^= _PRODUCTS[share, left[k]]
    known.update(zip(missing, left, strict=True))
    return [known[part].tobytes() for part in range(parts)]


def risk(parts: int, parity: int, loss: float) -> float:
    """How probable it is that more than `parity` of all pieces are lost, if each is lost with probability `loss`."""
    pieces = parts + parity
    arrives = (math.comb(pieces, k) * loss**k * (1.0 - loss) ** (pieces - k) for k in range(parity + 1))
    return max(0.0, 1.0 - sum(arrives))


@lru_cache(maxsize=256)
def parity_against(loss: float, parts: int) -> int:
    """The fewest parity pieces with which so many are safe enough, or as many as are worth their while."""
    if loss <= LOSSY:
        return 0
    loss = min(loss, HIGHEST_LOSS)
    return next((count for count in range(1, MOST_PARITY) if risk(parts, count, loss) <= RISK), MOST_PARITY)


def _filled(piece: bytes, length: int) -> Bytes:
    return np.frombuffer(piece.ljust(length, b"\0")[:length], np.uint8)


def _sum(row: int, pieces: Mapping[int, Bytes], length: int) -> Bytes:
    """What these pieces contribute to a parity piece."""
    total = np.zeros(length, dtype=np.uint8)
    for part, piece in pieces.items():
        total ^= _PRODUCTS[_factor(row, part), piece]
    return total
