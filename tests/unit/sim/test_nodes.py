"""Simulator and guidance as nodes on one bus: what they publish, answer and refuse."""

from __future__ import annotations

import math
from dataclasses import asdict
from itertools import product

import msgspec
import numpy as np
import pytest

from skillwing.onboard.guidance.node import make_guidance
from skillwing.onboard.sensor_data.names import CAMERA, GNSS
from skillwing.onboard.topics import guidance, sensors
from skillwing.onboard.topics.faults import FAULT, FAULTS, SetFault
from skillwing.onboard.topics.flight import (
    AUTOPILOT_SETPOINT,
    BATTERY,
    FLIGHT,
    PILOT,
    AutopilotSetpoint,
    FlightState,
    SetPilot,
)
from skillwing.onboard.topics.navigation import NAVIGATION, Navigation
from skillwing.onboard.topics.truth import TRUTH, Truth
from skillwing.services.bus import Answer, Answered, Bus, Refused, Sample
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.bus.reading import message_reader
from skillwing.services.options import OptionsError
from skillwing.services.protocol import CLOCK_KEY, ErrorCode, ErrorReply, Message, decode, encode
from skillwing.sim_mujoco.physics.rotor_faults import ROTOR_NAMES
from skillwing.sim_mujoco.sensors.faults import KINDS
from skillwing.sim_mujoco.sensors.table import SENSORS
from skillwing.sim_mujoco.simulator.node import make_sim
from skillwing.sim_mujoco.world.kinds import make_site


class Ground:
    """An operator's node: remembers what was published, asks and waits for the answer."""

    def __init__(self, network: InProcessNetwork) -> None:
        self.network = network
        self.bus: Bus = network.bus("ground")
        self.guidance: Bus
        self.heard: dict[str, list[Sample]] = {}
        self.bus.subscribe("fl/**", self._hear, events=True)

    def _hear(self, sample: Sample) -> None:
        self.heard.setdefault(sample.key, []).append(sample)

    def ask(self, key: str, message: Message | bytes) -> Answer:
        answers: list[Answer] = []
        self.bus.ask(key, message if isinstance(message, bytes) else encode(message), answers.append)
        self.network.run_until(lambda: bool(answers), 2.0)
        return answers[0]

    def is_refused(self, key: str, message: Message | bytes) -> ErrorReply:
        """Ask for what is refused. Returns the error of the answer."""
        answer = self.ask(key, message)
        assert isinstance(answer, Refused)
        return answer.error


FENCE = asdict(make_site(4).fence)


@pytest.fixture
def network() -> InProcessNetwork:
    return InProcessNetwork()


def make_ground(network: InProcessNetwork, *sensors: str) -> Ground:
    """The operator's node beside a drone with these sensors."""
    ground = Ground(network)
    network.attach(make_sim({"seed": 4, "sensors": sensors}))
    ground.guidance = network.attach(make_guidance({"geofence": FENCE}))
    return ground


@pytest.fixture
def ground(network: InProcessNetwork) -> Ground:
    return make_ground(network, *SENSORS)


@pytest.fixture(scope="module")
def standing() -> Ground:
    """A drone on its pad for all tests that ask for what is refused."""
    return make_ground(InProcessNetwork(), *SENSORS)


def take_off(network: InProcessNetwork, ground: Ground, height: float = 2.0, speed: float = 1.0) -> None:
    """Once its sensors have spoken the drone is told to take off."""
    network.run_for(1.5)
    up = guidance.GuidanceCommand(goal_id="up", token=1, motion=guidance.TakeOff(height=height, speed=speed))
    assert isinstance(ground.ask(guidance.GUIDANCE_COMMAND, up), Answered)


