"""Erasure code that restores lost packets: a systematic Reed-Solomon code, made from a Cauchy matrix.

Any `parts` of the `parts + parity` packets of a picture are enough for all of it. Parity packet i is the sum over the
packets j, each times 1 / (x_i + y_j), in the field of 256 elements. All x and y differ, so every square part of such a
matrix has an inverse (Bloemer et al., "An XOR-Based Erasure-Resilient Coding Scheme", 1995). Columns are scaled to
ones in the first row: the first parity packet is the exclusive or of all others, as in RFC 5109.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cache, lru_cache

import numpy as np
from numpy.typing import NDArray

ELEMENTS = 256
"""Most packets of one picture, parity included."""
_POLYNOMIAL = 0x11D
"""x^8 + x^4 + x^3 + x^2 + 1, of which x is a primitive root."""
Bytes = NDArray[np.uint8]
LOSSY = 0.005
"""Share of lost packets above which pictures get parity."""
RISK = 0.02
"""Share of pictures that may be lost despite parity. A lost one spoils those after it, up to the next keyframe."""
MOST_PARITY = 8
HIGHEST_LOSS = 0.5
"""Largest loss that parity is planned for."""


def _powers() -> Bytes:
    """x to the power of 0 to 254."""
    powers = [1]
    while len(powers) < ELEMENTS - 1:
        double = 2 * powers[-1]
        powers.append(double ^ _POLYNOMIAL if double >= ELEMENTS else double)
    return np.array(powers, dtype=np.uint8)


_POWERS = _powers()
_LOGARITHMS = np.argsort(_POWERS)
"""Logarithms of 1 to 255: the exponent of element e is at e - 1."""
_PRODUCTS = np.zeros((ELEMENTS, ELEMENTS), dtype=np.uint8)
_PRODUCTS[1:, 1:] = _POWERS[np.add.outer(_LOGARITHMS, _LOGARITHMS) % (ELEMENTS - 1)]


def _inverse(element: int) -> int:
    return int(_POWERS[-_LOGARITHMS[element - 1] % (ELEMENTS - 1)])


@cache
def _factor(row: int, part: int) -> int:
    """Factor of packet `part` in parity packet `row`."""
    top = ELEMENTS - 1
    return int(_PRODUCTS[_inverse((top - row) ^ part), top ^ part])


def parity(packets: Sequence[bytes], count: int, length: int) -> list[bytes]:
    """`count` parity packets of `length` bytes for packets of at most that length; zeros fill up shorter ones.

    Raises ValueError if there are more packets than the field has elements.
    """
    if count and len(packets) + count > ELEMENTS:
        raise ValueError(f"{len(packets)} packets cannot have {count} of parity; both together can be {ELEMENTS}")
    rows = {part: _filled(packet, length) for part, packet in enumerate(packets)}
    return [_sum(row, rows, length).tobytes() for row in range(count)]


def restore(received: Mapping[int, bytes], parts: int, length: int) -> list[bytes]:
    """All `parts` packets, each filled up to `length`, from any `parts` of those numbered 0 to `parts` + parity - 1.

    Raises ValueError if there are not enough of them.
    """
    known = {part: _filled(packet, length) for part, packet in received.items() if part < parts}
    missing = [part for part in range(parts) if part not in known]
    rows = sorted(number - parts for number in received if number >= parts)[: len(missing)]
    if len(rows) < len(missing):
        raise ValueError(f"{len(missing)} packets are missing, and {len(rows)} of parity are there")
    # The sums of the missing packets in each row, solved by elimination; no pivot of such a matrix is 0.
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
    """Probability to lose more than `parity` of all packets, if each is lost with probability `loss`."""
    packets = parts + parity
    arrives = (math.comb(packets, k) * loss**k * (1.0 - loss) ** (packets - k) for k in range(parity + 1))
    return max(0.0, 1.0 - sum(arrives))


@lru_cache(maxsize=256)
def parity_against(loss: float, parts: int) -> int:
    """The fewest parity packets that protect `parts` packets well enough, up to a limit."""
    if loss <= LOSSY:
        return 0
    loss = min(loss, HIGHEST_LOSS)
    return next((count for count in range(1, MOST_PARITY) if risk(parts, count, loss) <= RISK), MOST_PARITY)


def _filled(packet: bytes, length: int) -> Bytes:
    return np.frombuffer(packet.ljust(length, b"\0")[:length], np.uint8)


def _sum(row: int, packets: Mapping[int, Bytes], length: int) -> Bytes:
    """Sum of these packets in a parity packet."""
    total = np.zeros(length, dtype=np.uint8)
    for part, packet in packets.items():
        total ^= _PRODUCTS[_factor(row, part), packet]
    return total
