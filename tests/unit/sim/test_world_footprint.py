"""Outlines in plan and their distances."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from skillwing.sim_mujoco.world.footprint import Footprint


@given(
    st.tuples(*[st.floats(-20, 20)] * 4),
    st.floats(-3, 3),
    st.floats(0, 2),
    st.tuples(st.floats(0.1, 4), st.floats(0.1, 4)),
)
def test_distance_to_a_segment_is_the_least_distance_to_its_points(
    ends: tuple[float, ...], yaw: float, radius: float, half: tuple[float, float]
) -> None:
    outline = Footprint((1.0, -2.0), half, yaw, radius)
    a, b = (ends[0], ends[1]), (ends[2], ends[3])
    sampled = min(
        outline.distance_to((a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1]))) for s in np.linspace(0, 1, 200)
    )
    step = math.dist(a, b) / 199
    exact = outline.distance_to_segment(a, b)
    assert exact - 1e-9 <= sampled <= exact + step + 1e-9
