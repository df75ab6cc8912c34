"""The simulator as a process: it owns robot time, publishes measurements, and takes setpoints and faults."""

from __future__ import annotations

from typing import Any

from skillwing.onboard.commands.service import CommandRefusedError, answer_with, reply_with
from skillwing.onboard.frames.vectors import heading_of, to_body
from skillwing.onboard.topics import common, flight, navigation, odometry, video
from skillwing.onboard.topics.faults import FAULT, FAULTS, Faults, FaultState, SetFault, fault_id
from skillwing.onboard.topics.sensors import Health, SensorStatus, health_key
from skillwing.onboard.topics.truth import TRUTH, Truth
from skillwing.services.bus import Bus, Publisher
from skillwing.services.bus.clock import TickRule
from skillwing.services.bus.reading import message_reader
from skillwing.services.options import OptionsError
from skillwing.services.protocol import CLOCK_KEY, ClockTick, ErrorCode, Message, encode
from skillwing.sim_mujoco.autopilot.autopilot import Setpoint
from skillwing.sim_mujoco.camera.camera import camera_header
from skillwing.sim_mujoco.navigation.navigator import Solution
from skillwing.sim_mujoco.navigation.odometry_aid import OdometryReport
from skillwing.sim_mujoco.sensors.channel import Cadence, Measurement
from skillwing.sim_mujoco.sensors.faults import MagnitudeError, UnknownFaultError
from skillwing.sim_mujoco.sensors.health import ConditionChange
from skillwing.sim_mujoco.sensors.table import SENSORS
from skillwing.sim_mujoco.simulator.lockstep import Output
from skillwing.sim_mujoco.simulator.options import read_sim_options
from skillwing.sim_mujoco.simulator.simulator import Simulator
from skillwing.sim_mujoco.simulator.warm_up import compile_loops

SLICE = 0.02
"""Step of robot time by which the simulator advances [s]."""


