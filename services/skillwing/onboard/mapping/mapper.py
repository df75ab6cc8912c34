"""Mapper: puts placed scans into a map, and detects when they no longer fit it."""

from __future__ import annotations

from skillwing.onboard.mapping.occupancy import OccupancyGrid
from skillwing.onboard.sensor_data.scans import PlacedPoints

REACH = 30.0
"""Largest range of mapped returns: farther away the beams are a metre apart [m]."""
LARGEST_MISMATCH = 0.3
"""Largest share of a scan that may hit known free space. Sound scans reach 0.2 in the first metres of a climb, where
rays have grazed the ground, and 0.02 in flight."""
_PATIENCE = 10


class Mapper:
    """A map that grows while mapping runs, and is kept when it stops.

    Scans that do not fit are left out. After ten in a row the map has diverged, because the poses or the ranges are
    wrong. It then takes no scans until it is renewed.
    """

    def __init__(self, grid: OccupancyGrid) -> None:
        self.grid = grid
        self.running = False
        self.diverged = False
        self.scans = 0
        self._mismatches = 0

    def start(self) -> None:
        """Start mapping, or go on."""
        self.running = True

    def renew(self) -> None:
        """Clear the map: poses after a new initialisation need not agree with the old map."""
        self.grid.clear()
        self.diverged, self._mismatches, self.scans = False, 0, 0

    def stop(self) -> None:
        self.running = False

    def add(self, scan: PlacedPoints) -> None:
        """Integrate a scan, if mapping runs, the map is sound and the scan fits."""
        if not self.running or self.diverged:
            return
        hits = self.grid.hit_by(scan.points)
        if self.grid.fit(hits).mismatch > LARGEST_MISMATCH:
            self._mismatches += 1
            self.diverged = self._mismatches >= _PATIENCE
            return
        self._mismatches = 0
        self.grid.integrate(scan.origin, hits)
        self.scans += 1
