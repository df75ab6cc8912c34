"""Inertial measurements of a drone that stands on its pad."""

from __future__ import annotations

import numpy as np

from skillwing.sim_mujoco.physics.physics import Physics
from skillwing.sim_mujoco.world.world import make_world


def test_a_drone_at_rest_feels_gravity_alone() -> None:
    """Whichever of the steps an IMU samples at: slipping skids must not look like a bias."""
    physics = Physics(make_world(4))
    felt: list[tuple[float, ...]] = []
    for _ in range(1200):
        physics.step([0.0] * 6)
        felt.append(physics.inertial)
    settled = np.array(felt[600:])
    for first in (0, 1):
        sampled = settled[first::2].mean(axis=0)
        np.testing.assert_allclose(sampled, [0.0, 0.0, 9.81, 0.0, 0.0, 0.0], atol=5e-3)
