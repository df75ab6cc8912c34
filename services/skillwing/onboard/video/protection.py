"""How much parity a picture needs to get through an air that swallows packets, each by itself."""

from __future__ import annotations

import math
from functools import lru_cache

LOSSY = 0.005
"""Above this share of lost packets pictures are protected."""
RISK = 0.02
"""How often a picture may be lost all the same. One that is takes those after it with it, until a keyframe comes."""
MOST_PARITY = 8
HIGHEST_LOSS = 0.5
"""Against more than this nothing is planned."""


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
