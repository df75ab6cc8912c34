"""Turns placed scans into a map, and notices when they no longer agree with it."""

from __future__ import annotations

from skillwing.onboard.mapping.occupancy import OccupancyGrid
from skillwing.onboard.sensor_data.scans import PlacedPoints

REACH = 30.0
"""Returns from farther away are not mapped: the beams are a metre apart there [m]."""
MISFIT = 0.3
"""A scan of which more than this share hits what is known to be free is not believed. Sound ones reach 0.2 in the
first metres of a climb, where rays had grazed the ground, and 0.02 in flight."""
_PATIENCE = 10


class Mapper:
    """A map that grows while it runs, and is kept when it stops.

    Scans that do not fit are left out. The map has diverged when ten in a row did not fit: then the poses are wrong,
    or the ranges, and nothing more is taken in until it is renewed.
    """

    def __init__(self, grid: OccupancyGrid) -> None:
        self.grid = grid
        self.running = False
        self.diverged = False
        self.scans = 0
        self._misfits = 0

    def start(self) -> None:
        """Map on."""
        self.running = True

    def renew(self) -> None:
        """Begin with an empty map: poses that begin anew need not agree with what was mapped before."""
        self.grid.clear()
        self.diverged, self._misfits, self.scans = False, 0, 0

    def stop(self) -> None:
        self.running = False

    def add(self, scan: PlacedPoints) -> None:
        """Take in a scan, if the map is running and sound and the scan fits."""
        if not self.running or self.diverged:
            return
        hits = self.grid.hit_by(scan.points)
        if self.grid.fit(hits).misfit > MISFIT:
            self._misfits += 1
            self.diverged = self._misfits >= _PATIENCE
            return
        self._misfits = 0
        self.grid.integrate(scan.origin, hits)
        self.scans += 1
