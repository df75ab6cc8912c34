"""The simulator of several drones as one process: one owner of time, and a namespace for each drone's robot."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from skillwing.services.bus import Bus, MultiRobotBus
from skillwing.services.options import OptionsError
from skillwing.sim_mujoco.simulator.fleet import Fleet
from skillwing.sim_mujoco.simulator.node import SLICE, SimNode
from skillwing.sim_mujoco.simulator.options import SimOptions, read_sim_options
from skillwing.sim_mujoco.simulator.warm_up import compile_loops
from skillwing.sim_mujoco.world.standing import standing_places

ROBOTS = "robots"
OF_THE_WORLD = ("seed", "world", "scale", "geofence", "factor")
"""Options that all drones have in common."""


class SharedSimNode:
    """Shell around a `Fleet`: a `SimNode` for each drone, in the namespace of its robot, and one timer for all.

    All robots get the same time. It goes on when the followers of every robot have done their work.
    """

    name = "sim"
    owns_clock = True

    def __init__(self, fleet: Fleet, factor: float = 1.0) -> None:
        self._fleet = fleet
        self._nodes = {robot: SimNode(drone, factor) for robot, drone in fleet.drones.items()}

    def attach(self, bus: Bus) -> None:
        if not isinstance(bus, MultiRobotBus):
            raise TypeError(f"a simulator of several robots needs a bus with namespaces, not a {type(bus).__name__}")
        for robot, node in self._nodes.items():
            node.join(bus.beside(robot))
        bus.every(SLICE, self._advance)

    def detach(self) -> None:
        """Do nothing: no state outlives this process."""

    def _advance(self) -> None:
        for robot, happened in self._fleet.advance(self._fleet.t + SLICE).items():
            self._nodes[robot].publish(happened)


def make_shared_sim(options: dict[str, Any]) -> SharedSimNode:
    """The simulator node of the drones in `robots`: options of each by the name of its robot.

    Other options are those of `make_sim`, and hold for every drone that has no others. Raises OptionsError.
    """
    common = {name: value for name, value in options.items() if name != ROBOTS}
    drones = {robot: _of_one(robot, common, own) for robot, own in _robots(options).items()}
    first = next(iter(drones.values()))
    try:
        world = first.make_world()
        homes = dict(zip(drones, standing_places(world.site, len(drones)), strict=True))
        fleet = Fleet(world, homes, {robot: wanted.of_drone(world) for robot, wanted in drones.items()})
    except ValueError as error:
        raise OptionsError(str(error)) from error
    for robot, wanted in drones.items():
        fleet.drones[robot].autopilot.authority = wanted.authority
    compile_loops()
    return SharedSimNode(fleet, first.factor)


def _robots(options: Mapping[str, Any]) -> dict[str, Mapping[str, Any]]:
    found = options.get(ROBOTS)
    if not isinstance(found, dict) or not found:
        raise OptionsError('`robots` has to name a robot at least: {"left": {}, "right": {}}')
    return found


def _of_one(robot: str, common: Mapping[str, Any], own: Mapping[str, Any]) -> SimOptions:
    """Options of one drone. Raises OptionsError for an option of the world among its own."""
    if wrong := [name for name in OF_THE_WORLD if name in own]:
        raise OptionsError(f"`{wrong[0]}` is an option of the world; {robot} cannot have another one")
    return read_sim_options({**common, **own})