def test_every_stream_is_published_at_its_rate_and_can_be_read(network: InProcessNetwork, ground: Ground) -> None:
    network.run_for(2.05)
    counts = {key: len(samples) for key, samples in ground.heard.items()}
    assert counts[CLOCK_KEY] == pytest.approx(13, abs=1)
    assert counts[NAVIGATION] == pytest.approx(92, abs=2), "50 Hz, from the first fix on"
    assert counts[sensors.GNSS] == pytest.approx(19, abs=1)
    assert counts[sensors.IMU] == pytest.approx(102, abs=2)
    assert counts[sensors.LIDAR] == 20
    assert counts[sensors.ZED_DEPTH] == pytest.approx(30, abs=1)
    assert counts[sensors.RANGE] == pytest.approx(40, abs=1)
    assert counts[BATTERY] == 2
    assert counts[TRUTH] == pytest.approx(41, abs=1)

    scan = ground.heard[sensors.LIDAR][-1]
    lidar = decode(scan.attachment, sensors.LidarHeader)
    ranges = np.frombuffer(scan.payload, "<f4").reshape(lidar.columns, lidar.beams)
    assert lidar.t1 - lidar.t0 == pytest.approx(0.1)
    assert ranges.max() < 61.0

    picture = ground.heard[sensors.ZED_DEPTH][-1]
    camera = decode(picture.attachment, sensors.DepthHeader)
    depth = np.frombuffer(picture.payload, "<u2").reshape(camera.height, camera.width)
    # On its pad the camera stands half a metre above flat ground: the lowest row sees it about 1 m ahead.
    assert int(depth[-1, camera.width // 2]) == pytest.approx(1010, abs=150)

    inertial = ground.heard[sensors.IMU][-1]
    rows = np.frombuffer(inertial.payload, "<f4").reshape(decode(inertial.attachment, sensors.ImuHeader).count, 7)
    assert rows[:, 3].mean() == pytest.approx(9.81, abs=0.5)

    truth = decode(ground.heard[TRUTH][-1].payload, Truth)
    assert (truth.collisions, truth.inside_fence) == (0, True)


def test_a_fault_by_command_is_noticed_by_the_sensor_itself(network: InProcessNetwork, ground: Ground) -> None:
    network.run_for(1.0)
    answer = ground.ask(FAULT, SetFault(sensor="zed", kind="blackout"))
    assert isinstance(answer, Answered)
    network.run_for(1.0)
    health = [decode(s.payload, sensors.Health) for s in ground.heard[sensors.health_key("zed")]]
    assert [h.status for h in health] == [sensors.SensorStatus.OK, sensors.SensorStatus.FAILED]
    assert "no data" in health[-1].reason
    assert len({h.id for h in health}) == 2


@pytest.mark.parametrize(("sensor", "kind"), [("nose", "blackout"), ("zed", "gremlin")])
def test_an_unknown_fault_is_refused_with_the_known_names(standing: Ground, sensor: str, kind: str) -> None:
    error = standing.is_refused(FAULT, SetFault(sensor=sensor, kind=kind))
    assert error.code is ErrorCode.UNKNOWN_NAME
    assert error.known


@pytest.mark.parametrize("magnitude", [1e39, -1e39, math.inf, math.nan])
def test_a_magnitude_that_is_none_is_refused_for_every_sensor_and_kind(standing: Ground, magnitude: float) -> None:
    for sensor, kind in product((*SENSORS, CAMERA, ROTOR_NAMES[0]), (*KINDS, "weak")):
        wanted = SetFault(sensor=sensor, kind=kind, magnitude=magnitude)
        assert standing.is_refused(FAULT, msgspec.msgpack.encode(wanted)).code is ErrorCode.BAD_REQUEST


@pytest.mark.parametrize(
    ("sensor", "kind", "magnitude", "words"),
    [
        ("gnss", "dropout", 1.5, "the magnitude of dropout has to be from 0 to 1, not 1.5"),
        ("gnss", "slow", 0.5, "the magnitude of slow has to be from 1 to 1,000,000, not 0.5"),
        ("imu", "noise", -1.0, "the magnitude of noise has to be from 0 to 1,000,000, not -1"),
        ("gnss", "bias", 1e6, "the magnitude of bias has to be from -100,000 to 100,000, not 1,000,000"),
        ("gnss", "noise", 2e5, "the magnitude of noise has to be from 0 to 100,000, not 200,000"),
        ("rotor/2", "weak", 1.5, "the magnitude of weak has to be from 0 to 1, not 1.5"),
        ("rotor/2", "weak", -0.5, "the magnitude of weak has to be from 0 to 1, not -0.5"),
        ("zed", "blackout", 3.0, "blackout has no magnitude"),
        ("rotor/2", "stopped", 0.0, "stopped has no magnitude"),
    ],
)
def test_a_magnitude_that_a_kind_cannot_have_is_refused_in_words(
    standing: Ground, sensor: str, kind: str, magnitude: float, words: str
) -> None:
    error = standing.is_refused(FAULT, SetFault(sensor=sensor, kind=kind, magnitude=magnitude))
    assert (error.code, error.message) == (ErrorCode.BAD_REQUEST, words)


@pytest.mark.parametrize("sensor", SENSORS)
@pytest.mark.parametrize(("kind", "sign"), [("noise", 1.0), ("bias", 1.0), ("bias", -1.0)])
def test_the_simulator_lives_through_the_largest_magnitudes(
    network: InProcessNetwork, sensor: str, kind: str, sign: float
) -> None:
    magnitude = sign * SENSORS[sensor].largest
    ground = make_ground(network, *(SENSORS if sensor == "imu" else {sensor, "imu", "range"}))
    take_off(network, ground)
    answer = ground.ask(FAULT, SetFault(sensor=sensor, kind=kind, magnitude=magnitude))
    assert isinstance(answer, Answered)
    network.run_for(3.0)
    flight = decode(ground.heard[FLIGHT][-1].payload, FlightState)
    assert network.now() - flight.t < 0.2


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_fixes_and_navigation_with_the_largest_bias_and_noise_from_the_start_can_be_read(sign: float) -> None:
    largest = SENSORS[GNSS].largest
    faults = [
        {"sensor": GNSS, "kind": "bias", "magnitude": sign * largest},
        {"sensor": GNSS, "kind": "noise", "magnitude": largest},
    ]
    network = InProcessNetwork()
    network.attach(make_sim({"seed": 2, "sensors": ["range"], "faults": faults}))
    bus, fixes, solutions = network.bus("onlooker"), list[sensors.Gnss](), list[Navigation]()
    bus.subscribe(sensors.GNSS, lambda sample: fixes.append(decode(sample.payload, sensors.Gnss)))
    bus.subscribe(NAVIGATION, lambda sample: solutions.append(decode(sample.payload, Navigation)))
    network.run_for(3.0)
    assert len(fixes) > 20
    assert len(solutions) > 100
    assert abs(solutions[0].position[0]) > 100.0, "it began with such a fix"


@pytest.mark.parametrize("key", [FAULT, FAULTS, PILOT, guidance.GUIDANCE_COMMAND])
@pytest.mark.parametrize("payload", [b"", b"\xc1", msgspec.msgpack.encode({"v": 2, "unheard": 2})])
def test_what_cannot_be_read_is_refused_and_the_node_lives(standing: Ground, key: str, payload: bytes) -> None:
    assert standing.is_refused(key, payload).code is ErrorCode.BAD_REQUEST
    before = len(standing.heard.get(CLOCK_KEY, ()))
    assert standing.network.run_until(lambda: len(standing.heard.get(CLOCK_KEY, ())) > before, 0.5)


def test_a_flight_over_the_bus_and_the_pilot_who_ends_it(network: InProcessNetwork, ground: Ground) -> None:
    take_off(network, ground)
    network.run_for(1.5)
    flight = decode(ground.heard[FLIGHT][-1].payload, FlightState)
    assert (flight.on_ground, flight.authority) == (False, True)
    assert isinstance(ground.ask(PILOT, SetPilot(authority=False)), Answered)
    network.run_for(2.0)
    status = decode(ground.heard[guidance.GUIDANCE_STATUS][-1].payload, guidance.GuidanceStatus)
    assert (status.body.goal_id, status.body.state) == ("up", guidance.MotionState.ABORTED)
    assert "pilot" in status.body.text


def test_guidance_hears_of_a_range_finder_that_has_failed_and_comes_down_as_without_one(
    network: InProcessNetwork, ground: Ground
) -> None:
    take_off(network, ground, height=8.0, speed=2.0)
    network.run_for(8.0)
    lower = SetFault(sensor="range", kind="bias", magnitude=15.0)
    assert isinstance(ground.ask(FAULT, lower), Answered)
    network.run_for(2.0)
    health = decode(ground.heard[sensors.health_key("range")][-1].payload, sensors.Health)
    assert health.status is sensors.SensorStatus.FAILED
    down = guidance.GuidanceCommand(goal_id="down", token=2, motion=guidance.Land(speed=2.0))
    assert isinstance(ground.ask(guidance.GUIDANCE_COMMAND, down), Answered)
    network.run_for(4.0)
    navigation = decode(ground.heard[NAVIGATION][-1].payload, Navigation)
    assert navigation.velocity[2] == pytest.approx(-0.5, abs=0.2)


@pytest.mark.parametrize(("age", "rises"), [(0.3, True), (0.7, False)])
def test_a_setpoint_counts_by_its_own_time(age: float, rises: bool) -> None:
    network = InProcessNetwork()
    network.run_for(2.0)  # The robot's time began before this process.
    bus, states = network.bus("another guidance"), list[FlightState]()
    setpoints = bus.advertise(AUTOPILOT_SETPOINT)

    def answer(sample: Sample) -> None:
        t = decode(sample.payload, Navigation).t - age
        place = (0.0, 0.0, 2.0)
        up = AutopilotSetpoint(t=t, position=place, velocity=(0.0, 0.0, 0.0), heading=0.0, rotors=True)
        setpoints.put(encode(up))

    bus.subscribe(NAVIGATION, answer)
    bus.subscribe(FLIGHT, lambda sample: states.append(decode(sample.payload, FlightState)))
    network.attach(make_sim({"seed": 4, "sensors": ["range"]}))
    network.run_for(3.0)
    assert states[-1].on_ground is not rises


class Follower:
    """Looks on and answers each navigation with a setpoint: up, and from the height of 2 m on east, with 2 m/s."""

    def __init__(self, bus: Bus) -> None:
        self.truth: list[Truth] = []
        self.failsafes: set[str] = set()
        self._setpoints = bus.advertise(AUTOPILOT_SETPOINT)
        bus.subscribe(NAVIGATION, message_reader(Navigation, self._answer))
        bus.subscribe(TRUTH, message_reader(Truth, self.truth.append))
        bus.subscribe(FLIGHT, message_reader(FlightState, lambda s: self.failsafes.add(s.failsafe)))

    def _answer(self, now: Navigation) -> None:
        speed = 2.0 if now.position[2] > 2.0 else 0.0
        setpoint = AutopilotSetpoint(
            t=now.t,
            position=(now.position[0] + speed, 0.0, 3.0),
            velocity=(speed, 0.0, 0.0),
            heading=0.0,
            rotors=True,
        )
        self._setpoints.put(encode(setpoint))


def test_a_given_fence_is_the_autopilots_and_the_judges() -> None:
    network = InProcessNetwork()
    follower = Follower(network.bus("follower"))
    fence = {"low": [-5.0, -5.0, 0.6], "high": [6.0, 5.0, 9.0]}
    network.attach(make_sim({"seed": 4, "sensors": ["range"], "geofence": fence}))
    network.run_for(10.0)
    assert not follower.truth[0].inside_fence, "it stands on the ground, below that box"
    assert "east fence ahead: holding position" in follower.failsafes
    assert follower.truth[-1].inside_fence
    assert 3.0 < follower.truth[-1].position[0] < 6.0


def test_guidance_restarted_in_flight_refuses_revoked_tokens(network: InProcessNetwork, ground: Ground) -> None:
    take_off(network, ground)
    network.run_for(4.0)
    revoked = guidance.Revoked(goal_id="lost", token=2, record="r")
    ground.bus.advertise(guidance.AUTHORITY, events=True).put(encode(revoked))
    network.run_for(0.1)
    ground.guidance.close()
    network.attach(make_guidance({"geofence": FENCE}))
    network.run_for(0.2)
    late = guidance.GuidanceCommand(goal_id="lost", token=2, motion=guidance.HoldPosition())
    answer = ground.ask(guidance.GUIDANCE_COMMAND, late)
    assert isinstance(answer, Refused)
    assert answer.error.code is ErrorCode.STALE_TOKEN
    assert isinstance(
        ground.ask(guidance.GUIDANCE_COMMAND, msgspec.structs.replace(late, goal_id="next", token=3)), Answered
    )


@pytest.mark.parametrize(
    ("options", "word"),
    [
        ({"seeds": 3}, "seed"),
        ({"world": "atlantis"}, "courtyard"),
        ({"faults": [{"sensor": "nose", "kind": "blackout"}]}, "zed"),
        ({"wind": "strong"}, "wind"),
    ],
)
def test_options_that_do_not_fit_are_refused_in_words(options: dict[str, object], word: str) -> None:
    with pytest.raises(OptionsError, match=word):
        make_sim(options)
