"""Alternatives for `ray_choices.py`: Embree's robust mode, and other rules for computed pixels."""

from __future__ import annotations

import time
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray

from skillwing.sim_mujoco.sensors import depth_camera
from skillwing.sim_mujoco.sensors.depth_camera import Cast, DepthCamera, Image, Infill
from skillwing.sim_mujoco.world.rays import Floats, RayScene
from skillwing.sim_mujoco.world.triangles import Triangles


class RobustRays(RayScene):
    """The same triangles in Embree's robust mode."""

    def __init__(self, triangles: Triangles) -> None:
        super().__init__(triangles, robust=True)


class WatchedRays(RayScene):
    """Knows how many rays were `cast`, and how many seconds of processor time they took."""

    cast, seconds = 0, 0.0

    def distances(self, origins: Floats, directions: Floats, reach: float, nothing: float = 0.0) -> Floats:
        started = time.process_time()
        found = super().distances(origins, directions, reach, nothing)
        self.seconds += time.process_time() - started
        self.cast += len(found)
        return found


class EveryPixel(Infill):
    """Casts all pixels and computes none."""

    def __init__(self, height: int, width: int) -> None:
        super().__init__(height, width)
        self.first = self._numbers.ravel()

    def inverse_depths(self, first: Image, cast: Cast) -> Image:
        del cast
        return first.reshape(self._numbers.shape)


class EitherSide(Infill):
    """Casts a pixel also where the line is broken on one side of it only."""

    def inverse_depths(self, first: Image, cast: Cast) -> Image:
        with patch.object(depth_camera, "_between", _broken_on_either_side):
            return super().inverse_depths(first, cast)


class EverySecondRow(Infill):
    """Casts every second row in any case, instead of every fourth."""

    def inverse_depths(self, first: Image, cast: Cast) -> Image:
        rows_first = iter([True])

        def between(known: Image) -> tuple[Image, NDArray[np.bool_]]:
            middle, bent = _broken_on_both_sides(known)
            return middle, np.ones_like(bent) if next(rows_first, False) else bent

        with patch.object(depth_camera, "_between", between):
            return super().inverse_depths(first, cast)


_broken_on_both_sides = depth_camera._between


def _broken_on_either_side(known: Image) -> tuple[Image, NDArray[np.bool_]]:
    middle, _ = _broken_on_both_sides(known)
    bend, allowed = np.abs(np.diff(known, 2, axis=0)), depth_camera._STRAIGHT * middle
    bent = np.zeros_like(known, dtype=np.bool_)
    bent[1:-1] = bend > allowed[1:]
    bent[:-2] |= bend > allowed[:-1]
    bent[-1] = True
    return middle, bent


def camera_with(rule: type[Infill], rays: RayScene) -> DepthCamera:
    """The drone's camera with another rule of which pixels are cast, or with its own."""
    with patch.object(depth_camera, "Infill", rule):
        return DepthCamera(rays, np.random.default_rng(1))