class SimNode:
    """Shell around a `Simulator`. `factor` is the announced speed of the clock; the bus keeps it."""

    name = "sim"
    owns_clock = True

    def __init__(self, simulator: Simulator, factor: float = 1.0) -> None:
        self._sim = simulator
        self._factor = factor
        self._tick_rule = TickRule(factor)
        self._epoch = 0.0
        self._flight: flight.FlightState | None = None
        self._flight_cadence, self._truth_cadence = Cadence(0.1), Cadence(0.05)
        self._battery_cadence = Cadence(1.0)
        self._health_count = 0
        self._out: dict[str, Publisher] = {}

    def attach(self, bus: Bus) -> None:
        self.join(bus)
        bus.every(SLICE, self._advance)

    def join(self, bus: Bus) -> None:
        """Attach the node without a timer: a simulator with several drones calls `publish` after each advance."""
        self._bus = bus
        self._epoch = bus.now()
        streams = (CLOCK_KEY, navigation.NAVIGATION, flight.BATTERY, video.CAMERA, TRUTH, flight.FLIGHT)
        for key in (*streams, *(spec.topic for spec in SENSORS.values())):
            self._out[key] = bus.advertise(key)
        for key in map(health_key, SENSORS):
            self._out[key] = bus.advertise(key, events=True)
        # An unreadable setpoint is ignored; without any other setpoint the failsafe acts.
        setpoints = message_reader(flight.AutopilotSetpoint, self._on_setpoint)
        bus.subscribe(flight.AUTOPILOT_SETPOINT, setpoints, latest_only=True)
        bus.subscribe(odometry.SLAM_ODOMETRY, message_reader(odometry.Odometry, self._on_odometry))
        bus.serve(FAULT, answer_with(SetFault, self._set_fault))
        bus.serve(video.CAMERA_COMMAND, answer_with(video.ControlCamera, self._control_camera))
        bus.serve(FAULTS, reply_with(common.Empty, self._faults))
        bus.serve(flight.PILOT, answer_with(flight.SetPilot, self._set_pilot))

    def detach(self) -> None:
        """Do nothing: no state outlives this process."""

    # --- time ------------------------------------------------------------------------------------------------

    def _advance(self) -> None:
        self.publish(self._sim.advance(self._sim.t + SLICE))

    def publish(self, happened: Output) -> None:
        """Publish the time, and the output of an advance to it."""
        t = self._sim.t
        if self._tick_rule.due(t, self._bus.wall()):
            self._put(CLOCK_KEY, ClockTick(t=self._epoch + t, factor=self._factor))
        for sensor, change in happened.health:
            self._publish_health(sensor, change)
        for measurement in happened.measurements:
            self._publish_measurement(measurement)
        self._publish_picture(t)
        self._publish_flight(t)
        if self._battery_cadence.due(t):
            battery = self._sim.battery
            self._put(
                flight.BATTERY,
                flight.Battery(t=self._epoch + t, percent=battery.percent, voltage=battery.voltage),
            )
        if self._truth_cadence.due(t):
            self._publish_truth(t)
        # Guidance answers navigation with a setpoint, so navigation comes last: guidance then has all other data.
        for solution in happened.solutions:
            self._publish_navigation(solution)
        if self._factor <= 0.0:
            self._put(CLOCK_KEY, ClockTick(t=self._epoch + t, factor=self._factor, complete=True))

    def _publish_navigation(self, solution: Solution) -> None:
        self._put(
            navigation.NAVIGATION,
            navigation.Navigation(
                t=self._epoch + solution.t,
                position=solution.position,
                velocity=solution.velocity,
                quaternion=solution.quaternion,
                angular_velocity=solution.rate,
                heading=heading_of(solution.quaternion),
                valid=solution.valid,
                sigma=solution.sigma,
                height_sigma=solution.height_sigma,
            ),
        )

    def _publish_measurement(self, measurement: Measurement) -> None:
        spec = SENSORS[measurement.sensor]
        start, end = self._epoch + measurement.start, self._epoch + measurement.end
        self._out[spec.topic].put(*spec.message(start, end, measurement.data))

    def _publish_picture(self, t: float) -> None:
        shot = self._sim.camera.take(t, self._sim.motion)
        if shot is not None:
            header = camera_header(self._epoch + shot.t, shot.tilt)
            self._out[video.CAMERA].put(shot.picture.tobytes(), encode(header))

    def _publish_health(self, sensor: str, change: ConditionChange) -> None:
        self._health_count += 1
        active = self._sim.active_faults(sensor)
        health = Health(
            id=f"{self.name}/health-{self._health_count}",
            t=self._epoch + change.t,
            sensor=sensor,
            status=SensorStatus(change.condition.value),
            reason=change.reason,
            cause=self._fault_id(sensor, active[0]) if active else None,
        )
        self._put(health_key(sensor), health)

    def _fault_id(self, sensor: str, kind: str) -> str:
        return fault_id(sensor, kind, self._epoch + self._sim.fault_since(sensor, kind))

    def _publish_flight(self, t: float) -> None:
        autopilot = self._sim.autopilot
        state = flight.FlightState(
            t=self._epoch + t,
            on_ground=autopilot.on_ground,
            rotors_on=self._sim.rotors_on,
            home_valid=self._sim.home_valid,
            authority=autopilot.authority,
            failsafe=autopilot.failsafe,
            follows=autopilot.follows,
            holds_heading=autopilot.holds_heading,
            home=self._sim.home,
        )
        due = self._flight_cadence.due(t)
        if due or self._flight is None or _differs(state, self._flight):
            self._put(flight.FLIGHT, state)
        self._flight = state

    def _publish_truth(self, t: float) -> None:
        motion = self._sim.motion
        truth = Truth(
            t=self._epoch + t,
            position=motion.position,
            quaternion=motion.quaternion,
            velocity=motion.velocity,
            collisions=self._sim.collisions,
            clearance=self._sim.clearance,
            inside_fence=self._sim.world.geofence.contains(motion.position),
            separation=self._sim.separation,
        )
        self._put(TRUTH, truth)

    def _put(self, key: str, message: Message) -> None:
        self._out[key].put(encode(message))

    # --- commands --------------------------------------------------------------------------------------------

    def _on_setpoint(self, wanted: flight.AutopilotSetpoint) -> None:
        setpoint = Setpoint(wanted.position, wanted.velocity, wanted.heading, wanted.rotors, wanted.acceleration)
        self._sim.command(setpoint, wanted.t - self._epoch)

    def _on_odometry(self, message: odometry.Odometry) -> None:
        self._sim.odometry(odometry_report(message, self._epoch))

    def _set_fault(self, wanted: SetFault) -> str:
        try:
            self._sim.set_fault(wanted.sensor, wanted.kind, wanted.on, wanted.magnitude)
        except UnknownFaultError as error:
            raise CommandRefusedError(ErrorCode.UNKNOWN_NAME, str(error), "choose a known name", error.known) from error
        except MagnitudeError as error:
            raise CommandRefusedError(ErrorCode.BAD_REQUEST, str(error), error.advice) from error
        return f"{wanted.kind} of {wanted.sensor} is {'on' if wanted.on else 'off'}"

    def _control_camera(self, wanted: video.ControlCamera) -> str:
        self._sim.camera.request(self._sim.t, wanted.fps, wanted.seconds, wanted.tilt)
        return f"pictures for {wanted.seconds:g} s"

    def _faults(self, _: common.Empty) -> Faults:
        return Faults(
            of=tuple(
                FaultState(name=name, kinds=kinds, active=self._sim.active_faults(name), status=self._status(name))
                for name, kinds in self._sim.fallible.items()
            )
        )

    def _status(self, name: str) -> SensorStatus | None:
        condition = self._sim.condition(name)
        return None if condition is None else SensorStatus(condition.value)

    def _set_pilot(self, wanted: flight.SetPilot) -> str:
        self._sim.autopilot.authority = wanted.authority
        return "the computer has the authority" if wanted.authority else "the safety pilot has the authority"


def odometry_report(message: odometry.Odometry, epoch: float = 0.0) -> OdometryReport:
    """A report for navigation from odometry's message, with times since `epoch`."""
    return OdometryReport(
        message.t - epoch,
        message.since - epoch,
        to_body(message.quaternion, message.velocity),
        message.tracking is odometry.Tracking.GOOD,
    )


def _differs(one: flight.FlightState, other: flight.FlightState) -> bool:
    """True if the states differ in a field other than the time."""
    names = ("on_ground", "rotors_on", "home_valid", "authority", "failsafe", "follows", "holds_heading")
    return any(getattr(one, name) != getattr(other, name) for name in names)


def make_sim(options: dict[str, Any]) -> SimNode:
    """The simulator node. Raises OptionsError."""
    wanted = read_sim_options(options)
    try:
        world = wanted.make_world()
        simulator = Simulator(world, **wanted.of_drone(world))
    except ValueError as error:
        raise OptionsError(str(error)) from error
    simulator.autopilot.authority = wanted.authority
    compile_loops()
    return SimNode(simulator, wanted.factor)
