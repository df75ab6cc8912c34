"""Odometry keeps navigation true while there are no fixes, and one that lies does not lead it astray."""

from __future__ import annotations

import math
from collections.abc import Callable
from copy import deepcopy
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from skillwing.onboard.frames.vectors import Quaternion, Vector, add, norm, subtract, to_world
from skillwing.onboard.topics import flight
from skillwing.onboard.topics.navigation import NAVIGATION, Navigation
from skillwing.onboard.topics.odometry import SLAM_ODOMETRY, Odometry, Tracking
from skillwing.onboard.topics.truth import TRUTH, Truth
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.protocol import decode, encode
from skillwing.sim_mujoco.navigation.navigator import EPOCH, Navigator, Solution
from skillwing.sim_mujoco.navigation.odometry_aid import CONTRADICTIONS, PROOF, OdometryReport, Reputation
from skillwing.sim_mujoco.navigation.strapdown import GRAVITY
from skillwing.sim_mujoco.sensors.gnss import DELAY
from skillwing.sim_mujoco.sensors.instruments import IMU_PERIOD
from skillwing.sim_mujoco.sensors.receivers import RECEIVERS
from skillwing.sim_mujoco.simulator.node import make_sim, odometry_report

HEADING = 0.7
FORCE_BIAS, RATE_BIAS = (0.02, -0.01, 0.01), (3e-4, -4e-4, 2e-4)
FIXES_END = 8.0
Says = Callable[[OdometryReport], OdometryReport | None]


def upright(heading: float) -> Quaternion:
    return math.cos(heading / 2), 0.0, 0.0, math.sin(heading / 2)


def in_body(velocity: Vector) -> Vector:
    x, y, z = velocity
    c, s = math.cos(HEADING), math.sin(HEADING)
    return c * x + s * y, c * y - s * x, z


class Drone:
    """One that swings to and fro on a level, with an IMU that is off as those of its class are."""

    def __init__(self, says: Says | None) -> None:
        """`says` makes what odometry says of the truth, or None for nothing."""
        self.navigator = Navigator(RECEIVERS["rtk"])
        self.navigator.place((0.0, 0.0, 5.0), HEADING)
        self.navigator.odometry(OdometryReport(0.0, 0.0, (0.0, 0.0, 0.0), good=True))
        self.t, self.says = 0.0, says

    def true(self, t: float) -> tuple[Vector, Vector, Vector]:
        """Position, velocity, acceleration."""
        swing = 0.5
        return (
            (2.0 / swing * (1.0 - math.cos(swing * t)), 0.0, 5.0),
            (2.0 * math.sin(swing * t), 0.0, 0.0),
            (2.0 * swing * math.cos(swing * t), 0.0, 0.0),
        )

    def fly(self, until: float, *, fixes: bool) -> Drone:
        while self.t < until - 1e-6:
            for step in range(round(EPOCH / IMU_PERIOD)):
                _, _, acceleration = self.true(self.t + (step + 0.5) * IMU_PERIOD)
                self.navigator.inertial(add(in_body(add(acceleration, (0.0, 0.0, GRAVITY))), FORCE_BIAS), RATE_BIAS)
            self.t = round(self.t + EPOCH, 6)
            position, velocity, _ = self.true(self.t)
            self.navigator.epoch(self.t, position[2], standing=False)
            if fixes:
                self._fix(round(self.t - DELAY, 6))
            report = OdometryReport(self.t, 0.0, in_body(velocity), good=True)
            report = None if self.says is None else self.says(report)
            if report is not None:
                self.navigator.odometry(report)
        return self

    def _fix(self, t: float) -> None:
        position, velocity, _ = self.true(t)
        # No two fixes of a receiver are the same, which would be taken for one.
        fix = np.array([*position, *velocity, HEADING + 1e-4 * math.sin(50.0 * t)], dtype=np.float32)
        self.navigator.fix(self.t, t, fix, usable=True)

    @property
    def solution(self) -> Solution:
        solution = self.navigator.solution(self.t)
        assert solution is not None
        return solution

    @property
    def astray(self) -> float:
        return norm(subtract(self.solution.position, self.true(self.t)[0]))


def truth(report: OdometryReport) -> OdometryReport:
    return report


@cache
def _with_fixes() -> Drone:
    return Drone(truth).fly(FIXES_END, fixes=True)


def flown(says: Says | None, seconds: float = 20.0) -> Drone:
    """Fixes and true odometry until FIXES_END, and so long without fixes and with this odometry."""
    drone = deepcopy(_with_fixes())
    drone.says = says
    return drone.fly(FIXES_END + seconds, fixes=False)


def test_with_odometry_position_and_velocity_stay_known() -> None:
    drone = flown(truth)
    assert drone.solution.valid
    assert drone.solution.velocity_valid
    assert drone.astray < 0.3
    alone = flown(None)
    assert not alone.solution.valid
    assert not alone.solution.velocity_valid
    assert alone.astray > 5.0 * drone.astray


def test_the_position_grows_uncertain_with_odometry_as_well() -> None:
    drone = flown(truth, seconds=60.0)
    assert not drone.solution.valid
    assert drone.solution.velocity_valid, "so that the drone can hold its place, and set down softly"


@pytest.mark.parametrize("says", [truth, lambda r: replace(r, velocity=(9.0, 9.0, 9.0)), lambda r: None])
def test_while_there_are_fixes_odometry_changes_nothing(says: Says) -> None:
    told, alone = Drone(says).fly(FIXES_END, fixes=True), Drone(None).fly(FIXES_END, fixes=True)
    assert told.solution == alone.solution


