"""Bridge over a gap in inertial measurements: the drone's movement meanwhile, by navigation.

Odometry takes only the movement between two solutions, not navigation's position. The movement is good to some
centimetres in a second or two, and the next scans correct the rest.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from skillwing.onboard.odometry import so3
from skillwing.onboard.odometry.so3 import Floats
from skillwing.onboard.odometry.state import ATTITUDE, POSITION, VELOCITY, FilterState
from skillwing.onboard.topics.navigation import Navigation

VALID: Final = 0.2
"""Largest distance in time between a solution and the moment that it is used for [s]."""
_MOVEMENT, _ROTATION, _SPEED = 0.15, 0.02, 0.15
"""Standard deviations of the movement, rotation and velocity taken from navigation, per axis [m, rad, m/s]."""


class NavigationBridge:
    """Memory of the navigation solution at the time that odometry has reached."""

    def __init__(self) -> None:
        self._latest: Navigation | None = None
        self._left: tuple[float, Navigation] | None = None

    def navigation(self, navigation: Navigation) -> None:
        """Take a navigation solution."""
        self._latest = navigation

    def reached(self, t: float) -> None:
        """Note that odometry has reached `t`."""
        latest = self._latest
        self._left = (t, latest) if latest is not None and _covers(latest, t) else None

    def over(self, state: FilterState, covariance: Floats, end: float) -> tuple[FilterState, Floats] | None:
        """State and covariance (N, N) at `end`, from those at the last `reached`; None without navigation at either
        end."""
        latest = self._latest
        if self._left is None or latest is None or not _covers(latest, end):
            return None
        left, landed = _pose(self._left[1], self._left[0]), _pose(latest, end)
        rotation = left[1].T @ landed[1]
        moved = replace(
            state,
            position=state.position + landed[0] - left[0],
            turn=state.turn @ rotation,
            velocity=np.array(latest.velocity),
        )
        # Errors of the attitude are in body axes, which have turned.
        turned = np.eye(len(covariance))
        turned[ATTITUDE, ATTITUDE] = rotation.T
        spread = turned @ covariance @ turned.T
        spread[VELOCITY, :] = spread[:, VELOCITY] = 0.0
        spread[VELOCITY, VELOCITY] = np.eye(3) * _SPEED**2
        spread[POSITION, POSITION] += np.eye(3) * _MOVEMENT**2
        spread[ATTITUDE, ATTITUDE] += np.eye(3) * _ROTATION**2
        return moved, spread


def _covers(navigation: Navigation, t: float) -> bool:
    return navigation.valid and abs(t - navigation.t) <= VALID


def _pose(navigation: Navigation, t: float) -> tuple[Floats, Floats]:
    """Position (3,) and attitude (3, 3), body to world, at a `t` near the solution."""
    later = t - navigation.t
    turn = so3.matrix(np.array(navigation.quaternion)) @ so3.exp(later * np.array(navigation.angular_velocity))
    return np.array(navigation.position) + later * np.array(navigation.velocity), turn
