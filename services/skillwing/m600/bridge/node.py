"""The robot bridge: states and data from the functional layer up, revoked authority down.

Upwards, health and flight state become extern transitions, and telemetry becomes data. Downwards, fencing tokens that
the resource manager revokes become `fl/authority`: guidance then brakes, and refuses commands with these tokens.

Goals do not pass through the bridge. Skill managers command the functional layer themselves: guidance at
`fl/guidance/command`, the other nodes at their command keys. The `lidar_mapping` manager itself ends on a diverged map.
"""

from __future__ import annotations

import logging
from functools import partial
from typing import Any

from skillwing.dsl import load
from skillwing.dsl.model import Skillset
from skillwing.m600.bridge.levels import SILENCE, BatteryLevel, ExternLevels, Level, LinkLevel, LinkState
from skillwing.m600.bridge.telemetry import Telemetry
from skillwing.m600.latest import Latest
from skillwing.onboard.topics.faults import read_fault_id
from skillwing.onboard.topics.flight import BATTERY, FLIGHT, Battery, FlightState
from skillwing.onboard.topics.guidance import AUTHORITY, Revoked
from skillwing.onboard.topics.link import LINK_STATUS, LinkStatus
from skillwing.onboard.topics.sensors import HEALTH, Health, SensorStatus
from skillwing.services.bus import Answer, Bus, Refused, Sample
from skillwing.services.client.causal_feed import CausalFeed
from skillwing.services.client.resource_changes import ResourceChanges
from skillwing.services.options import required
from skillwing.services.protocol import Keys, Lost, ProtocolError, Record, RecordKind, Violated, decode, encode
from skillwing.services.timeline import Timeline

RESEND_PERIOD = 0.5
"""Period of the comparison of the resources with the robot; a change is passed on at once [s]."""
FLIGHT_SILENCE = 2.0
"""Time without a flight state after which the authority is UNAVAILABLE [s]."""
SECOND_CHECK = 0.5
"""Delay of a second check [s]. After a suspension of the bridge itself, the missed messages arrive first."""
SENSOR_RESOURCES = {"zed": "zed_status", "lidar": "lidar_status"}
"""Resources that mirror the health of a sensor; the health of other sensors goes to the timeline only."""
_log = logging.getLogger(__name__)


def make_bridge(options: dict[str, Any]) -> RobotBridge:
    """Options: `skillset`, the path of the .skillset file."""
    return RobotBridge(load(required(options, "skillset")))


