"""Physics, autopilot and sensors advanced together, as one object without I/O.

The same seed, faults and setpoints give the same measurements, bit by bit.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Iterable
from operator import add

import numpy as np

from skillwing.onboard.frames.extent import TIP_RADIUS
from skillwing.onboard.frames.vectors import Motion, Vector
from skillwing.onboard.sensor_data.names import CAMERA, GNSS, RANGE
from skillwing.sim_mujoco.autopilot.autopilot import Autopilot, Estimate, FailsafeLimits, Setpoint
from skillwing.sim_mujoco.autopilot.descent import STANDING_RANGE
from skillwing.sim_mujoco.camera.camera import Camera
from skillwing.sim_mujoco.camera.feed import CameraFeed
from skillwing.sim_mujoco.navigation.navigator import EPOCH, Navigator
from skillwing.sim_mujoco.navigation.odometry_aid import OdometryReport
from skillwing.sim_mujoco.physics.battery import PACKS, BatteryModel
from skillwing.sim_mujoco.physics.clearance import Clearance
from skillwing.sim_mujoco.physics.physics import Physics
from skillwing.sim_mujoco.physics.rotor_faults import ROTOR, ROTOR_FAULTS, ROTOR_NAMES, ROTORS, RotorFaults
from skillwing.sim_mujoco.physics.wind import Gust, Wind
from skillwing.sim_mujoco.scenario.fault_checks import check_fault
from skillwing.sim_mujoco.sensors.channel import Cadence
from skillwing.sim_mujoco.sensors.cross_checks import CrossChecks
from skillwing.sim_mujoco.sensors.faults import KINDS, Fault, FaultSchedule, UnknownFaultError
from skillwing.sim_mujoco.sensors.health import SensorCondition
from skillwing.sim_mujoco.sensors.instruments import IMU_BATCH, IMU_PERIOD, Barometer, Imu
from skillwing.sim_mujoco.sensors.receivers import receiver_class
from skillwing.sim_mujoco.sensors.table import SENSORS, Moment, Surroundings
from skillwing.sim_mujoco.simulator.lockstep import STEPS, TICK, Output, advance_together
from skillwing.sim_mujoco.world.rays import RayScene
from skillwing.sim_mujoco.world.vehicle_rays import VehicleRays
from skillwing.sim_mujoco.world.world import TERRAIN, World

_IMU_STEPS = 2
_ERRORS_AT_ONCE = 25
IDLE_THRUST = 1.0
"""Total thrust below which the rotors count as off; hovering takes a hundred times as much [N]."""
_HOME_FIX = 1.0
_RANGE_VALID = 0.3
_NO_SHARE = [0.0] * ROTORS
_TRACK = 0.1
"""Length of the past motion that sensors can see: a revolution of the LiDAR [s]."""


class Simulator:
    """One drone, which stands at its home at time 0: on the pad of its world, or beside it in a `Fleet`."""

    def __init__(
        self,
        world: World,
        *,
        faults: Iterable[Fault] = (),
        pilot: Iterable[tuple[float, bool]] = (),
        wind: Vector = (0.0, 0.0, 0.0),
        turbulence: float = 0.0,
        gusts: Iterable[Gust] = (),
        limits: FailsafeLimits | None = None,
        battery_percent: float = 100.0,
        packs_fail: Iterable[tuple[float, int]] = (),
        sensors: Collection[str] = SENSORS,
        receiver: str = "rtk",
        physics: Physics | None = None,
        rays: RayScene | None = None,
    ) -> None:
        """A drone at rest.

        pilot: times at which the safety pilot gives the authority (True) or takes it. wind: mean wind [m/s] ENU, with
        `turbulence` of this strength (see `wind.Turbulence`) and `gusts`. limits: of the autopilot, by default with the
        world's fence. packs_fail: times at which so many packs of the battery fail. sensors: names of the fitted ones.
        receiver: class of the autopilot's own satellite receiver, which is always fitted. physics, rays: those of a
        drone that shares its world, and of that world; by default it is alone.

        Raises UnknownFaultError for an unknown sensor, rotor or kind of fault. Raises ValueError for an impossible
        wind, charge or receiver, and for a battery without any pack left.
        """
        self.world = world
        self._physics = physics or Physics(world)
        self.home = self._physics.motion.position[:2]
        """Place of the drone at time 0 [m]."""
        self._wind = Wind(self._random(6), wind, turbulence, gusts)
        self._physics.set_wind(wind)
        self._rotors = RotorFaults()
        self._fault_since: dict[tuple[str, str], float] = {}
        limits = limits or FailsafeLimits(fence=world.geofence)
        self.autopilot = Autopilot(self._physics.airframe, IMU_PERIOD, limits)
        self.battery = BatteryModel(battery_percent)
        triangles = world.triangles()
        rays = rays or RayScene(triangles)
        if self._physics.others():
            rays = VehicleRays(rays, self._physics.others)
        self.camera = CameraFeed(lambda: Camera(world, rays), self._random(30))
        self._clearance = Clearance(triangles, ignore=TERRAIN)
        self._own_imu = Imu(self._random(8))
        self._own_errors: list[list[float]] = []
        self._barometer = Barometer(self._random(9))
        self._navigator = Navigator(receiver_class(receiver))
        self._epochs = Cadence(EPOCH)
        self._thrusts = [0.0] * ROTORS
        self._checks = CrossChecks(STANDING_RANGE, self._navigator)
        if unknown := [name for name in sensors if name not in SENSORS]:
            raise UnknownFaultError("sensor", unknown[0], tuple(SENSORS))
        rows = [(row, spec) for row, spec in enumerate(SENSORS.values()) if spec.name in (*sensors, GNSS)]
        surroundings = Surroundings(rays, receiver_class(receiver))
        self._instruments = {
            spec.name: spec.make(surroundings, self._random(_instrument_stream(row))) for row, spec in rows
        }
        self._channels = {spec.name: spec.channel(self._random(10 + row), self._checks) for row, spec in rows}
        self._corruptions = {name: channel.corruption for name, channel in self._channels.items()}
        self._corruptions[CAMERA] = self.camera.corruption
        faults = tuple(faults)
        for fault in faults:
            check_fault(fault.sensor, fault.kind, fault.magnitude)
        self._plan = FaultSchedule(faults)
        self._pilot = sorted(pilot)
        self._packs_fail = sorted(packs_fail)
        if sum(packs for _, packs in self._packs_fail) >= PACKS:
            raise ValueError(f"not all packs of a battery can fail; one of {PACKS} has to be left")
        self._ticks = 0
        self._track = deque([self._physics.motion], maxlen=round(_TRACK / TICK) + 1)
        self._inertial: deque[tuple[float, ...]] = deque(maxlen=round(IMU_BATCH / IMU_PERIOD))
        self._ground = 0.0, 0.0

    @property
    def t(self) -> float:
        return self._ticks * TICK

    @property
    def motion(self) -> Motion:
        """True motion now: for the ground truth and tests, not for the robot."""
        return self._physics.motion

    @property
    def rotors_on(self) -> bool:
        """The rotors give thrust; after touchdown they take a moment to run down."""
        return self._physics.thrust > IDLE_THRUST

    @property
    def collisions(self) -> int:
        return self._physics.collisions

    @property
    def clearance(self) -> float:
        """Distance from the nearest obstacle, except the ground, to a sphere round the drone and its blades' tips [m].

        It is exact for obstacles beside the drone; above and below there is more room.
        """
        return self._clearance.distance(self._physics.motion.position) - TIP_RADIUS

    @property
    def separation(self) -> float | None:
        """Distance between the spheres round this and the nearest other drone [m]; None for a lone drone."""
        return self._physics.separation

    @property
    def home_valid(self) -> bool:
        """Navigation is aligned, and has had time to fix the home point."""
        return self.t >= _HOME_FIX and self._navigator.aligned

    def place(self, position: Vector, heading: float = 0.0) -> None:
        """Put the drone at rest somewhere in the air: for tests. Time goes on."""
        self._physics.place(position, heading)
        self._navigator.place(position, heading)

    def command(self, setpoint: Setpoint, of: float | None = None) -> None:
        """Give the autopilot a setpoint, made at `of` in this simulator's time, by default now."""
        self.autopilot.command(setpoint, self.t, of)

    def odometry(self, report: OdometryReport) -> None:
        """Give navigation a report of odometry, with times of this simulator."""
        self._navigator.odometry(report)

    def set_fault(self, sensor: str, kind: str, on: bool, magnitude: float | None = None) -> None:
        """Switch a fault of a sensor or of a rotor ("rotor/2"). Raises UnknownFaultError and MagnitudeError."""
        if sensor.startswith(ROTOR):
            self._rotors.switch(sensor, kind, on, magnitude)
            self._physics.set_rotors(self._rotors.shares)
            return
        corruption = self._corruptions.get(sensor)
        if corruption is None:
            raise UnknownFaultError("sensor", sensor, tuple(self._corruptions))
        corruption.switch(kind, on, magnitude)
        if on:
            self._fault_since.setdefault((sensor, kind), self.t)
        else:
            self._fault_since.pop((sensor, kind), None)

    def fault_since(self, sensor: str, kind: str) -> float:
        """Time at which a fault of a sensor was switched on."""
        return self._fault_since[sensor, kind]

    def active_faults(self, sensor: str) -> tuple[str, ...]:
        """Kinds of fault that are switched on for a sensor or a rotor."""
        if sensor in ROTOR_NAMES:
            return self._rotors.active(sensor)
        return self._corruptions[sensor].active

    def condition(self, name: str) -> SensorCondition | None:
        """Condition of a sensor; None for a rotor and for the camera, which have no self-diagnosis."""
        return self._channels[name].condition if name in self._channels else None

    @property
    def fallible(self) -> dict[str, tuple[str, ...]]:
        """Sensors and rotors that can fail, with their kinds of fault."""
        return dict.fromkeys(self._corruptions, tuple(KINDS)) | dict.fromkeys(ROTOR_NAMES, ROTOR_FAULTS)

    def advance(self, until: float) -> Output:
        """Advance a lone drone to `until`, in whole ticks."""
        return advance_together((self,), self._physics.dynamics, until)[0]

    def begin_tick(self, output: Output) -> None:
        """Guide, and apply what the tick begins with: faults, the pilot and the wind."""
        if self._ticks % 2 == 0:
            self._guide(output)
        self._follow_plan()
        self._update_wind()

    def begin_step(self) -> None:
        """Command the rotors for a step of physics."""
        self._physics.actuate(self._thrusts)

    def end_step(self, step: int) -> None:
        """Check contacts after a step. The two IMUs, the computer's and the autopilot's, sample in alternate steps."""
        self._physics.check_contacts()
        steps = self._ticks * STEPS + step
        if steps % _IMU_STEPS == 0:
            self._inertial.append(self._physics.inertial)
        else:
            self._stabilise((steps + 1) * Physics.dt)

    def end_tick(self, output: Output) -> None:
        """Measure, and collect what has arrived."""
        self._ticks += 1
        self._track.append(self._physics.motion)
        self._drain()
        self._measure()
        for channel in self._channels.values():
            arrived, changes = channel.collect(self.t)
            output.measurements += arrived
            output.health += [(channel.sensor, change) for change in changes]
            if channel.sensor == RANGE and arrived:
                self._ground = arrived[-1].end, float(arrived[-1].data[0])

    def _guide(self, output: Output) -> None:
        solution = self._navigator.solution(self.t)
        if solution is None:
            return
        output.solutions.append(solution)
        measured_at, ground = self._ground
        failed = self.condition(RANGE) is SensorCondition.FAILED
        known = not failed and ground > 0.0 and self.t - measured_at < _RANGE_VALID
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

    def _update_wind(self) -> None:
        if not self._wind.is_steady:
            motion = self._physics.motion
            self._physics.set_wind(self._wind.advance(self.t, TICK, motion.position[2], motion.velocity))

    def _drain(self) -> None:
        self.battery.drain(self._physics.thrust, TICK)
        if self.battery.is_empty:
            self._physics.set_rotors(_NO_SHARE)

    def _stabilise(self, t: float) -> None:
        if not self._own_errors:
            self._own_errors = self._own_imu.errors(_ERRORS_AT_ONCE).tolist()
        sample = x, y, z, p, q, r = tuple(map(add, self._physics.inertial, self._own_errors.pop()))
        self._checks.autopilot_imu(t, sample)
        self._navigator.inertial((x, y, z), (p, q, r))
        self._thrusts = self.autopilot.stabilise(*self._navigator.attitude)

    def _measure(self) -> None:
        t, motion = self.t, self._track[-1]
        if self._epochs.due(t):
            self._checks.standing = not self.rotors_on
            self._navigator.epoch(t, self._barometer.measure(motion, EPOCH), standing=self._checks.standing)
        moment = Moment(t, self._track, self._inertial)
        for name, channel in self._channels.items():
            if channel.due(t):
                spec = SENSORS[name]
                channel.deliver(spec.start(moment), t, spec.measure(self._instruments[name], moment))

    def _follow_plan(self) -> None:
        if not self._plan.is_empty:
            for fault, on in self._plan.switches(self.t, self._physics.motion.position):
                self.set_fault(fault.sensor, fault.kind, on, fault.magnitude)
        while self._pilot and self._pilot[0][0] <= self.t + 1e-9:
            _, self.autopilot.authority = self._pilot.pop(0)
        while self._packs_fail and self._packs_fail[0][0] <= self.t + 1e-9:
            self.battery.fail(self._packs_fail.pop(0)[1])

    def _random(self, stream: int) -> np.random.Generator:
        number = self._physics.number
        return np.random.default_rng((self.world.seed, 1000 + stream, *((number,) if number else ())))


def _instrument_stream(row: int) -> int:
    """Random stream of the instrument of a row. Streams 6 to 99 have other users."""
    return 1 + row if row < 5 else 95 + row
