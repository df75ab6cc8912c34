"""True motion of the drone at one moment."""

from __future__ import annotations

from dataclasses import dataclass

from skillwing.onboard.frames.vectors import Quaternion, Vector


@dataclass(frozen=True, slots=True)
class Motion:
    """True motion of the body at `t`: position and velocity ENU, attitude body to world, angular rate FLU."""

    t: float
    position: Vector
    velocity: Vector
    quaternion: Quaternion
    rate: Vector
