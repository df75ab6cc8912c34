"""Guidance as a process: commands and reports in, setpoints and status out."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import msgspec

from skillwing.onboard import topics
from skillwing.onboard.geofence import FenceOptions
from skillwing.onboard.guidance.core import GuidanceCore
from skillwing.onboard.messaging import answer_with
from skillwing.onboard.options import read_options
from skillwing.onboard.sensor_data.names import RANGE
from skillwing.services.bus import Bus, Publisher
from skillwing.services.bus.reading import message_reader
from skillwing.services.protocol import Message, encode

M = TypeVar("M", bound=Message)
STATUS_PERIOD = 0.05


class GuidanceNode:
    """Shell around a `GuidanceCore`. It is clocked by navigation: without it there are no setpoints, and the
    autopilot's failsafe takes over."""

    name = "guidance"
    owns_clock = False
    closes_loop = True

    def __init__(self, core: GuidanceCore) -> None:
        self._core = core
        self._bus: Bus | None = None
        self._setpoints: Publisher | None = None
        self._status: Publisher | None = None

    def attach(self, bus: Bus) -> None:
        self._bus = bus
        self._setpoints = bus.advertise(topics.AUTOPILOT_SETPOINT)
        self._status = bus.advertise(topics.GUIDANCE_STATUS)
        core = self._core
        self._follow(topics.FLIGHT, topics.FlightState, core.flight)
        self._follow(topics.RANGE, topics.Range, lambda seen: core.range(seen.t, seen.distance))
        self._follow(topics.OBSTACLE_STATUS, topics.ObstacleStatus, core.obstacles)
        self._follow(topics.NAVIGATION, topics.Navigation, self._on_navigation)
        health = message_reader(topics.Health, lambda said: core.health(said, bus.now()))
        bus.subscribe(topics.health_key(RANGE), health, events=True)
        revoke = message_reader(topics.Revoked, lambda revoked: core.revoke(revoked, bus.now()))
        bus.subscribe(topics.AUTHORITY, revoke, events=True)
        targets = core.targets
        # Held, for what nobody holds is taken back, and whoever comes later has to hear it.
        self._geofence = bus.advertise(topics.GEOFENCE, events=True)
        self._geofence.put(encode(topics.Geofence(low=targets.low, high=targets.high)))
        bus.serve(topics.GUIDANCE_COMMAND, answer_with(topics.GuidanceCommand, self._on_command))
        bus.every(STATUS_PERIOD, self._publish_status)

    def detach(self) -> None:
        """The autopilot notices by itself that setpoints have ended."""

    def _follow(self, key: str, kind: type[M], use: Callable[[M], object]) -> None:
        assert self._bus is not None
        self._bus.subscribe(key, message_reader(kind, use), latest_only=True)

    def _on_navigation(self, navigation: topics.Navigation) -> None:
        self._core.navigation(navigation)
        setpoint = self._core.tick(navigation.t)
        if setpoint is not None and self._setpoints is not None:
            self._setpoints.put(encode(setpoint))

    def _on_command(self, command: topics.GuidanceCommand) -> str:
        assert self._bus is not None
        return self._core.command(command, self._bus.now())

    def _publish_status(self) -> None:
        if self._bus is not None and self._status is not None:
            self._status.put(encode(self._core.status(self._bus.now())))


class GuidanceOptions(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Options of `make_guidance`: the box in which the drone may be. `watch` False flies without regard to obstacles:
    a test switch."""

    geofence: FenceOptions
    watch: bool = True


def make_guidance(options: dict[str, Any]) -> GuidanceNode:
    """The guidance node. Raises OptionsError."""
    wanted = read_options(options, GuidanceOptions)
    return GuidanceNode(GuidanceCore(wanted.geofence.box, watch=wanted.watch))
