"""Several drones in one world, advanced together, as one object without I/O."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from skillwing.sim_mujoco.physics.dynamics import Dynamics
from skillwing.sim_mujoco.physics.physics import Physics
from skillwing.sim_mujoco.simulator.lockstep import Output, advance_together
from skillwing.sim_mujoco.simulator.simulator import Simulator
from skillwing.sim_mujoco.world.footprint import Point
from skillwing.sim_mujoco.world.rays import RayScene
from skillwing.sim_mujoco.world.world import World


class Fleet:
    """Drones of one world, each a `Simulator` with sensors, battery, wind and faults of its own.

    drones: by the name of their robot. They touch each other, and their sensors see each other.
    """

    def __init__(self, world: World, homes: Mapping[str, Point], options: Mapping[str, Mapping[str, Any]]) -> None:
        """homes: place of each drone at the start, by robot; it has at least one. options: those of `Simulator`, by
        robot; none by default. Raises as `Simulator` does."""
        self._dynamics = Dynamics(world, tuple(homes.values()))
        rays = RayScene(world.triangles())
        self.drones: dict[str, Simulator] = {
            robot: Simulator(world, physics=Physics(world, self._dynamics, number), rays=rays, **options.get(robot, {}))
            for number, robot in enumerate(homes)
        }

    @property
    def t(self) -> float:
        return next(iter(self.drones.values())).t

    def advance(self, until: float) -> dict[str, Output]:
        """Advance all drones to `until`, in whole ticks; their outputs by robot."""
        outputs = advance_together(tuple(self.drones.values()), self._dynamics, until)
        return dict(zip(self.drones, outputs, strict=True))
