"""A drone in the air that nobody commands: it waits for a while, then it has to come down."""

from __future__ import annotations

LAND_AFTER = 30.0
"""Robot time that a drone holds its position for the next commander, be that somebody at a command line [s]."""


class Solitude:
    """Tells when nobody has commanded for too long."""

    def __init__(self) -> None:
        self._since: float | None = None

    def update(self, t: float, *, commanded: bool) -> bool:
        """Whether at `t` nobody has commanded for so long that the drone has to land."""
        if commanded:
            self._since = None
            return False
        if self._since is None:
            self._since = t
        return t - self._since >= LAND_AFTER
