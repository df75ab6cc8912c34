"""The overview shows the whole site of any world."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from skillwing.evaluation.dashboard.arrangement import overview
from skillwing.sim_mujoco.world.kinds import KINDS, make_site

HALF_HEIGHT = math.tan(math.radians(55.0 / 2))
"""Half of the height of the viewer's picture at a depth of one metre [m]."""
HALF_WIDTH = 1.6 * HALF_HEIGHT


@pytest.mark.parametrize("kind", KINDS)
@given(seed=st.integers(0, 50))
def test_wherever_the_mission_may_lead_is_in_view(kind: str, seed: int) -> None:
    site = make_site(seed, kind)
    eye = overview(site)
    forward = np.subtract(eye.target, eye.position)
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    axes = np.array([forward, right, np.cross(right, forward)])
    west, south, east, north = site.area
    for place in (*itertools.product((west, east), (south, north), (0.0,)), *site.way):
        depth, aside, above = axes @ np.subtract(place, eye.position)
        assert depth > 0.0
        assert math.fabs(aside) <= HALF_WIDTH * depth
        assert math.fabs(above) <= HALF_HEIGHT * depth