class RobotBridge:
    """The node `bridge`."""

    name = "bridge"
    owns_clock = False

    def __init__(self, skillset: Skillset) -> None:
        self._skillset = skillset
        self._levels = ExternLevels()
        self._battery = BatteryLevel()
        self._link = LinkLevel()
        self._health: dict[str, SensorStatus] = {}
        self._failsafe = ""
        self._faults: set[str] = set()
        self._asked: set[str] = set()
        self._complaints: set[str] = set()

    def attach(self, bus: Bus) -> None:
        keys = Keys(self._skillset.name)
        self._bus = bus
        self._timeline = Timeline(bus, keys)
        self._resources = CausalFeed(bus, keys, on_change=self._follow)
        self._changes = ResourceChanges(bus, self._skillset, self._resources, source=self.name)
        self._authority = bus.advertise(AUTHORITY, events=True)
        self._telemetry = Telemetry(bus, self._skillset)
        Latest(bus, f"{HEALTH}/*", Health, self._on_health, events=True)
        self._flight = Latest(bus, FLIGHT, FlightState, self._on_flight)
        bus.every(FLIGHT_SILENCE / 4, self._check_vehicle)
        Latest(bus, BATTERY, Battery, self._on_battery)
        self._modem = Latest(bus, LINK_STATUS, LinkStatus, self._on_link)
        bus.every(SILENCE / 4, self._check_modem)
        bus.subscribe(keys.verdict("*"), self._on_verdict, events=True)
        bus.every(RESEND_PERIOD, self._follow)

    def detach(self) -> None:
        """Do nothing: the next bridge reads the robot's state from the start."""

    # --- from the robot -----------------------------------------------------------------------------------------------

    def _on_health(self, health: Health) -> None:
        before = self._health.get(health.sensor)
        if health.status is before:
            return
        self._health[health.sensor] = health.status
        if health.cause is not None:
            self._record_fault(health.cause, health.sensor, health.t)
        self._timeline.publish(
            Record(
                id=health.id,
                t=health.t,
                source=self.name,
                kind=RecordKind.HEALTH,
                subject=health.sensor,
                before=before,
                after=health.status,
                text=health.reason,
                cause=health.cause,
            )
        )
        resource = SENSOR_RESOURCES.get(health.sensor)
        if resource is not None:
            self._levels.want(resource, health.status, health.id)
            self._follow()

    def _record_fault(self, cause: str, subject: str, t: float) -> None:
        """Record, once, the root of a cause chain: a fault that a simulator names, at the time of its injection.

        t: time of its discovery, which is in the text.
        """
        if cause in self._faults:
            return
        self._faults.add(cause)
        kind, since = read_fault_id(cause)
        found = "" if since is None else f", discovered after {max(0.0, t - since):.2f} s"
        self._timeline.publish(
            Record(
                id=cause,
                t=t if since is None else min(since, t),
                source=self.name,
                kind=RecordKind.FAULT,
                subject=subject,
                before=None,
                after=kind,
                text=f"{kind} of {subject} is on{found}",
            )
        )

    def _on_flight(self, flight: FlightState) -> None:
        self._want("SDK_authority", "AVAILABLE" if flight.authority else "UNAVAILABLE", "safety pilot")
        self._want("homepoint_status", "VALID" if flight.home_valid else "INVALID", "home point")
        self._want("flight_status", "ON_GROUND" if flight.on_ground else "IN_AIR", "landing gear")
        self._record_failsafe(flight.failsafe)

    def _check_vehicle(self) -> None:
        if self._is_silent:
            self._bus.after(SECOND_CHECK, self._lose_vehicle)

    def _lose_vehicle(self) -> None:
        """Withdraw the authority over a silent vehicle: skills that need it end, and cannot start."""
        if self._is_silent:
            self._want(
                "SDK_authority", "UNAVAILABLE", "vehicle", f"its flight state is silent for {FLIGHT_SILENCE:g} s"
            )

    @property
    def _is_silent(self) -> bool:
        return self._flight.value is not None and not self._flight.is_fresh(FLIGHT_SILENCE)

    def _record_failsafe(self, failsafe: str) -> None:
        """Record a failsafe of the autopilot: no resource has this state, but readers of the timeline need it."""
        if failsafe != self._failsafe:
            before, after = ("FAILSAFE" if each else "NORMAL" for each in (self._failsafe, failsafe))
            self._timeline.record(RecordKind.HEALTH, "autopilot", before, after, text=failsafe)
            self._failsafe = failsafe

    def _on_battery(self, battery: Battery) -> None:
        self._want("battery_status", self._battery.update(battery.percent), "battery", f"{battery.percent:.0f} %")

    def _on_link(self, link: LinkStatus) -> None:
        through = link.bandwidth * (1.0 - link.loss) / 1e6
        state = self._link.update(through)
        if link.fault is not None:
            self._record_fault(link.fault, "link", link.t)
        fault = link.fault if state is not LinkState.GOOD else None
        self._want("link_status", state, "link", f"{through:.2f} Mbit/s", fault)

    def _check_modem(self) -> None:
        if self._modem.value is not None and not self._modem.is_fresh(SILENCE):
            self._want("link_status", self._link.update(0.0), "link", f"the modem is silent for {SILENCE:g} s")

    def _want(self, resource: str, state: str, subject: str, text: str = "", fault: str | None = None) -> None:
        """Require a state of a resource. A change is the root of a cause chain, unless a simulator names its fault."""
        before = self._levels.wanted(resource)
        if state == before:
            return
        cause = self._timeline.record(RecordKind.HEALTH, subject, before, state, text=text, cause=fault)
        self._levels.want(resource, state, cause)
        self._follow()

    # --- from the resource manager ------------------------------------------------------------------------------------

    def _follow(self) -> None:
        """Ask for each resource's required state, with one request at a time for each."""
        for level in self._levels.mismatches(self._resources.view.states):
            if level.resource not in self._asked:
                self._asked.add(level.resource)
                self._changes.trigger(level.resource, level.state, partial(self._answered, level), level.cause)

    def _answered(self, level: Level, answer: Answer) -> None:
        self._asked.discard(level.resource)
        if isinstance(answer, Refused) and answer.error.message not in self._complaints:
            self._complaints.add(answer.error.message)
            _log.warning("%s -> %s was refused: %s", level.resource, level.state, answer.error.message)
        if self._levels.wanted(level.resource) != level.state:
            # The robot has changed meanwhile. The same request waits for the next period: it may always be refused.
            self._follow()

    def _on_verdict(self, sample: Sample) -> None:
        try:
            verdict = decode(sample.payload, Violated | Lost)  # pyright: ignore[reportArgumentType] - a tagged union
        except ProtocolError as error:
            _log.warning("dropped a message on %s: %s", sample.key, error)
            return
        self._authority.put(encode(Revoked(goal_id=verdict.goal_id, token=verdict.token, record=verdict.record)))
