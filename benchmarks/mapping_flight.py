"""Mapping flight for benchmarks: simulator and guidance in one loop, without processes and at full speed.

The drone waits on its pad, takes off, and flies the planned route of a world without obstacles on the route. Its
nose points along the track or across it.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterable, Iterator

from skillwing.onboard.frames.vectors import Motion, heading_of
from skillwing.onboard.guidance.core import GuidanceCore
from skillwing.onboard.topics.flight import FlightState
from skillwing.onboard.topics.guidance import FlyTo, GuidanceCommand, MotionState, TakeOff, Turn, YawMode
from skillwing.onboard.topics.guidance import Motion as Wanted
from skillwing.onboard.topics.navigation import Navigation
from skillwing.sim_mujoco.autopilot.autopilot import Setpoint
from skillwing.sim_mujoco.navigation.navigator import Solution
from skillwing.sim_mujoco.sensors.faults import Fault
from skillwing.sim_mujoco.simulator.lockstep import Output
from skillwing.sim_mujoco.simulator.simulator import Simulator
from skillwing.sim_mujoco.world.world import World, make_world

SPEED = 2.0
STANDING = 3.0
"""Time on the pad before takeoff [s]."""
_SLICE = 0.02
_LONGEST = 300.0


@dataclasses.dataclass(frozen=True, slots=True)
class Moment:
    """Output of one step of 20 ms, and the true motion at its end."""

    happened: Output
    truth: Motion


class MappingFlight:
    """One flight, as an iterable for a single pass."""

    def __init__(
        self,
        seed: int,
        *,
        across: bool,
        faults: Iterable[Fault] = (),
        sensors: Iterable[str] = ("lidar", "imu", "range"),
    ) -> None:
        """across: the nose points across the track, as it does while the LiDAR looks ahead."""
        self.world = free_route(seed)
        self.simulator = Simulator(self.world, faults=faults, sensors=tuple(sensors))
        self._across = across
        self._core = GuidanceCore(self.world.geofence)
        self._token = 0

    def __iter__(self) -> Iterator[Moment]:
        yield from self._pass(lambda: self.simulator.t >= STANDING)
        at = self.world.route[0]
        yield from self._do(TakeOff(height=at[2], speed=1.5))
        for target in self.world.route[1:]:
            if math.dist(at, target) > 0.5:
                yield from self._leg(at, target)
                at = target

    def _leg(self, at: tuple[float, float, float], target: tuple[float, float, float]) -> Iterator[Moment]:
        if self._across:
            heading = math.atan2(target[1] - at[1], target[0] - at[0]) - math.pi / 2
            self._command("turn", Turn(heading=heading, lock=True))
            began = self.simulator.t
            # `_do` waits for the body, not for the heading axis, so the turn gets a fixed time.
            yield from self._pass(lambda: self.simulator.t >= began + 5.0)
        nose = YawMode.FREE if self._across else YawMode.ALONG_TRACK
        yield from self._do(FlyTo(target=target, speed=SPEED, nose=nose))

    def _do(self, motion: Wanted) -> Iterator[Moment]:
        self._command("fly", motion)
        yield from self._pass(lambda: self._core.status(self.simulator.t).body.state is MotionState.DONE)

    def _command(self, goal: str, motion: Wanted) -> None:
        self._token += 1
        command = GuidanceCommand(goal_id=f"{goal}-{self._token}", token=self._token, motion=motion)
        self._core.command(command, self.simulator.t)

    def _pass(self, done: Callable[[], bool]) -> Iterator[Moment]:
        while not done():
            if self.simulator.t > _LONGEST:
                raise RuntimeError(
                    f"the flight has not ended after {_LONGEST:g} s: {self._core.status(self.simulator.t)}"
                )
            happened = self.simulator.advance(self.simulator.t + _SLICE)
            self._guide(happened)
            yield Moment(happened, self.simulator.motion)

    def _guide(self, happened: Output) -> None:
        simulator, core = self.simulator, self._core
        for measurement in happened.measurements:
            if measurement.sensor == "range":
                core.range(measurement.end, float(measurement.data[0]) or None)
        for solution in happened.solutions:
            core.navigation(as_navigation(solution))
        autopilot = simulator.autopilot
        core.flight(
            FlightState(
                t=simulator.t,
                on_ground=autopilot.on_ground,
                rotors_on=simulator.rotors_on,
                home_valid=simulator.home_valid,
                authority=autopilot.authority,
                failsafe=autopilot.failsafe,
                follows=autopilot.follows,
                holds_heading=autopilot.holds_heading,
            )
        )
        wanted = core.tick(simulator.t)
        if wanted is not None:
            simulator.command(
                Setpoint(wanted.position, wanted.velocity, wanted.heading, wanted.rotors, wanted.acceleration)
            )


def as_navigation(solution: Solution) -> Navigation:
    """Navigation message for a solution, as the simulator's node publishes it."""
    return Navigation(
        t=solution.t,
        position=solution.position,
        velocity=solution.velocity,
        quaternion=solution.quaternion,
        angular_velocity=solution.rate,
        heading=heading_of(solution.quaternion),
        valid=solution.valid,
        sigma=solution.sigma,
        height_sigma=solution.height_sigma,
    )


def free_route(seed: int) -> World:
    """World of a seed, without the obstacles on its planned route."""
    world = make_world(seed)
    return dataclasses.replace(world, obstacles=tuple(o for o in world.obstacles if o.leg is None))
