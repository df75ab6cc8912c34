"""Simulator and guidance flown against each other in one loop, without a bus."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from functools import cache
from typing import Any

from skillwing.onboard.frames.vectors import Vector, heading_of
from skillwing.onboard.guidance.core import GuidanceCore
from skillwing.onboard.sensor_data.names import RANGE
from skillwing.onboard.topics.flight import FlightState
from skillwing.onboard.topics.guidance import GuidanceCommand, GuidanceStatus, Motion, MotionState, TakeOff
from skillwing.onboard.topics.navigation import Navigation
from skillwing.onboard.topics.obstacles import ObstacleStatus
from skillwing.onboard.topics.sensors import Health, SensorStatus
from skillwing.sim_mujoco.autopilot.autopilot import Setpoint
from skillwing.sim_mujoco.simulator.simulator import Simulator
from skillwing.sim_mujoco.world.world import World, make_world

WORLD = make_world(1)


class Rig:
    """A drone on its pad with a range-finder only; `fly` lets time pass at 50 Hz. Options are the simulator's."""

    def __init__(self, world: World = WORLD, **options: Any) -> None:
        self.sim = Simulator(world, sensors=(RANGE,), **options)
        self.core = GuidanceCore(world.geofence)
        self.connected = True
        self.lowers_ground_by = 0.0
        """Error of the range-finder [m]."""
        self.obstacles: Callable[[float, GuidanceStatus], ObstacleStatus | None] = lambda t, status: None
        self.track: list[tuple[float, Vector]] = []
        self._token = 0

    @property
    def status(self) -> GuidanceStatus:
        return self.core.status(self.sim.t)

    def command(self, goal: str, motion: Motion, token: int | None = None) -> str:
        """Send a command with the next token, or with the given one."""
        if token is None:
            self._token += 1
            token = self._token
        return self.core.command(GuidanceCommand(goal_id=goal, token=token, motion=motion), self.sim.t)

    def fly(self, seconds: float, until: Callable[[], bool] = lambda: False) -> bool:
        """Let time pass until the condition holds (True) or the time is over (False)."""
        end = self.sim.t + seconds
        while self.sim.t < end - 1e-9:
            self._slice()
            if until():
                return True
        return False

    def fly_until(self, *states: MotionState, seconds: float = 40.0) -> None:
        """Let time pass until the body's motion is in one of these states."""
        assert self.fly(seconds, lambda: self.status.body.state in states), self.status

    def take_off(self, height: float = 4.0) -> None:
        """Take off to this height and come to rest there."""
        self.fly(1.1)
        self.command("takeoff", TakeOff(height=height, speed=1.5))
        self.fly_until(MotionState.DONE)

    def _slice(self) -> None:
        happened = self.sim.advance(self.sim.t + 0.02)
        t, autopilot = self.sim.t, self.sim.autopilot
        self.track.append((t, self.sim.motion.position))
        for measurement in happened.measurements:
            if measurement.sensor == RANGE:
                self.core.range(measurement.end, self.lowers_ground_by + float(measurement.data[0]) or None)
        for sensor, change in happened.health:
            status = SensorStatus(change.condition.value)
            self.core.health(Health(id="health", t=change.t, sensor=sensor, status=status, reason=change.reason), t)
        for solution in happened.solutions:
            self.core.navigation(
                Navigation(
                    t=solution.t,
                    position=solution.position,
                    velocity=solution.velocity,
                    quaternion=solution.quaternion,
                    angular_velocity=solution.rate,
                    heading=heading_of(solution.quaternion),
                )
            )
        self.core.flight(
            FlightState(
                t=t,
                on_ground=autopilot.on_ground,
                rotors_on=self.sim.rotors_on,
                home_valid=self.sim.home_valid,
                authority=autopilot.authority,
                failsafe=autopilot.failsafe,
                follows=autopilot.follows,
                holds_heading=autopilot.holds_heading,
            )
        )
        report = self.obstacles(t, self.status)
        if report is not None:
            self.core.obstacles(report)
        wanted = self.core.tick(t)
        if wanted is not None and self.connected:
            self.sim.command(
                Setpoint(wanted.position, wanted.velocity, wanted.heading, wanted.rotors, wanted.acceleration)
            )


def airborne(height: float = 4.0) -> Rig:
    """Rig at rest above its pad: a copy of one that takes off once for all tests."""
    return deepcopy(_taken_off(height))


@cache
def _taken_off(height: float) -> Rig:
    rig = Rig()
    rig.take_off(height)
    return rig
