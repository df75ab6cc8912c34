"""The whole robot in one process and virtual time: real physics, sensors, guidance, bridge and managers."""

from __future__ import annotations

import math
from importlib import import_module
from typing import Any

import pytest

from skillwing.m600.robot import ROBOT, functional_layer
from skillwing.onboard.topics.faults import FAULT, SetFault
from skillwing.onboard.topics.flight import PILOT, SetPilot
from skillwing.onboard.topics.truth import TRUTH, Truth
from skillwing.services.bus import Answer, Answered
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.client.interface import GoalHandle, SkillsetInterface
from skillwing.services.protocol import Ending, State, Terminal, decode, encode
from skillwing.services.robot import ProcessSpec

SKILLSET = ROBOT.load_skillset()


def make(spec: ProcessSpec) -> Any:
    module, _, factory = spec.factory.partition(":")
    return getattr(import_module(module), factory)(spec.resolved().options)


class Flight:
    """The robot as its table describes it, and a client.

    It carries the `sensors` that a test needs, and those that odometry and landing need.
    """

    def __init__(self, *sensors: str) -> None:
        self.network = InProcessNetwork()
        for spec in (*functional_layer({"seed": 3}), *ROBOT.managers()):
            if spec.name == "sim":
                spec.options["sensors"] = (*sensors, "imu", "range")
            self.network.attach(make(spec))
        self.bus = self.network.bus("client")
        self.truth: Truth | None = None
        self.bus.subscribe(TRUTH, lambda sample: self._see(decode(sample.payload, Truth)))
        self.interface = SkillsetInterface(self.bus, SKILLSET, client="client")
        assert self.until(lambda: self.interface.states.get("homepoint_status") == "VALID", 10.0)
        assert self.until(lambda: all(self.interface.states[f"{sensor}_status"] == "OK" for sensor in sensors), 10.0)

    def _see(self, truth: Truth) -> None:
        assert truth.collisions == 0
        assert truth.inside_fence
        self.truth = truth

    def until(self, done: Any, timeout: float) -> bool:
        return self.network.run_until(done, timeout)

    def start(self, skill: str, **inputs: Any) -> GoalHandle:
        goal = self.interface.start(skill, inputs)
        assert self.until(lambda: goal.state in (State.RUNNING, State.TERMINATED), 5.0), goal
        return goal

    def end(self, goal: GoalHandle, within: float = 60.0) -> Terminal:
        assert self.until(lambda: goal.done, within), goal
        assert goal.terminal is not None
        return goal.terminal

    def fly(self, skill: str, **inputs: Any) -> str:
        return self.end(self.start(skill, **inputs)).label

    def at(self, x: float, y: float, z: float) -> float:
        """Distance of the drone from a point [m]."""
        assert self.truth is not None
        return math.dist(self.truth.position, (x, y, z))

    @property
    def speed(self) -> float:
        assert self.truth is not None
        return math.hypot(*self.truth.velocity)


def test_takes_off_flies_a_leg_with_its_camera_comes_home_and_lands() -> None:
    flight = Flight("zed", "lidar")
    assert flight.fly("takeoff", height=2.0, speed=1.5) == "S_AT_ALTITUDE"
    depthmap, mapping = flight.start("zed_depthmap"), flight.start("lidar_mapping")
    assert flight.fly("goto_straight", target={"x": 3.0, "y": 0.0, "z": 2.0}, speed=2.0) == "S_ARRIVED"
    assert flight.at(3.0, 0.0, 2.0) < 0.6
    assert flight.fly("rotate_head", heading=0.5) == "S_ALIGNED"
    lock = flight.start("lock_head", heading=0.5)
    assert flight.fly("goto", target={"x": 2.0, "y": 0.0, "z": 2.0}, speed=2.0) == "S_ARRIVED"
    for goal in (lock, depthmap, mapping):
        flight.interface.interrupt(goal)
        terminal = flight.end(goal, within=4.0)
        assert (terminal.ending, terminal.forced) == (Ending.INTERRUPTED, False)
    assert mapping.progress is not None
    assert mapping.progress["voxels"] > 1000
    assert flight.fly("return_home", height=2.0, speed=2.0) == "S_ARRIVED"
    assert flight.fly("land", speed=1.0) == "S_LANDED"
    assert flight.at(0.0, 0.0, 0.0) < 1.0
    idle = {
        "axes_authority": "AVAILABLE",
        "heading_authority": "AVAILABLE",
        "depthmap_source": "NONE",
        "slam_status": "IDLE",
        "flight_status": "ON_GROUND",
    }
    assert flight.until(lambda: idle.items() <= flight.interface.states.items(), 2.0), dict(flight.interface.states)


