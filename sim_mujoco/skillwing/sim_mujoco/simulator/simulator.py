"""Physics, autopilot and sensors advanced together, as one object without I/O.

The same seed, faults and setpoints give the same measurements, bit by bit.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Iterable
from dataclasses import dataclass, field
from operator import add

import numpy as np

from skillwing.sim_mujoco.camera.camera import Camera
from skillwing.sim_mujoco.camera.feed import CAMERA, CameraFeed
from skillwing.sim_mujoco.frames.motion import Motion
from skillwing.sim_mujoco.frames.vectors import Vector
from skillwing.sim_mujoco.navigation.navigator import EPOCH, Navigator, Solution
from skillwing.sim_mujoco.sensors import depth_camera, gnss, lidar
from skillwing.sim_mujoco.sensors.cadence import Cadence
from skillwing.sim_mujoco.sensors.channel import Channel, Measurement
from skillwing.sim_mujoco.sensors.corruptors import KINDS, Fault, UnknownFaultError
from skillwing.sim_mujoco.sensors.depth_camera import DepthCamera
from skillwing.sim_mujoco.sensors.gnss import Gnss, receiver_class
from skillwing.sim_mujoco.sensors.health import Change, Condition
from skillwing.sim_mujoco.sensors.health import Limits as SensorLimits
from skillwing.sim_mujoco.sensors.instruments import (
    ACCELERATION_LIMIT,
    IMU_BATCH,
    IMU_PERIOD,
    RANGE_PERIOD,
    RANGE_REACH,
    Barometer,
    Imu,
    RangeFinder,
)
from skillwing.sim_mujoco.sensors.lidar import Lidar
from skillwing.sim_mujoco.sensors.rays import RayScene
from skillwing.sim_mujoco.simulator.autopilot import Autopilot, Estimate, Limits, Setpoint
from skillwing.sim_mujoco.simulator.battery import Battery
from skillwing.sim_mujoco.simulator.clearance import Clearance
from skillwing.sim_mujoco.simulator.hexacopter import HULL_RADIUS, ROTORS
from skillwing.sim_mujoco.simulator.physics import Physics
from skillwing.sim_mujoco.simulator.rotor_faults import ROTOR_NAMES, RotorFaults, check_rotor_fault
from skillwing.sim_mujoco.simulator.wind import Gust, Wind
from skillwing.sim_mujoco.world.world import TERRAIN, World

TICK = 0.01
"""Sensors are looked after once a tick; every second tick the autopilot guides [s]."""
_STEPS = round(TICK / Physics.dt)
_IMU_STEPS = 2
_ERRORS_AT_ONCE = 25
_CLEARANCE_TICKS = 20
IDLE_THRUST = 1.0
"""Total thrust below which the rotors count as off; hovering takes more than a hundred times as much [N]."""
_HOME_FIX = 1.0
_RANGE_VALID = 0.3
GNSS = "gnss"
_CHANNELS = {
    "zed": (depth_camera.PERIOD, 0.03, SensorLimits(0.2, 20.5)),
    "lidar": (lidar.PERIOD, 0.0, SensorLimits(0.3, 60.5)),
    "imu": (IMU_BATCH, 0.0, SensorLimits(-ACCELERATION_LIMIT, ACCELERATION_LIMIT)),
    "range": (RANGE_PERIOD, 0.0, SensorLimits(0.0, RANGE_REACH + 0.5)),
    GNSS: (gnss.PERIOD, gnss.DELAY, SensorLimits(-gnss.FARTHEST, gnss.FARTHEST, zero_is_none=False)),
}
"""Period [s], delay [s] and possible values of each sensor."""
SENSORS = tuple(_CHANNELS)
_ROTOR = "rotor/"
_NO_SHARE = [0.0] * ROTORS


@dataclass(slots=True)
class Happened:
    """What came out while time advanced: measurements, navigation solutions, health changes by sensor."""

    measurements: list[Measurement] = field(default_factory=list)
    solutions: list[Solution] = field(default_factory=list)
    health: list[tuple[str, Change]] = field(default_factory=list)


class Simulator:
    """One drone, standing on the home pad of its world at time 0."""

    def __init__(
        self,
        world: World,
        *,
        faults: Iterable[Fault] = (),
        wind: Vector = (0.0, 0.0, 0.0),
        turbulence: float = 0.0,
        gusts: Iterable[Gust] = (),
        limits: Limits | None = None,
        battery_percent: float = 100.0,
        sensors: Collection[str] = SENSORS,
        receiver: str = "rtk",
    ) -> None:
        """`wind` [m/s] ENU, with `turbulence` of this strength (see `wind.Turbulence`) and `gusts`; `limits` of the
        autopilot, by default with the world's fence; `sensors` names those that are fitted, and `receiver` the class of
        the autopilot's own satellite receiver, which always is. Raises UnknownFaultError if a fault names a sensor,
        rotor or kind that does not exist, ValueError for a wind, a charge or a receiver that cannot be."""
        self.world = world
        self._physics = Physics(world)
        self._wind = Wind(self._random(6), wind, turbulence, gusts)
        self._physics.set_wind(wind)
        self._rotors = RotorFaults()
        limits = limits or Limits(fence=world.geofence)
        self.autopilot = Autopilot(self._physics.airframe, IMU_PERIOD, limits)
        self.battery = Battery(battery_percent)
        triangles = world.triangles()
        rays = RayScene(triangles)
        self.camera = CameraFeed(lambda: Camera(world, rays), self._random(30))
        self._clearance = Clearance(triangles, ignore=TERRAIN)
        self._zed = DepthCamera(rays, self._random(1))
        self._lidar = Lidar(rays, self._random(2))
        self._imu = Imu(self._random(3))
        self._range = RangeFinder(rays, self._random(4))
        self._gnss = Gnss(receiver_class(receiver), self._random(5))
        self._own_imu = Imu(self._random(8))
        self._own_errors: list[list[float]] = []
        self._barometer = Barometer(self._random(9))
        self._navigator = Navigator(receiver_class(receiver))
        self._epochs = Cadence(EPOCH)
        self._thrusts = [0.0] * ROTORS
        self._channels = {name: self._channel(name) for name in SENSORS if name in (*sensors, GNSS)}
        self._channels[GNSS].witness = self._navigate
        self._schedule = self._plan(faults)
        self._ticks = 0
        self._track = deque([self._physics.motion], maxlen=round(lidar.PERIOD / TICK) + 1)
        self._inertial: deque[tuple[float, ...]] = deque(maxlen=round(IMU_BATCH / IMU_PERIOD))
        self._ground, self._range_is_good = (0.0, 0.0), True
        self.clearance = self._distance_to_hull()

    @property
    def t(self) -> float:
        return self._ticks * TICK

    @property
    def motion(self) -> Motion:
        """True motion now: for judges and tests, not for the robot."""
        return self._physics.motion

    @property
    def rotors_on(self) -> bool:
        """Whether the rotors turn fast enough to be felt; after touchdown they take a moment to run down."""
        return self._physics.thrust > IDLE_THRUST

    @property
    def collisions(self) -> int:
        return self._physics.collisions

    @property
    def home_valid(self) -> bool:
        """The navigation system knows where it is, and has had time to fix the home point."""
        return self.t >= _HOME_FIX and self._navigator.aligned

    def place(self, position: Vector, heading: float = 0.0) -> None:
        """Put the drone at rest somewhere in the air: for tests. Time goes on."""
        self._physics.place(position, heading)
        self._navigator.place(position, heading)
        self.clearance = self._distance_to_hull()

    def command(self, setpoint: Setpoint) -> None:
        """A setpoint for the autopilot."""
        self.autopilot.command(setpoint, self.t)

    def set_fault(self, sensor: str, kind: str, on: bool, magnitude: float | None = None) -> None:
        """Switch a corruptor of a sensor, or a fault of a rotor ("rotor/2"). Raises UnknownFaultError."""
        if sensor.startswith(_ROTOR):
            self._rotors.switch(sensor, kind, on, magnitude)
            self._physics.set_rotors(self._rotors.shares)
            return
        if sensor == CAMERA:
            self.camera.corruption.switch(kind, on, magnitude)
            return
        if sensor not in self._channels:
            raise UnknownFaultError("sensor", sensor, (*self._channels, CAMERA))
        self._channels[sensor].corruption.switch(kind, on, magnitude)

    def active_faults(self, sensor: str) -> tuple[str, ...]:
        """Kinds of fault that are switched on for a sensor or a rotor."""
        if sensor in ROTOR_NAMES:
            return self._rotors.active(sensor)
        return self._channels[sensor].corruption.active

    def advance(self, until: float) -> Happened:
        """Let time pass up to `until`, in whole ticks."""
        happened = Happened()
        while self.t + TICK <= until + 1e-9:
            self._tick(happened)
        return happened

    def _tick(self, happened: Happened) -> None:
        if self._ticks % 2 == 0:
            self._guide(happened)
        self._switch_scheduled_faults()
        self._blow()
        for step in range(_STEPS):
            self._step(step)
        self._ticks += 1
        self._track.append(self._physics.motion)
        self._drain()
        self._measure()
        for channel in self._channels.values():
            arrived, changes = channel.collect(self.t)
            happened.measurements += arrived
            happened.health += [(channel.sensor, change) for change in changes]
            if channel.sensor == "range":
                self._look_down(arrived, changes)
        if self._ticks % _CLEARANCE_TICKS == 0:
            self.clearance = self._distance_to_hull()

    def _guide(self, happened: Happened) -> None:
        solution = self._navigator.solution(self.t)
        if solution is None:
            return
        happened.solutions.append(solution)
        measured_at, ground = self._ground
        known = self._range_is_good and ground > 0.0 and self.t - measured_at < _RANGE_VALID
        now = Estimate(
            solution.position,
            solution.velocity,
            solution.quaternion,
            ground if known else None,
            measured_at,
            solution.valid,
            solution.velocity_valid,
        )
        self.autopilot.battery(self.battery.percent, self.battery.voltage)
        self.autopilot.guide(self.t, now, solution.rate)

    def _look_down(self, arrived: list[Measurement], changes: list[Change]) -> None:
        """What the range-finder has measured, and whether it trusts itself."""
        if arrived:
            self._ground = arrived[-1].end, float(arrived[-1].data[0])
        if changes:
            self._range_is_good = changes[-1].condition is not Condition.FAILED

    def _blow(self) -> None:
        if not self._wind.is_steady:
            motion = self._physics.motion
            self._physics.set_wind(self._wind.advance(self.t, TICK, motion.position[2], motion.velocity))

    def _drain(self) -> None:
        self.battery.drain(self._physics.thrust, TICK)
        if self.battery.is_empty:
            self._physics.set_rotors(_NO_SHARE)

    def _step(self, step: int) -> None:
        """A step of physics; the computer's IMU samples after every other one, the autopilot's after those between."""
        self._physics.step(self._thrusts)
        if (self._ticks * _STEPS + step) % _IMU_STEPS == 0:
            self._inertial.append(self._physics.inertial)
        else:
            self._stabilise()

    def _stabilise(self) -> None:
        if not self._own_errors:
            self._own_errors = self._own_imu.errors(_ERRORS_AT_ONCE).tolist()
        x, y, z, p, q, r = map(add, self._physics.inertial, self._own_errors.pop())
        self._navigator.inertial((x, y, z), (p, q, r))
        self._thrusts = self.autopilot.stabilise(*self._navigator.attitude)

    def _navigate(self, t: float, fix: Measurement) -> str | None:
        """Give navigation a fix; what it has to say against the receiver."""
        usable = self._channels[GNSS].condition is not Condition.FAILED
        return self._navigator.fix(t, fix.end, fix.data, usable=usable)

    def _measure(self) -> None:
        t, motion = self.t, self._track[-1]
        if self._epochs.due(t):
            self._navigator.epoch(t, self._barometer.measure(motion, EPOCH), standing=not self.rotors_on)
        for name, channel in self._channels.items():
            if not channel.due(t):
                continue
            if name == "lidar":
                channel.deliver(self._track[0].t, t, self._lidar.scan(self._track, self._track[0].t, t))
            elif name == "zed":
                channel.deliver(t, t, self._zed.picture(motion))
            elif name == "imu":
                channel.deliver(t - IMU_BATCH, t, self._imu.measure(np.array(self._inertial)))
            elif name == GNSS:
                channel.deliver(t, t, self._gnss.measure(motion))
            else:
                channel.deliver(t, t, self._range.measure(motion))

    def _switch_scheduled_faults(self) -> None:
        while self._schedule and self._schedule[0][0] <= self.t + 1e-9:
            _, on, fault = self._schedule.pop(0)
            self.set_fault(fault.sensor, fault.kind, on, fault.magnitude)

    @staticmethod
    def _plan(faults: Iterable[Fault]) -> list[tuple[float, bool, Fault]]:
        plan: list[tuple[float, bool, Fault]] = []
        for fault in faults:
            if fault.sensor.startswith(_ROTOR):
                check_rotor_fault(fault.sensor, fault.kind)
            elif fault.sensor not in (*SENSORS, CAMERA):
                raise UnknownFaultError("sensor", fault.sensor, (*SENSORS, CAMERA))
            elif fault.kind not in KINDS:
                raise UnknownFaultError("kind of fault", fault.kind, KINDS)
            plan.append((fault.at, True, fault))
            if fault.duration is not None:
                plan.append((fault.at + fault.duration, False, fault))
        return sorted(plan, key=lambda event: event[0])

    def _distance_to_hull(self) -> float:
        return self._clearance.distance(self._physics.motion.position) - HULL_RADIUS

    def _channel(self, name: str) -> Channel:
        period, delay, limits = _CHANNELS[name]
        return Channel(name, period, delay, limits, self._random(10 + SENSORS.index(name)))

    def _random(self, stream: int) -> np.random.Generator:
        return np.random.default_rng((self.world.seed, 1000 + stream))
