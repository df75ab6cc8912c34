"""Guidance as a process: commands and reports in, setpoints and status out."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import msgspec

from skillwing.onboard.commands.service import answer_with
from skillwing.onboard.frames.extent import FenceOptions
from skillwing.onboard.guidance.core import GuidanceCore
from skillwing.onboard.sensor_data.names import RANGE
from skillwing.onboard.topics import flight, guidance, obstacles, sensors
from skillwing.onboard.topics.common import Vector2
from skillwing.onboard.topics.navigation import NAVIGATION, Navigation
from skillwing.services.bus import Bus, Publisher
from skillwing.services.bus.reading import message_reader
from skillwing.services.options import read_options
from skillwing.services.protocol import Message, encode

M = TypeVar("M", bound=Message)
STATUS_PERIOD = 0.05


class GuidanceNode:
    """Shell around a `GuidanceCore`, clocked by navigation.

    A command is answered at once, but yields no setpoint before the next navigation message (50 Hz). Without navigation
    there are no setpoints, and the autopilot's failsafe takes over.
    """

    name = "guidance"
    owns_clock = False
    closes_loop = True

    def __init__(self, core: GuidanceCore) -> None:
        self._core = core
        self._bus: Bus | None = None
        self._setpoints: Publisher | None = None
        self._status: Publisher | None = None
        self._home: Vector2 = (0.0, 0.0)

    def attach(self, bus: Bus) -> None:
        self._bus = bus
        self._setpoints = bus.advertise(flight.AUTOPILOT_SETPOINT)
        self._status = bus.advertise(guidance.GUIDANCE_STATUS)
        core = self._core
        self._follow(flight.FLIGHT, flight.FlightState, self._on_flight)
        self._follow(sensors.RANGE, sensors.Range, lambda seen: core.range(seen.t, seen.distance))
        self._follow(obstacles.OBSTACLE_STATUS, obstacles.ObstacleStatus, core.obstacles)
        self._follow(NAVIGATION, Navigation, self._on_navigation)
        health = message_reader(sensors.Health, lambda said: core.health(said, bus.now()))
        bus.subscribe(sensors.health_key(RANGE), health, events=True)
        revoke = message_reader(guidance.Revoked, lambda revoked: core.revoke(revoked, bus.now()))
        bus.subscribe(guidance.AUTHORITY, revoke, events=True)
        # Kept in a field: the bus withdraws a publisher without a reference, and late subscribers need this message.
        self._geofence = bus.advertise(guidance.GEOFENCE, events=True)
        self._publish_geofence()
        bus.serve(guidance.GUIDANCE_COMMAND, answer_with(guidance.GuidanceCommand, self._on_command))
        bus.every(STATUS_PERIOD, self._publish_status)

    def detach(self) -> None:
        """Do nothing: the autopilot detects the end of setpoints by itself."""

    def _follow(self, key: str, kind: type[M], use: Callable[[M], object]) -> None:
        assert self._bus is not None
        self._bus.subscribe(key, message_reader(kind, use), latest_only=True)

    def _publish_geofence(self) -> None:
        targets = self._core.targets
        self._geofence.put(encode(guidance.Geofence(low=targets.low, high=targets.high, home=self._home)))

    def _on_flight(self, state: flight.FlightState) -> None:
        self._core.flight(state)
        if state.home != self._home:
            self._home = state.home
            self._publish_geofence()

    def _on_navigation(self, navigation: Navigation) -> None:
        self._core.navigation(navigation)
        setpoint = self._core.tick(navigation.t)
        if setpoint is not None and self._setpoints is not None:
            self._setpoints.put(encode(setpoint))

    def _on_command(self, command: guidance.GuidanceCommand) -> str:
        assert self._bus is not None
        return self._core.command(command, self._bus.now())

    def _publish_status(self) -> None:
        if self._bus is not None and self._status is not None:
            self._status.put(encode(self._core.status(self._bus.now())))


class GuidanceOptions(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Options of `make_guidance`: the box in which the drone may be. `watch` False ignores obstacles, for tests."""

    geofence: FenceOptions
    watch: bool = True


def make_guidance(options: dict[str, Any]) -> GuidanceNode:
    """The guidance node. Raises OptionsError."""
    wanted = read_options(options, GuidanceOptions)
    return GuidanceNode(GuidanceCore(wanted.geofence.box, watch=wanted.watch))