@pytest.mark.parametrize(
    ("target", "sensor", "stops"),
    [
        ((7.0, 0.0, 2.0), None, False),
        ((7.5, 3.0, 2.0), None, False),
        ((9.0, 2.0, 2.0), "zed", False),
        ((5.0, 4.0, 2.0), "zed", True),
        ((2.0, 2.0, 2.0), None, True),
    ],
    ids=["straight ahead", "aside", "aside in view", "aside out of view", "behind"],
)
def test_a_new_target_is_flown_to_by_the_same_goal(
    target: tuple[float, float, float], sensor: str | None, stops: bool
) -> None:
    flight = Flight(*([] if sensor is None else [sensor]))
    flight.fly("takeoff", height=2.0, speed=1.5)
    if sensor is not None:
        flight.start(f"{sensor}_depthmap")
    goal = flight.start("goto", target={"x": 9.0, "y": 0.0, "z": 2.0}, speed=2.0)
    assert flight.until(lambda: flight.at(4.0, 0.0, 2.0) < 0.5, 20.0)
    answers: list[Answer] = []
    x, y, z = target
    flight.interface.modify(goal, {"target": {"x": x, "y": y, "z": z}, "speed": 1.5}, answers.append)
    assert flight.until(lambda: bool(answers), 1.0)
    assert isinstance(answers[0], Answered), answers
    speeds: list[float] = []

    def near() -> bool:
        assert flight.truth is not None
        speeds.append(math.hypot(*flight.truth.velocity))
        return flight.at(*target) < 1.5

    assert flight.until(near, 20.0)
    assert (min(speeds) < 0.3) is stops
    assert flight.end(goal).label == "S_ARRIVED"
    assert flight.at(*target) < 0.5


def test_an_interrupted_flight_ends_at_rest() -> None:
    flight = Flight()
    flight.fly("takeoff", height=2.0, speed=1.5)
    goal = flight.start("goto", target={"x": 8.0, "y": 0.0, "z": 2.0}, speed=3.0)
    assert flight.until(lambda: flight.speed > 1.5, 10.0)
    flight.interface.interrupt(goal)
    terminal = flight.end(goal, within=5.0)
    assert (terminal.ending, terminal.forced) == (Ending.INTERRUPTED, False)
    assert flight.speed < 0.4


def test_a_blind_camera_ends_its_depth_map_and_leaves_the_drone_hovering() -> None:
    flight = Flight("zed")
    flight.fly("takeoff", height=2.0, speed=1.5)
    depthmap = flight.start("zed_depthmap")
    goal = flight.start("goto_straight", target={"x": 8.0, "y": 0.0, "z": 2.0}, speed=1.0)
    assert flight.until(lambda: flight.speed > 0.8, 10.0)
    flight.bus.ask(FAULT, encode(SetFault(sensor="zed", kind="blackout")), lambda answer: None)
    terminal = flight.end(depthmap, within=2.0)
    assert (terminal.ending, terminal.invariant) == (Ending.INVARIANT_VIOLATED, "zed_ok")
    assert flight.until(lambda: flight.speed < 0.2, 5.0), "guidance waits for a view of its way"
    assert not goal.done
    flight.interface.interrupt(goal)
    assert flight.end(goal, within=2.0).ending is Ending.INTERRUPTED


def test_when_the_pilot_takes_over_the_flight_ends_and_can_be_resumed() -> None:
    flight = Flight()
    flight.fly("takeoff", height=2.0, speed=1.5)
    goal = flight.start("goto", target={"x": 8.0, "y": 0.0, "z": 2.0}, speed=2.0)
    assert flight.until(lambda: flight.speed > 1.0, 10.0)
    flight.bus.ask(PILOT, encode(SetPilot(authority=False)), lambda answer: None)
    terminal = flight.end(goal, within=1.0)
    assert (terminal.ending, terminal.invariant) == (Ending.INVARIANT_VIOLATED, "authority")
    flight.bus.ask(PILOT, encode(SetPilot(authority=True)), lambda answer: None)
    assert flight.until(lambda: flight.interface.state("SDK_authority") == "AVAILABLE", 5.0)
    assert flight.fly("land", speed=1.0) == "S_LANDED"
