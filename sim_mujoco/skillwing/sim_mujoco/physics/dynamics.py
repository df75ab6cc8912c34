"""The MuJoCo model of a world with its drones, advanced in one step for all of them."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco

from skillwing.onboard.frames.vectors import Vector
from skillwing.sim_mujoco.physics.hexacopter import BODY, GEAR_HEIGHT, attach_to
from skillwing.sim_mujoco.world.footprint import Point
from skillwing.sim_mujoco.world.world import World

_CLEAR = 0.005
"""Height of the skids above the ground at the start [m]."""


class Dynamics:
    """Model and state of all drones of one world, with a wind for each drone.

    drones: their names in the model. The same inputs give the same motion, bit by bit.
    """

    dt = 0.002

    def __init__(self, world: World, places: Sequence[Point]) -> None:
        """places: where the drones stand at time 0, at least one [m]."""
        spec = world.spec()
        self.drones = tuple(BODY if number == 0 else f"{BODY}-{number + 1}" for number in range(len(places)))
        for name, place in zip(self.drones, places, strict=True):
            attach_to(spec, (*place, _ground(world, place) + GEAR_HEIGHT + _CLEAR), name)
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        self._winds: list[Vector] = [(0.0, 0.0, 0.0)] * len(places)
        self._velocities = tuple(self._velocity_range(name) for name in self.drones)
        mujoco.mj_forward(self.model, self.data)

    def set_wind(self, number: int, wind: Vector) -> None:
        """Set the wind at one drone from now on, in the world frame [m/s]."""
        self._winds[number] = wind
        self.model.opt.wind[:] = wind

    def step(self) -> None:
        """Advance all drones by `dt`, with the thrusts in `data.ctrl`."""
        if all(wind == self._winds[0] for wind in self._winds):
            mujoco.mj_step(self.model, self.data)
        else:
            self._step_in_different_winds()

    def _step_in_different_winds(self) -> None:
        """The same step, with the drag of each drone in the wind at its place.

        MuJoCo has one wind. So the passive forces are computed once for each wind, and each drone keeps its own. Only
        the derivative of the drag, by which the integrator damps, takes the last wind for all.
        """
        mujoco.mj_step1(self.model, self.data)
        forces = self.data.qfrc_passive.copy()
        for own, wind in zip(self._velocities, self._winds, strict=True):
            self.model.opt.wind[:] = wind
            mujoco.mj_passive(self.model, self.data)
            forces[own] = self.data.qfrc_passive[own]
        self.data.qfrc_passive[:] = forces
        mujoco.mj_step2(self.model, self.data)

    def _velocity_range(self, name: str) -> slice:
        first = int(self.model.jnt_dofadr[self.model.joint(f"{name}/root").id])
        return slice(first, first + 6)


def _ground(world: World, place: Point) -> float:
    """Height of the ground where a drone stands; that of the pad counts as 0 [m]."""
    return 0.0 if place == world.home else world.terrain.height(*place)
