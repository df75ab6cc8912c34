"""Point drone in the simulator's place: managers, bridge and guidance work with it unchanged."""

from __future__ import annotations

import math
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from observed_network import ObservedNetwork

from skill_needs import seen, told
from skillwing.m600.robot import ROBOT as M600
from skillwing.onboard.interface.table import TOPICS
from skillwing.onboard.topics.common import Vector3
from skillwing.onboard.topics.flight import AUTOPILOT_SETPOINT, FLIGHT, PILOT, AutopilotSetpoint, FlightState, SetPilot
from skillwing.onboard.topics.navigation import NAVIGATION, Navigation
from skillwing.services.bus import RunnableBus
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.bus.reading import message_reader
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.client.goal_handle import GoalHandle
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.names import DATA_MANAGER, RESOURCE_MANAGER, skill_process
from skillwing.services.processes.in_process import RobotInProcess
from skillwing.services.processes.launcher import Launcher
from skillwing.services.protocol import Terminal, encode
from skillwing.services.robot import ProcessSpec, Robot, find_robot

FOLDER = Path(__file__).parents[2] / "examples" / "point_drone"
with pytest.MonkeyPatch.context() as patch:
    # The path is restored: other tests make robots with the names of folders beside this one.
    patch.setattr(sys, "path", list(sys.path))
    patch.setenv("PYTHONPATH", "")
    TABLE: Robot = find_robot(str(FOLDER))
SKILLSET = TABLE.load_skillset()
FAR = {"x": 20.0, "y": 0.0, "z": 3.0}
PATIENCE = 60.0
(SETPOINTS,) = (topic for topic in TOPICS if topic.key == AUTOPILOT_SETPOINT)


class Client:
    """A pilot and observer of the drone."""

    def __init__(self, bus: RunnableBus) -> None:
        self.bus = bus
        self.robot = SkillsetInterface(bus, SKILLSET, client="client")
        self.flight: FlightState | None = None
        self.navigation: Navigation | None = None
        bus.subscribe(FLIGHT, message_reader(FlightState, lambda seen: setattr(self, "flight", seen)))
        bus.subscribe(NAVIGATION, message_reader(Navigation, lambda seen: setattr(self, "navigation", seen)))
        self.until(lambda: self.state("SDK_authority") == "AVAILABLE" and self.state("homepoint_status") == "VALID")

    def state(self, resource: str) -> str | None:
        return self.robot.states.get(resource)

    def until(self, done: Callable[[], bool]) -> None:
        assert self.bus.run_until(done, PATIENCE), dict(self.robot.states)

    def fly(self, skill: str, **inputs: Any) -> Terminal:
        return self.end_of(self.robot.start(skill, inputs))

    def end_of(self, goal: GoalHandle) -> Terminal:
        self.until(lambda: goal.done)
        assert goal.terminal is not None
        return goal.terminal

    def on_the_way(self) -> GoalHandle:
        """Take off and start a long leg. Returns its goal at a speed above 1.5 m/s."""
        assert self.fly("takeoff", height=3.0, speed=2.0).success
        goal = self.robot.start("goto", {"target": FAR, "speed": 2.0})
        self.until(lambda: self.speed > 1.5)
        return goal

    @property
    def speed(self) -> float:
        return 0.0 if self.navigation is None else math.hypot(*self.navigation.velocity)

    def at(self, *place: float) -> float:
        """Distance from a place [m]."""
        assert self.navigation is not None
        return math.dist(self.navigation.position, place)


def specs(*skills: str) -> tuple[ProcessSpec, ...]:
    """The robot with the managers of these skills."""
    wanted = {DATA_MANAGER, RESOURCE_MANAGER, *map(skill_process, skills)}
    return (*TABLE.functional_layer({}), *(spec for spec in TABLE.managers() if spec.name in wanted))


@contextmanager
def in_process(*skills: str, network: InProcessNetwork | None = None) -> Iterator[tuple[RobotInProcess, Client]]:
    """The robot in virtual time, and its client."""
    with RobotInProcess(TABLE, network) as drone:
        drone.start(specs(*skills))
        yield drone, Client(drone.network.bus("client", TABLE.name))


def test_it_has_the_managers_of_the_m600_and_nothing_of_its_simulator() -> None:
    assert dict(TABLE.hooks) == dict(M600.hooks)
    assert TABLE.skillset == M600.skillset
    found = "import sys, point_drone.node, skillwing.onboard.guidance.node; print('mujoco' in sys.modules)"
    told = subprocess.run(
        [sys.executable, "-c", found], capture_output=True, text=True, cwd=FOLDER.parent, check=True, timeout=PATIENCE
    )
    assert told.stdout.strip() == "False"


