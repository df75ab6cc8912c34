"""The M600's functional layer without physics: the peer of its managers and bridge at the protocol's edge.

It flies in straight lines, brakes in half a second, and does what a test's switches tell it to do wrong.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from skillwing.onboard.topics import common, flight, guidance, mapping, navigation, obstacles, sensors
from skillwing.onboard.topics.common import Done, Vector3
from skillwing.onboard.topics.guidance import (
    AxisStatus,
    FlyTo,
    GuidanceCommand,
    GuidanceStatus,
    HoldPosition,
    Land,
    Motion,
    MotionState,
    Orbit,
    Revoked,
    Stop,
    TakeOff,
    Turn,
)
from skillwing.onboard.topics.mapping import ControlMapping
from skillwing.onboard.topics.obstacles import ObstacleSource, SelectObstacleSource
from skillwing.services.core.refusal import RefusedError
from skillwing.services.protocol import ErrorCode
from skillwing.services.testing import FakeLayer

PERIOD = 0.05
BRAKING = 0.5
FENCE = guidance.Geofence(low=(-12.0, -12.0, 1.0), high=(42.0, 32.0, 30.0))


@dataclass
class Holder:
    """One axis of the fake guidance."""

    goal_id: str | None = None
    token: int = -1
    motion: Motion | None = None
    state: MotionState = MotionState.IDLE
    remaining: float = 0.0
    stopped_at: float = 0.0
    authority_lost: bool = False
    text: str = ""
    no_view: bool = False

    @property
    def status(self) -> AxisStatus:
        lost = self.authority_lost and self.state is MotionState.ABORTED
        text = "the safety pilot has taken over" if lost else self.text
        return AxisStatus(
            goal_id=self.goal_id,
            state=self.state,
            remaining=self.remaining,
            text=text,
            authority_lost=lost,
            no_view=self.no_view and self.state is MotionState.BLOCKED,
        )


class M600Layer(FakeLayer):
    """Guidance, obstacle node, mapping node and telemetry in one node. The attributes are a test's switches.

    height: the drone is that high in the air already [m], None for on the ground.
    """

    listens = (guidance.AUTHORITY,)

    def __init__(self, height: float | None = None) -> None:
        super().__init__()
        self.position: Vector3 = (0.0, 0.0, 0.0)
        self.heading = 0.0
        self.on_ground = True
        self.authority = True
        self.failsafe = ""
        self.rotors_run_on = False
        self.percent = 100.0
        self.drift = 0.0
        self.stuck = False
        self.blocked_at: float | None = None
        self.free_distance: float | None = None
        self.aborts = False
        self.hears_of_pilot = False
        self.reports = True
        self.measures = True
        self.navigates = True
        self.tells_flight = True
        self.diverged = False
        self.laps_done = 0.0
        self.source = ObstacleSource.NONE
        self.landing_place: Vector3 | None = None
        self.taken = False
        self.refuses: type[Motion] | None = None
        self.mapping = False
        self.body = Holder()
        self.nose = Holder()
        if height is not None:
            self.fly_at(height)

    def setup(self) -> None:
        self.publish(guidance.GEOFENCE, FENCE, events=True)
        self.answer(guidance.GUIDANCE_COMMAND, GuidanceCommand, self._command)
        self.answer(obstacles.OBSTACLE_COMMAND, SelectObstacleSource, self._select)
        self.answer(obstacles.LANDING_PLACE, common.Empty, self._land_where)
        self.answer(mapping.MAPPING_COMMAND, ControlMapping, self._control)
        self.bus.every(PERIOD, self._tick)
        self.bus.every(0.1, self._sense)
        self.bus.every(1.0, self._slow)

    @property
    def commands(self) -> list[GuidanceCommand]:
        """Commands that guidance received."""
        return self.asked(guidance.GUIDANCE_COMMAND, GuidanceCommand)

    @property
    def motions(self) -> list[str]:
        """The names of the motions that guidance was asked for."""
        return [type(command.motion).__name__ for command in self.commands]

    @property
    def revoked(self) -> list[Revoked]:
        """The tokens that are no longer to be obeyed."""
        return self.heard(guidance.AUTHORITY, Revoked)

    def report_health(
        self, sensor: str, status: sensors.SensorStatus, health_id: str, cause: str | None = None
    ) -> None:
        message = sensors.Health(id=health_id, t=self.bus.now(), sensor=sensor, status=status, cause=cause)
        self.publish(sensors.health_key(sensor), message, events=True)

    def fly_at(self, height: float) -> None:
        """Be in the air already."""
        self.position, self.on_ground = (0.0, 0.0, height), False

    # --- commands ----------------------------------------------------------------------------------------------------

    def _command(self, command: GuidanceCommand) -> Done:
        if self.refuses is not None and isinstance(command.motion, self.refuses):
            raise RefusedError(ErrorCode.NOT_ALLOWED, "not there")
        if isinstance(command.motion, Stop):
            for axis in (self.body, self.nose):
                if axis.goal_id == command.goal_id:
                    axis.state, axis.stopped_at = MotionState.STOPPING, self.bus.now() + BRAKING
            return Done()
        axis = self.nose if isinstance(command.motion, Turn) else self.body
        axis.goal_id, axis.token, axis.motion = command.goal_id, command.token, command.motion
        axis.state = MotionState.MOVING
        return Done()

    def _select(self, command: SelectObstacleSource) -> Done:
        self.source = command.source
        return Done()

    def _control(self, command: ControlMapping) -> Done:
        self.mapping = command.run
        return Done()

    def _land_where(self, _: common.Empty) -> obstacles.LandingPlace:
        if self.position == self.landing_place:
            return obstacles.LandingPlace(place=None, text="free")
        taken = self.taken or self.landing_place is not None
        return obstacles.LandingPlace(place=self.landing_place, taken=taken, text="taken" if taken else "unknown")

    # --- motion ------------------------------------------------------------------------------------------------------

    def _tick(self) -> None:
        for axis in (self.body, self.nose):
            if axis.state is MotionState.STOPPING and self.bus.now() >= axis.stopped_at:
                axis.state = MotionState.STOPPED
        if self.body.state is MotionState.MOVING:
            self._move(self.body)
        if self.nose.state is MotionState.MOVING and isinstance(self.nose.motion, Turn):
            self._turn(self.nose.motion)
        if self.reports:
            self.publish(
                guidance.GUIDANCE_STATUS,
                GuidanceStatus(
                    t=self.bus.now(),
                    body=self.body.status,
                    heading=self.nose.status,
                    setpoint=self.position,
                    target=None,
                    free_distance=self.free_distance,
                    laps_done=self.laps_done if isinstance(self.body.motion, Orbit) else None,
                ),
            )

    def _move(self, axis: Holder) -> None:
        motion = axis.motion
        x, y, _ = self.position
        if self.aborts or self.hears_of_pilot:
            axis.state, axis.authority_lost = MotionState.ABORTED, self.hears_of_pilot
            return
        match motion:
            case TakeOff():
                self.on_ground = False
                self._step((x, y, motion.height), motion.speed)
            case Land():
                self._step((x, y, 0.0), motion.speed)
                if axis.state is MotionState.DONE:
                    self.on_ground = True
            case FlyTo():
                self._step(motion.target, motion.speed)
            case Orbit():
                self._circle(motion)
            case HoldPosition():
                axis.state = MotionState.DONE
            case _:
                pass

    def _circle(self, orbit: Orbit) -> None:
        """Around at once from where it is; the approach is left out."""
        axis, length = self.body, 2.0 * math.pi * orbit.radius
        flown = self.laps_done * length + orbit.speed * PERIOD
        axis.remaining = orbit.laps * length - flown
        if self.blocked_at is not None and axis.remaining <= self.blocked_at:
            axis.state = MotionState.BLOCKED
            return
        self.laps_done = min(flown / length, orbit.laps)
        if axis.remaining <= 0.0:
            axis.state = MotionState.DONE

    def _turn(self, turn: Turn) -> None:
        if self.aborts:
            self.nose.state = MotionState.ABORTED
        elif self.stuck:
            self.nose.remaining = 1.0
        else:
            self.heading, self.nose.remaining, self.nose.state = turn.heading, 0.0, MotionState.DONE

    def _step(self, target: Vector3, speed: float) -> None:
        axis = self.body
        axis.remaining = math.dist(self.position, target)
        if self.blocked_at is not None and axis.remaining <= self.blocked_at:
            axis.state = MotionState.BLOCKED
        if self.stuck or axis.state is not MotionState.MOVING:
            return
        stride = speed * PERIOD
        if axis.remaining <= stride:
            self.position, axis.remaining, axis.state = target, 0.0, MotionState.DONE
        else:
            share = stride / axis.remaining
            x, y, z = (here + share * (there - here) for here, there in zip(self.position, target, strict=True))
            self.position = (x + self.drift * PERIOD, y, z)

    # --- telemetry ---------------------------------------------------------------------------------------------------

    def _sense(self) -> None:
        now = self.bus.now()
        if self.navigates:
            self.publish(
                navigation.NAVIGATION,
                navigation.Navigation(
                    t=now,
                    position=self.position,
                    velocity=(0.0, 0.0, 0.0),
                    quaternion=(1.0, 0.0, 0.0, 0.0),
                    angular_velocity=(0.0, 0.0, 0.0),
                    heading=self.heading,
                ),
            )
        if self.tells_flight:
            self.publish(
                flight.FLIGHT,
                flight.FlightState(
                    t=now,
                    on_ground=self.on_ground,
                    rotors_on=self.rotors_run_on or not self.on_ground,
                    home_valid=True,
                    authority=self.authority,
                    failsafe=self.failsafe,
                ),
            )
        self.publish(
            obstacles.OBSTACLE_STATUS,
            obstacles.ObstacleStatus(
                t=now,
                source=self.source,
                free_distance=self.free_distance,
                horizon=20.0,
                ahead=7.0,
                stamp=now if self.measures and self.source is not ObstacleSource.NONE else None,
            ),
        )

    def _slow(self) -> None:
        now = self.bus.now()
        self.publish(flight.BATTERY, flight.Battery(t=now, percent=self.percent, voltage=48.0))
        if self.reports:
            self.publish(
                mapping.MAPPING_STATUS,
                mapping.MappingStatus(
                    t=now,
                    running=self.mapping,
                    diverged=self.diverged,
                    scans=3,
                    voxels=10,
                    pose_source="fake",
                    text="nothing fits any more" if self.diverged else "",
                ),
            )
            header = mapping.MapHeader(t=now, voxel_size=0.5, count=0, complete=False)
            self.publish_array(mapping.MAP, header, b"")
