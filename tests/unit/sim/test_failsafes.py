"""Failsafes of the autopilot, and their order."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import pytest
from flight_rig import WORLD, Rig, airborne
from hypothesis import given
from hypothesis import strategies as st

from skillwing.onboard.commands.service import CommandRefusedError
from skillwing.onboard.frames.extent import Box
from skillwing.onboard.frames.vectors import to_body
from skillwing.onboard.guidance.limits import SETPOINT_TIMEOUT
from skillwing.onboard.topics.guidance import FlyTo, Land, MotionState, TakeOff, Turn, YawMode
from skillwing.sim_mujoco.autopilot.autopilot import Autopilot, Estimate, FailsafeLimits, Mode, Setpoint
from skillwing.sim_mujoco.autopilot.descent import sink_speed
from skillwing.sim_mujoco.autopilot.failsafes import (
    CRITICAL_CHARGE,
    NAVIGATION_REGAINED,
    Emergencies,
)
from skillwing.sim_mujoco.navigation.odometry_aid import OdometryReport
from skillwing.sim_mujoco.physics.battery import CELLS
from skillwing.sim_mujoco.physics.physics import Physics
from skillwing.sim_mujoco.simulator.simulator import Simulator

STILL = (0.0, 0.0, 0.0)
LEVEL = (1.0, 0.0, 0.0, 0.0)
FENCE = Box((-20.0, -20.0, -1.0), (20.0, 20.0, 20.0))


class Bench:
    """An autopilot on a bench, in flight by its inputs, with any combination of failures."""

    def __init__(self) -> None:
        self.autopilot = Autopilot(Physics(WORLD).airframe, 0.002, FailsafeLimits(FENCE))
        self.t, self.position, self.velocity, self.valid = 0.0, (0.0, 0.0, 5.0), STILL, True
        self.setpoints, self.charge, self.lost = True, 80.0, False
        self.wanted: float = 6.0
        self.delay = 0.0
        self.ground: float | None = 5.0
        self.run(0.2)
        assert self.autopilot.mode is Mode.FOLLOW

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / 0.02)):
            self.t += 0.02
            if self.setpoints:
                self.autopilot.command(Setpoint((0.0, 0.0, self.wanted), STILL, 0.0), self.t, self.t - self.delay)
            self.autopilot.battery(self.charge, 22.0)
            now = Estimate(self.position, self.velocity, LEVEL, self.ground, self.t, valid=self.valid)
            # A roll to the right without a command shows that the rotor there is lost.
            rate = (30.0 * self.t, 0.0, 0.0) if self.lost else STILL
            self.autopilot.guide(self.t, now, rate)
            self.autopilot.stabilise(LEVEL, STILL)


def lose_rotor(bench: Bench) -> None:
    """Lose a rotor: the drone sinks faster than commanded."""
    bench.lost = True
    bench.velocity = (*bench.velocity[:2], -2.0)


def lose_navigation(bench: Bench) -> None:
    bench.valid = False


def empty_battery(bench: Bench) -> None:
    bench.charge = CRITICAL_CHARGE - 1.0


def take_over(bench: Bench) -> None:
    bench.autopilot.authority = False


def fall_silent(bench: Bench) -> None:
    bench.setpoints = False


def rush_to_the_fence(bench: Bench) -> None:
    bench.position, bench.velocity = (18.0, 0.0, 5.0), (5.0, 0.0, 0.0)


ORDER: list[tuple[Callable[[Bench], None], Mode]] = [
    (lose_navigation, Mode.NAVIGATION),
    (empty_battery, Mode.BATTERY),
    (take_over, Mode.PILOT),
    (fall_silent, Mode.HOVER),
    (rush_to_the_fence, Mode.FENCE),
]


@pytest.mark.parametrize("first", range(len(ORDER)))
def test_of_all_reasons_the_gravest_decides(first: int) -> None:
    bench = Bench()
    for happen, _ in reversed(ORDER[first:]):
        happen(bench)
        bench.run(0.7)
    assert bench.autopilot.mode is ORDER[first][1]


def test_a_lost_rotor_goes_before_everything() -> None:
    bench = Bench()
    for happen, _ in ORDER:
        happen(bench)
    lose_rotor(bench)
    bench.run(0.7)
    assert bench.autopilot.mode is Mode.ROTOR
    assert bench.autopilot.failsafe == "rotor 5 failed: landing"
    assert not bench.autopilot.holds_heading


def test_setpoints_that_stay_away_end_in_a_landing() -> None:
    bench = Bench()
    fall_silent(bench)
    bench.run(5.4)
    assert bench.autopilot.mode is Mode.HOVER
    assert bench.autopilot.follows
    bench.run(0.3)
    assert bench.autopilot.mode is Mode.LAND


def test_setpoints_that_are_too_old_when_they_come_are_none() -> None:
    bench = Bench()
    bench.delay = SETPOINT_TIMEOUT + 0.1
    bench.run(5.0)
    assert bench.autopilot.mode is Mode.HOVER
    bench.run(0.6)
    assert bench.autopilot.mode is Mode.LAND


def test_setpoints_that_come_late_but_in_time_are_followed() -> None:
    bench = Bench()
    bench.delay = SETPOINT_TIMEOUT - 0.1
    bench.run(10.0)
    assert bench.autopilot.mode is Mode.FOLLOW


def test_a_late_setpoint_does_not_take_the_place_of_a_newer_one() -> None:
    simulator = airborne().sim
    for _ in range(100):
        simulator.command(Setpoint((0.0, 0.0, 4.0), STILL, 0.0))
        simulator.command(Setpoint((8.0, 0.0, 4.0), STILL, 0.0), simulator.t - 0.1)
        simulator.advance(simulator.t + 0.02)
    assert math.dist(simulator.motion.position, (0.0, 0.0, 4.0)) < 0.3


def test_a_setpoint_of_the_future_is_one_of_now() -> None:
    bench = Bench()
    bench.delay = -100.0
    bench.run(0.2)
    bench.delay = 0.0
    bench.run(1.0)
    assert bench.autopilot.mode is Mode.FOLLOW
    fall_silent(bench)
    bench.run(0.7)
    assert bench.autopilot.mode is Mode.HOVER


def test_rotors_turn_on_while_a_drone_rests_a_little_above_its_place() -> None:
    bench = Bench()
    bench.ground, bench.wanted = None, 4.8
    bench.run(5.0)
    assert bench.autopilot.mode is Mode.FOLLOW


def test_rotors_stop_where_a_drone_rests_that_should_be_far_below() -> None:
    bench = Bench()
    bench.ground, bench.wanted = None, 3.0
    bench.run(2.0)
    assert bench.autopilot.mode is Mode.OFF


def test_navigation_has_to_be_good_for_a_while_before_it_counts_again() -> None:
    bench = Bench()
    lose_navigation(bench)
    bench.run(1.0)
    bench.valid = True
    bench.run(NAVIGATION_REGAINED - 0.2)
    assert bench.autopilot.mode is Mode.NAVIGATION
    bench.run(0.4)
    assert bench.autopilot.mode is Mode.FOLLOW


def test_a_critical_battery_stays_critical_and_a_short_sag_is_none() -> None:
    emergencies = Emergencies(FailsafeLimits())
    for cell in [3.8] * 50 + [2.8] * 25 + [3.8] * 50:
        emergencies.battery(50.0, cell * CELLS, 0.02)
    assert emergencies.mode is None
    for _ in range(500):
        emergencies.battery(50.0, 3.2 * CELLS, 0.02)
    assert emergencies.mode is Mode.BATTERY
    emergencies.battery(50.0, 4.0 * CELLS, 10.0)
    assert emergencies.mode is Mode.BATTERY


def landed(simulator: Simulator, seconds: float = 20.0) -> bool:
    """True if the drone lands by itself within this time, after one setpoint to hover."""
    simulator.place((0.0, 0.0, 1.5))
    simulator.command(Setpoint((0.0, 0.0, 1.6), STILL, 0.0))
    simulator.advance(simulator.t + 0.1)
    end = simulator.t + seconds
    while simulator.t < end and not simulator.autopilot.on_ground:
        simulator.advance(simulator.t + 0.1)
    return simulator.autopilot.on_ground


# --- the same in flight ----------------------------------------------------------------------------------------------


def test_a_critical_battery_lands_the_drone_whatever_guidance_wants() -> None:
    rig = Rig(battery_percent=9.0, limits=FailsafeLimits(FENCE, charge=8.5))
    rig.take_off(4.0)
    rig.command("leg", FlyTo(target=(15.0, 0.0, 4.0), speed=2.0, nose=YawMode.FREE))
    assert rig.fly(30.0, lambda: rig.sim.autopilot.mode is Mode.BATTERY)
    assert rig.sim.autopilot.failsafe == "battery critical: landing"
    assert rig.fly(20.0, lambda: rig.sim.autopilot.on_ground)
    assert rig.sim.collisions == 0
    rig.fly(0.1)
    assert rig.status.body.state is MotionState.ABORTED
    assert "battery critical" in rig.status.body.text
    assert rig.sim.autopilot.failsafe == "battery critical: staying on the ground"
    with pytest.raises(CommandRefusedError, match="battery critical"):
        rig.command("again", TakeOff(height=4.0, speed=1.0))


def test_blind_it_comes_down_in_a_hurry_and_softly() -> None:
    rig = airborne()
    rig.sim.set_fault("gnss", "blackout", on=True)
    assert rig.fly(15.0, lambda: rig.sim.autopilot.mode is Mode.NAVIGATION)
    assert not rig.sim.autopilot.follows
    begun = rig.sim.t
    assert rig.fly(10.0, lambda: rig.sim.autopilot.on_ground)
    rig.fly(0.5)
    assert rig.sim.t - begun < 6.0
    assert rig.sim.collisions == 0
    assert rig.sim.autopilot.failsafe == "no navigation: staying on the ground"


def test_lost_but_sure_of_its_velocity_it_lands_where_it_is() -> None:
    rig = airborne()
    sim, navigator = rig.sim, rig.sim._navigator
    navigator._receiver = dataclasses.replace(navigator._receiver, trusted=0.1)

    def reported_odometry_until(mode: Mode | None) -> bool:
        velocity = to_body(sim.motion.quaternion, sim.motion.velocity)
        sim.odometry(OdometryReport(sim.t, 0.0, velocity, good=True))
        return sim.autopilot.mode is mode

    rig.fly(3.0, lambda: reported_odometry_until(None))
    sim.set_fault("gnss", "blackout", on=True)
    assert rig.fly(5.0, lambda: reported_odometry_until(Mode.NAVIGATION))
    assert rig.fly(15.0, lambda: reported_odometry_until(Mode.OFF))
    assert sim.collisions == 0
    assert math.dist(sim.motion.position[:2], (0.0, 0.0)) < 0.3


@given(st.floats(0.0, 40.0), st.floats(0.0, 40.0))
def test_in_a_hurry_it_is_slow_enough_near_the_ground_to_brake(high: float, low: float) -> None:
    low, high = sorted((low, high))
    slow, fast = sink_speed(low, hurry=True), sink_speed(high, hurry=True)
    assert 0.5 <= slow <= fast <= 3.0
    assert fast**2 - slow**2 <= 2.0 * 1.5 * (high - low) + 1e-9, "braking with 1.5 m/s2 at most"


def test_a_drone_that_loses_a_rotor_lands_on_the_others_and_says_so() -> None:
    rig = airborne(5.0)
    rig.command("turn", Turn(heading=1.0, lock=True))
    rig.fly(4.0)
    assert rig.status.heading.state is MotionState.DONE
    rig.command("leg", FlyTo(target=(10.0, 0.0, 5.0), speed=2.0, nose=YawMode.FREE))
    rig.fly(3.0)
    rig.sim.set_fault("rotor/2", "stopped", on=True)
    assert rig.fly(0.5, lambda: rig.sim.autopilot.mode is Mode.ROTOR)
    assert rig.sim.autopilot.failsafe == "rotor 2 failed: landing"
    where = rig.sim.motion.position
    assert rig.fly(20.0, lambda: rig.sim.autopilot.on_ground)
    rig.fly(0.5)
    assert rig.sim.collisions == 0
    assert math.dist(rig.sim.motion.position[:2], where[:2]) < 3.0
    assert rig.status.body.state is MotionState.ABORTED
    assert rig.status.heading.state is MotionState.ABORTED
    assert "cannot hold its heading" in rig.status.heading.text


def test_a_rotor_that_is_a_little_weak_is_flown_on_with() -> None:
    rig = airborne()
    rig.sim.set_fault("rotor/5", "weak", on=True, magnitude=0.85)
    rig.fly(5.0)
    assert rig.sim.autopilot.mode is Mode.FOLLOW
    assert math.dist(rig.sim.motion.position, (0.0, 0.0, 4.0)) < 0.3


@pytest.mark.parametrize(("kind", "magnitude"), [("blackout", None), ("bias", 0.4), ("bias", -0.4)])
def test_the_ground_is_not_mistaken_for_a_rotor_without_a_range_finder(kind: str, magnitude: float | None) -> None:
    rig = airborne(3.0)
    rig.sim.set_fault("range", kind, on=True, magnitude=magnitude)
    rig.fly(1.0)
    rig.command("land", Land(speed=0.7))
    assert rig.fly(40.0, lambda: rig.sim.autopilot.on_ground)
    assert rig.sim.autopilot.failsafe == ""


@pytest.mark.parametrize("rotor", range(1, 7))
def test_a_rotor_that_is_lost_in_a_descent_is_found(rotor: int) -> None:
    rig = airborne(8.0)
    rig.sim.set_fault("range", "blackout", on=True)
    rig.command("land", Land(speed=0.7))
    rig.fly(3.0)
    rig.sim.set_fault(f"rotor/{rotor}", "stopped", on=True)
    assert rig.fly(0.5, lambda: rig.sim.autopilot.mode is Mode.ROTOR)


def test_gusts_are_not_mistaken_for_a_rotor() -> None:
    rig = Rig(wind=(7.0, 3.0, 0.0), turbulence=15.0)
    rig.take_off(6.0)
    rig.fly(10.0)
    assert rig.sim.autopilot.mode is Mode.FOLLOW


def test_a_frozen_range_finder_is_not_believed_when_landing() -> None:
    simulator = Simulator(WORLD, sensors=("range",))
    simulator.place((0.0, 0.0, 3.0))
    simulator.advance(0.1)
    simulator.set_fault("range", "freeze", on=True)
    assert landed(simulator)
    assert simulator.collisions == 0


def test_a_range_finder_that_lies_delays_the_touchdown_only() -> None:
    simulator = Simulator(WORLD, sensors=("range",))
    simulator.set_fault("range", "bias", on=True, magnitude=2.0)
    assert landed(simulator)


def test_an_empty_battery_turns_no_rotor() -> None:
    simulator = Simulator(WORLD, sensors=(), battery_percent=0.001)
    simulator.place((0.0, 0.0, 3.0))
    simulator.command(Setpoint((0.0, 0.0, 3.0), STILL, 0.0))
    simulator.advance(1.0)
    assert not simulator.rotors_on
