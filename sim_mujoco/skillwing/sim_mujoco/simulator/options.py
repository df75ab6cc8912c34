"""Options of a simulator with one drone, and the simulator that follows from them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import msgspec

from skillwing.onboard.frames.extent import FenceOptions
from skillwing.services.options import OptionsError, read_options
from skillwing.sim_mujoco.autopilot.autopilot import FailsafeLimits
from skillwing.sim_mujoco.autopilot.failsafes import CRITICAL_CHARGE
from skillwing.sim_mujoco.physics.battery import PACKS
from skillwing.sim_mujoco.physics.wind import Gust
from skillwing.sim_mujoco.scenario.format import FaultOptions, GustOptions, PilotOptions, WindStrength, WindVector
from skillwing.sim_mujoco.scenario.reading import ScenarioError, read_scenario
from skillwing.sim_mujoco.sensors.faults import Fault, Seconds
from skillwing.sim_mujoco.sensors.receivers import ReceiverName
from skillwing.sim_mujoco.sensors.table import SENSORS
from skillwing.sim_mujoco.world.world import World, make_world


class PackOptions(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A failure of a number of battery packs: `{"at": 40.0, "packs": 3}`."""

    at: Seconds
    packs: Annotated[int, msgspec.Meta(ge=1, lt=PACKS)]


class SimOptions(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Options of a simulator with one drone.

    world, scale: kind and size of the world. factor: pace that the clock announces. authority: the computer has it at
    the start. turbulence: wind at a height of 6 m that causes it [m/s]. battery_floor: charge below which the autopilot
    lands [%]. geofence: replaces the world's, for the autopilot's guard and for the truth. receiver: class of satellite
    receivers. scenario: a file; other options add to its lists, and replace its single values.
    """

    seed: int = 1
    world: str = "courtyard"
    scale: float = 1.0
    scenario: str | None = None
    faults: tuple[FaultOptions, ...] = ()
    pilot: tuple[PilotOptions, ...] = ()
    wind: WindVector = (0.0, 0.0, 0.0)
    turbulence: WindStrength = 0.0
    gusts: tuple[GustOptions, ...] = ()
    battery: float = 100.0
    packs_fail: tuple[PackOptions, ...] = ()
    battery_floor: float = CRITICAL_CHARGE
    geofence: FenceOptions | None = None
    factor: float = 1.0
    authority: bool = True
    receiver: ReceiverName = "rtk"
    sensors: tuple[str, ...] = msgspec.field(default_factory=lambda: tuple(SENSORS))

    def make_world(self) -> World:
        """The world, inside its fence. Raises ValueError."""
        world = make_world(self.seed, self.world, self.scale)
        return world if self.geofence is None else world.fenced(self.geofence.box)

    def of_drone(self, world: World) -> dict[str, Any]:
        """Keyword arguments of `Simulator` for the drone. Raises ValueError."""
        return {
            "faults": [Fault(f.sensor, f.kind, f.at, f.duration, f.magnitude, f.zone) for f in self.faults],
            "pilot": [(event.at, event.authority) for event in self.pilot],
            "wind": self.wind,
            "turbulence": self.turbulence,
            "gusts": [Gust(g.at, g.velocity, g.duration) for g in self.gusts],
            "limits": FailsafeLimits(fence=world.geofence, charge=self.battery_floor),
            "battery_percent": self.battery,
            "packs_fail": [(event.at, event.packs) for event in self.packs_fail],
            "sensors": self.sensors,
            "receiver": self.receiver,
        }


def read_sim_options(options: dict[str, Any]) -> SimOptions:
    """The options with those of their scenario. Raises OptionsError."""
    wanted = read_options(options, SimOptions)
    if wanted.scenario is None:
        return wanted
    try:
        scenario = read_scenario(Path(wanted.scenario)).sim_options()
    except ScenarioError as error:
        raise OptionsError(str(error)) from error
    lists = {name: getattr(wanted, name) + scenario.pop(name) for name in ("faults", "gusts", "pilot")}
    single = {name: value for name, value in scenario.items() if name not in options}
    return msgspec.structs.replace(wanted, **lists, **single)
