"""A functional layer without physics: the peer of the managers and the bridge at the protocol's edge.

It flies in straight lines, brakes in half a second, and does what a test's switches tell it to do wrong.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from skillwing.services.bus import Bus, Publisher, Request, Sample
from skillwing.services.protocol import ErrorCode, ErrorReply, Message, decode, encode
from skillwing.sim_mujoco import topics
from skillwing.sim_mujoco.topics import (
    AxisStatus,
    ControlMapping,
    Done,
    FlyTo,
    GuidanceCommand,
    GuidanceStatus,
    Hold,
    Land,
    Motion,
    MotionState,
    ObstacleSource,
    Revoked,
    SelectObstacleSource,
    SetFault,
    Stop,
    TakeOff,
    Turn,
    Vector3,
)

PERIOD = 0.05
BRAKING = 0.5


@dataclass
class Holder:
    """One axis of the fake guidance."""

    goal_id: str | None = None
    token: int = -1
    motion: Motion | None = None
    state: MotionState = MotionState.IDLE
    remaining: float = 0.0
    stopped_at: float = 0.0

    @property
    def status(self) -> AxisStatus:
        return AxisStatus(goal_id=self.goal_id, state=self.state, remaining=self.remaining)


class FakeLayer:
    """Guidance, obstacle node, mapping node and telemetry in one node. The attributes are a test's switches."""

    name = "functional_layer"
    owns_clock = False

    def __init__(self) -> None:
        self.position: Vector3 = (0.0, 0.0, 0.0)
        self.heading = 0.0
        self.on_ground = True
        self.authority = True
        self.rotors_run_on = False
        self.percent = 100.0
        self.drift = 0.0
        self.stuck = False
        self.blocked_at: float | None = None
        self.free_distance: float | None = None
        self.aborts = False
        self.refusal: str | None = None
        self.deaf = 0
        self.reports = True
        self.measures = True
        self.diverged = False
        self.source = ObstacleSource.NONE
        self.mapping = False
        self.commands: list[GuidanceCommand] = []
        self.revoked: list[Revoked] = []
        self.faults: list[SetFault] = []
        self.body = Holder()
        self.nose = Holder()
        self._out: dict[str, Publisher] = {}

    def attach(self, bus: Bus) -> None:
        self._bus = bus
        for key in (
            topics.GUIDANCE_STATUS,
            topics.NAVIGATION,
            topics.FLIGHT,
            topics.BATTERY,
            topics.OBSTACLE_STATUS,
            topics.MAPPING_STATUS,
            topics.MAP,
        ):
            self._out[key] = bus.advertise(key)
        self._health = {name: bus.advertise(topics.health_key(name), events=True) for name in ("zed", "lidar")}
        bus.serve(topics.GUIDANCE_COMMAND, lambda request: self._take(request, self._command))
        bus.serve(topics.OBSTACLE_COMMAND, lambda request: self._take(request, self._select))
        bus.serve(topics.MAPPING_COMMAND, lambda request: self._take(request, self._control))
        bus.serve(topics.FAULT, lambda request: self._take(request, self._fault))
        bus.subscribe(topics.AUTHORITY, self._on_revoked, events=True)
        bus.every(PERIOD, self._tick)
        bus.every(0.1, self._sense)
        bus.every(1.0, self._slow)

    def detach(self) -> None:
        pass

    def report_health(self, sensor: str, status: topics.SensorStatus, health_id: str, cause: str | None = None) -> None:
        message = topics.Health(id=health_id, t=self._bus.now(), sensor=sensor, status=status, cause=cause)
        self._health[sensor].put(encode(message))

    def fly_at(self, height: float) -> None:
        """Be in the air already."""
        self.position, self.on_ground = (0.0, 0.0, height), False

    # --- commands ----------------------------------------------------------------------------------------------------

    def _take(self, request: Request, act: Callable[[bytes], None]) -> None:
        if self.deaf > 0:
            self.deaf -= 1
            return
        if self.refusal is not None:
            request.refuse(ErrorReply(code=ErrorCode.NOT_ALLOWED, message=self.refusal, help="stay inside"))
            return
        act(request.payload)
        request.reply(encode(Done()))

    def _command(self, payload: bytes) -> None:
        command = decode(payload, GuidanceCommand)
        self.commands.append(command)
        if isinstance(command.motion, Stop):
            for axis in (self.body, self.nose):
                if axis.goal_id == command.goal_id:
                    axis.state, axis.stopped_at = MotionState.STOPPING, self._bus.now() + BRAKING
            return
        axis = self.nose if isinstance(command.motion, Turn) else self.body
        axis.goal_id, axis.token, axis.motion = command.goal_id, command.token, command.motion
        axis.state = MotionState.MOVING

    def _select(self, payload: bytes) -> None:
        self.source = decode(payload, SelectObstacleSource).source

    def _control(self, payload: bytes) -> None:
        self.mapping = decode(payload, ControlMapping).run

    def _fault(self, payload: bytes) -> None:
        self.faults.append(decode(payload, SetFault))

    def _on_revoked(self, sample: Sample) -> None:
        self.revoked.append(decode(sample.payload, Revoked))

    # --- motion ------------------------------------------------------------------------------------------------------

    def _tick(self) -> None:
        for axis in (self.body, self.nose):
            if axis.state is MotionState.STOPPING and self._bus.now() >= axis.stopped_at:
                axis.state = MotionState.STOPPED
        if self.body.state is MotionState.MOVING:
            self._move(self.body)
        if self.nose.state is MotionState.MOVING and isinstance(self.nose.motion, Turn):
            self._turn(self.nose.motion)
        if self.reports:
            self._put(
                topics.GUIDANCE_STATUS,
                GuidanceStatus(
                    t=self._bus.now(),
                    body=self.body.status,
                    heading=self.nose.status,
                    setpoint=self.position,
                    target=None,
                    free_distance=self.free_distance,
                ),
            )

    def _move(self, axis: Holder) -> None:
        motion = axis.motion
        x, y, _ = self.position
        if self.aborts:
            axis.state = MotionState.ABORTED
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
            case Hold():
                axis.state = MotionState.DONE
            case _:
                pass

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
        now = self._bus.now()
        self._put(
            topics.NAVIGATION,
            topics.Navigation(
                t=now,
                position=self.position,
                velocity=(0.0, 0.0, 0.0),
                quaternion=(1.0, 0.0, 0.0, 0.0),
                angular_velocity=(0.0, 0.0, 0.0),
                heading=self.heading,
            ),
        )
        self._put(
            topics.FLIGHT,
            topics.FlightState(
                t=now,
                on_ground=self.on_ground,
                rotors_on=self.rotors_run_on or not self.on_ground,
                home_valid=True,
                authority=self.authority,
            ),
        )
        self._put(
            topics.OBSTACLE_STATUS,
            topics.ObstacleStatus(
                t=now,
                source=self.source,
                free_distance=self.free_distance,
                horizon=20.0,
                ahead=7.0,
                stamp=now if self.measures and self.source is not ObstacleSource.NONE else None,
            ),
        )

    def _slow(self) -> None:
        now = self._bus.now()
        self._put(topics.BATTERY, topics.Battery(t=now, percent=self.percent, voltage=48.0))
        if self.reports:
            self._put(
                topics.MAPPING_STATUS,
                topics.MappingStatus(
                    t=now, running=self.mapping, diverged=self.diverged, scans=3, voxels=10, pose_source="fake"
                ),
            )
            header = topics.MapHeader(t=now, voxel_size=0.5, count=0, complete=False)
            self._out[topics.MAP].put(b"", encode(header))

    def _put(self, key: str, message: Message) -> None:
        self._out[key].put(encode(message))