def test_every_skill_flies_or_says_which_sensor_is_missing() -> None:
    network = ObservedNetwork()
    with in_process(*TABLE.hooks, network=network) as (_, client):
        assert client.fly("takeoff", height=3.0, speed=2.0).label == "S_AT_ALTITUDE"
        assert client.fly("goto_straight", target={"x": 5.0, "y": 3.0, "z": 4.0}).label == "S_ARRIVED"
        assert client.at(5.0, 3.0, 4.0) < 0.5
        assert client.fly("rotate_head", heading=2.0).label == "S_ALIGNED"
        lock = client.robot.start("lock_head", {"heading": 2.0})
        assert client.fly("goto", target={"x": 8.0, "y": 3.0, "z": 4.0}).label == "S_ARRIVED"
        assert client.navigation is not None and abs(client.navigation.heading - 2.0) < 0.1
        client.robot.interrupt(lock)
        assert client.end_of(lock).label == "IT"
        hover = client.robot.start("hover", {"duration": 2.2})
        assert network.rates(2.0)[AUTOPILOT_SETPOINT] == pytest.approx(SETPOINTS.rate, abs=1.0)
        assert client.end_of(hover).label == "S_DONE"
        round_home = {"center": {"x": 0.0, "y": 0.0, "z": 0.0}, "radius": 5.0, "height": 5.0, "laps": 0.2}
        assert client.fly("inspect", **round_home).label == "S_COMPLETED"
        assert client.fly("return_home", height=5.0).label == "S_ARRIVED"
        assert client.fly("land", speed=1.0).label == "S_LANDED"
        assert client.at(0.0, 0.0, 0.0) < 0.5
        client.until(lambda: client.state("flight_status") == "ON_GROUND")
        blind = ("zed_depthmap", "lidar_depthmap", "lidar_mapping", "stream")
        needs = told()
        flying = [skill for skill in TABLE.hooks if skill not in blind]
        assert seen(network, flying) == {skill: needs[skill] for skill in flying}
        missing = {skill: client.fly(skill).failing for skill in blind}
        assert missing == dict(zip(blind, (("zed_ok",), ("lidar_ok",), ("lidar_ok",), ("bandwidth",)), strict=True))


def test_its_safety_pilot_has_the_last_word() -> None:
    with in_process("takeoff", "goto", "land") as (_, client):
        goal = client.on_the_way()
        client.bus.ask(PILOT, encode(SetPilot(authority=False)), lambda answer: None)
        assert (client.end_of(goal).label, client.end_of(goal).invariant) == ("RI", "authority")
        client.until(lambda: client.speed < 0.1)
        assert client.fly("land").failing == ("authority",)
        client.bus.ask(PILOT, encode(SetPilot(authority=True)), lambda answer: None)
        client.until(lambda: client.state("SDK_authority") == "AVAILABLE")
        assert client.fly("land", speed=1.0).label == "S_LANDED"


def test_without_guidance_it_holds_its_position_and_then_lands() -> None:
    with in_process("takeoff", "goto") as (drone, client):
        goal = client.on_the_way()
        drone.kill("guidance")
        terminal = client.end_of(goal)
        assert (terminal.label, "Guidance has not reported" in terminal.reason) == ("ERROR", True)
        assert client.flight is not None and client.flight.failsafe == "no setpoints: holding position"
        client.until(lambda: client.flight is not None and client.flight.failsafe == "no setpoints: landing")
        client.until(lambda: client.state("flight_status") == "ON_GROUND")


def test_nobody_waits_for_a_vehicle_that_is_gone() -> None:
    with in_process("takeoff", "goto") as (drone, client):
        goal = client.on_the_way()
        gone_at = drone.network.now()
        drone.kill("vehicle")
        terminal = client.end_of(goal)
        assert (terminal.label, terminal.invariant) == ("RI", "authority")
        assert drone.network.now() - gone_at < 3.5
        assert client.fly("goto", target=FAR).failing == ("authority",)


@pytest.mark.slow
def test_flies_as_processes_in_wall_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONPATH", str(FOLDER.parent))
    with Launcher(TABLE.name, SKILLSET.name, tmp_path, clock=TABLE.clock) as launcher:
        launcher.start(specs("takeoff", "land"))
        with closing(ZenohBus("client", TABLE.name, launcher.endpoint)) as bus:
            client = Client(bus)
            assert client.fly("takeoff", height=1.0, speed=3.0).label == "S_AT_ALTITUDE"
            assert client.fly("land", speed=2.0).label == "S_LANDED"
            assert client.at(0.0, 0.0, 0.0) < 0.5


# --- the vehicle by itself -------------------------------------------------------------------------------------------

PLACES = st.tuples(*[st.floats(-60.0, 60.0)] * 3)
VELOCITIES = st.tuples(*[st.floats(-6.0, 6.0)] * 3)


@settings(max_examples=30)
@given(st.lists(st.tuples(PLACES, VELOCITIES, st.floats(0.0, 3.0)), max_size=5))
def test_with_any_commands_it_stays_above_ground_and_lands_in_the_end(
    told: list[tuple[Vector3, Vector3, float]],
) -> None:
    made = import_module("point_drone.vehicle")
    vehicle, t = made.Vehicle(), 0.0

    def live(seconds: float) -> None:
        nonlocal t
        for _ in range(math.ceil(seconds / 0.05)):
            t += 0.05
            vehicle.advance(t)
            assert vehicle.position[2] >= 0.0
            assert math.hypot(*vehicle.velocity) <= made.MAX_SPEED + 1e-9

    for place, velocity, seconds in told:
        vehicle.command(AutopilotSetpoint(t=t, position=place, velocity=velocity, heading=0.0, rotors=True), t)
        live(seconds)
    live(10.0 + made.LAND_AFTER + vehicle.position[2] / made.LANDING_SPEED)
    assert vehicle.on_ground


def test_it_takes_no_setpoint_that_comes_too_late() -> None:
    made = import_module("point_drone.vehicle")
    vehicle = made.Vehicle()

    def told(height: float, t: float, of: float) -> float:
        place, still = (0.0, 0.0, height), (0.0, 0.0, 0.0)
        vehicle.command(AutopilotSetpoint(t=of, position=place, velocity=still, heading=0.0, rotors=True), t)
        vehicle.advance(t)
        return vehicle.velocity[2]

    assert told(5.0, t=1.0, of=0.4) == 0.0, "older than it waits for one"
    assert told(5.0, t=1.1, of=1.0) > 0.0
    rising = vehicle.velocity[2]
    assert told(-5.0, t=1.2, of=0.9) > rising, "older than the last"
