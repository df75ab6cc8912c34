"""Where the skills of this drone may send it. Guidance enforces the same fence; this is what is checked beforehand."""

from __future__ import annotations

from skillwing.sim_mujoco.topics import Vector3

HOME = (0.0, 0.0)
"""The home point: frames of the functional layer have their origin there (ENU, m)."""
LOW: Vector3 = (-12.0, -12.0, 1.0)
HIGH: Vector3 = (42.0, 32.0, 30.0)
"""Opposite corners of the box in which every target has to lie (ENU, m)."""


def refusal(target: Vector3) -> str | None:
    """What is wrong with a target (ENU, m), and what to do; None if it lies inside."""
    if all(low <= x <= high for low, x, high in zip(LOW, target, HIGH, strict=True)):
        return None
    return f"The target {_text(target)} lies outside the geofence. Stay between {_text(LOW)} and {_text(HIGH)}."


def nearest_inside(place: Vector3) -> Vector3:
    """The place itself, or the nearest one inside: the drone may hover a little outside, but not be sent there."""
    x, y, z = (min(max(low, x), high) for low, x, high in zip(LOW, place, HIGH, strict=True))
    return x, y, z


def _text(place: Vector3) -> str:
    return "({:g}, {:g}, {:g})".format(*place)