LIES: dict[str, Says] = {
    "far off": lambda r: replace(r, velocity=add(r.velocity, (1.5, 0.0, 0.0))),
    "doubts itself": lambda r: replace(r, good=False),
    "too late": lambda r: replace(r, t=r.t - 1.0),
    "from the future": lambda r: replace(r, t=r.t + 0.1),
    "another one": lambda r: replace(r, since=r.t),
}


@pytest.mark.parametrize("lie", LIES)
def test_what_must_not_be_believed_is_not(lie: str) -> None:
    assert flown(LIES[lie], 5.0).solution == flown(None, 5.0).solution


@pytest.mark.parametrize("before", [None, lambda r: replace(r, velocity=add(r.velocity, (0.0, 2.0, 0.0)))])
def test_what_was_not_right_with_fixes_is_not_believed_without(before: Says | None) -> None:
    drone = Drone(before).fly(FIXES_END, fixes=True)
    drone.says = truth
    assert drone.fly(FIXES_END + 5.0, fixes=False).solution == flown(None, 5.0).solution


def test_once_it_has_contradicted_for_long_it_has_to_earn_its_say_again() -> None:
    def lying_for_a_while(report: OdometryReport) -> OdometryReport:
        lies = report.t < FIXES_END + EPOCH * (CONTRADICTIONS + 0.5)
        return replace(report, velocity=(5.0, 0.0, 0.0)) if lies else report

    drone, alone = flown(lying_for_a_while, 5.0), flown(None, 5.0)
    assert drone.solution == alone.solution
    drone.fly(drone.t + 3.0, fixes=True).fly(drone.t + 20.0, fixes=False)
    assert drone.solution.valid


def test_a_single_wrong_velocity_costs_nothing() -> None:
    def slipping(report: OdometryReport) -> OdometryReport:
        return replace(report, velocity=(5.0, 0.0, 0.0)) if round(report.t / EPOCH) % 10 == 0 else report

    assert flown(slipping).solution.valid


def test_odometry_that_comes_back_when_all_could_be_true_is_not_believed() -> None:
    def away(report: OdometryReport) -> OdometryReport | None:
        return None if report.t < FIXES_END + 10.0 else report

    assert not flown(away).solution.velocity_valid


@settings(max_examples=10, deadline=None)
@given(st.floats(-math.pi, math.pi), st.floats(0.7, 30.0), st.floats(FIXES_END, FIXES_END + 3.0))
def test_no_jump_leads_navigation_far(way: float, size: float, since: float) -> None:
    jump = (size * math.cos(way), size * math.sin(way), 0.0)

    def jumping(report: OdometryReport) -> OdometryReport:
        return report if report.t <= since else replace(report, velocity=add(report.velocity, jump))

    assert flown(jumping, 6.0).astray < flown(None, 6.0).astray + 0.3


@given(st.lists(st.tuples(st.booleans(), st.booleans()), max_size=60))
def test_a_say_is_earned_with_fixes_only_and_lost_by_contradicting(reports: list[tuple[bool, bool]]) -> None:
    reputation = Reputation()
    reputation.reported_by(1.0)
    for agrees, fixed in reports:
        earned = reputation.earned
        reputation.observe(agrees=agrees, fixed=fixed)
        assert not reputation.earned or earned or (agrees and fixed)
    vouched = [fixed for agrees, fixed in reports if agrees]
    assert not reputation.earned or sum(vouched) >= PROOF
    for _ in range(CONTRADICTIONS):
        reputation.observe(agrees=False, fixed=False)
    assert not reputation.earned


@given(st.floats(-math.pi, math.pi), st.tuples(*[st.floats(-5.0, 5.0)] * 3))
def test_the_frame_of_odometry_does_not_matter(turn: float, velocity: Vector) -> None:
    """One that has turned away turns attitude and velocity alike."""
    told = message(0.0, upright(HEADING + turn), to_world(upright(turn), velocity))
    assert norm(subtract(odometry_report(told).velocity, in_body(velocity))) < 1e-9


def message(t: float, attitude: Quaternion, velocity: Vector) -> Odometry:
    return Odometry(
        t=t,
        since=0.0,
        position=(0.0, 0.0, 0.0),
        velocity=velocity,
        quaternion=attitude,
        position_sigma=(0.1, 0.1, 0.1),
        attitude_sigma=(0.01, 0.01, 0.01),
        agreement=1.0,
        tracking=Tracking.GOOD,
    )


def test_the_node_hears_odometry_and_navigation_stays_valid() -> None:
    network = InProcessNetwork()
    network.run_for(2.0)  # The robot's time began before this process.
    bus = network.bus("others")
    odometry = bus.advertise(SLAM_ODOMETRY)
    setpoints = bus.advertise(flight.AUTOPILOT_SETPOINT)
    heard: list[Navigation] = []

    def on_navigation(navigation: Navigation) -> None:
        heard.append(navigation)
        up = flight.AutopilotSetpoint(
            t=navigation.t, position=(0.0, 0.0, 4.0), velocity=(0.0, 0.0, 0.0), heading=0.0, rotors=True
        )
        setpoints.put(encode(up))

    def on_truth(true: Truth) -> None:
        odometry.put(encode(message(true.t, true.quaternion, true.velocity)))

    bus.subscribe(NAVIGATION, lambda sample: on_navigation(decode(sample.payload, Navigation)))
    bus.subscribe(TRUTH, lambda sample: on_truth(decode(sample.payload, Truth)))
    network.attach(
        make_sim({"seed": 4, "sensors": ["range"], "faults": [{"sensor": "gnss", "kind": "blackout", "at": 5.0}]})
    )
    network.run_for(17.0)
    assert heard[-1].valid
    assert heard[-1].sigma < 0.7
    assert heard[-1].position[2] > 3.0
