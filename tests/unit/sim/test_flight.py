"""The drone flies: control, failsafes, landing."""

from __future__ import annotations

import math
from copy import deepcopy

from flight_rig import Rig, airborne

from skillwing.onboard.frames.vectors import heading_of, wrap
from skillwing.onboard.topics.guidance import FlyTo, Land, MotionState, Turn, YawMode
from skillwing.sim_mujoco.autopilot.autopilot import Mode, Setpoint
from skillwing.sim_mujoco.simulator.simulator import Simulator


def test_take_off_hover_and_land_gently_on_the_pad() -> None:
    rig = Rig()
    rig.take_off(3.0)
    rig.fly(5.0)
    assert all(math.dist(p, (0.0, 0.0, 3.0)) < 0.2 for t, p in rig.track if t > rig.sim.t - 4.0)
    rig.command("land", Land(speed=1.0))
    rig.fly_until(MotionState.DONE)
    rig.fly(1.0)
    assert rig.sim.autopilot.mode is Mode.OFF
    assert math.dist(rig.sim.motion.position[:2], (0.0, 0.0)) < 0.3
    assert rig.sim.collisions == 0


def test_wind_does_not_carry_the_drone_away() -> None:
    rig = Rig(wind=(8.0, 4.0, 0.0))
    rig.take_off()
    rig.fly(8.0)
    assert all(math.dist(p, (0.0, 0.0, 4.0)) < 0.5 for t, p in rig.track if t > rig.sim.t - 4.0)


def test_a_leg_is_flown_straight_without_overshoot() -> None:
    rig = airborne()
    rig.track.clear()
    rig.command("leg", FlyTo(target=(10.0, 0.0, 4.0), speed=2.0, nose=YawMode.FREE))
    rig.fly_until(MotionState.DONE)
    rig.fly(2.0)
    assert max(p[0] for _, p in rig.track) < 10.2
    assert max(abs(p[1]) for _, p in rig.track) < 0.2
    assert max(abs(p[2] - 4.0) for _, p in rig.track) < 0.2


def test_the_heading_turns_and_is_held() -> None:
    rig = airborne()
    rig.command("turn", Turn(heading=2.5, lock=True))
    assert rig.fly(8.0, lambda: rig.status.heading.state is MotionState.DONE)
    rig.fly(1.0)
    assert abs(wrap(heading_of(rig.sim.motion.quaternion) - 2.5)) < 0.05


def test_without_setpoints_it_holds_position_then_lands_and_cuts_the_rotors() -> None:
    rig = airborne(3.0)
    rig.command("leg", FlyTo(target=(10.0, 0.0, 3.0), speed=2.0, nose=YawMode.FREE))
    rig.fly(3.0)
    rig.connected = False
    assert rig.fly(1.0, lambda: rig.sim.autopilot.mode is Mode.HOVER)
    assert rig.sim.autopilot.failsafe
    rig.fly(3.0)
    x, _, z = rig.sim.motion.position
    assert abs(z - 3.0) < 0.3
    rig.fly(1.0)
    assert abs(rig.sim.motion.position[0] - x) < 0.2
    assert rig.fly(3.0, lambda: rig.sim.autopilot.mode is Mode.LAND)
    assert rig.fly(10.0, lambda: rig.sim.autopilot.mode is Mode.OFF)
    assert rig.sim.rotors_on, "they run down"
    assert rig.fly(1.0, lambda: not rig.sim.rotors_on)
    assert rig.sim.collisions == 0


def test_fresh_setpoints_end_the_failsafe() -> None:
    rig = airborne(3.0)
    rig.connected = False
    rig.fly(2.0)
    assert rig.sim.autopilot.mode is Mode.HOVER
    rig.connected = True
    rig.fly(0.1)
    assert rig.sim.autopilot.mode is Mode.FOLLOW


def test_while_the_safety_pilot_flies_setpoints_are_ignored() -> None:
    rig = airborne(3.0)
    rig.command("leg", FlyTo(target=(10.0, 0.0, 3.0), speed=2.0, nose=YawMode.FREE))
    rig.fly(2.0)
    rig.sim.autopilot.authority = False
    rig.fly(4.0)
    assert rig.status.body.state is MotionState.ABORTED
    assert rig.sim.autopilot.mode is Mode.PILOT
    where = rig.sim.motion.position
    rig.sim.autopilot.authority = True
    rig.fly(3.0)
    assert rig.sim.autopilot.mode is Mode.FOLLOW
    assert math.dist(rig.sim.motion.position, where) < 0.3


def test_it_lands_without_a_range_finder() -> None:
    rig = airborne()
    rig.sim.set_fault("range", "blackout", on=True)
    rig.fly(1.0)
    rig.command("land", Land(speed=2.0))
    rig.fly_until(MotionState.DONE)
    assert rig.sim.autopilot.mode is Mode.OFF
    assert rig.sim.collisions == 0


def test_flying_into_a_wall_is_a_collision_and_clearance_says_so() -> None:
    rig = Rig()
    blocker = next(o for o in rig.sim.world.obstacles if o.leg is not None)
    near = blocker.footprint.centre[0] - 2.0, blocker.footprint.centre[1]
    simulator = Simulator(rig.sim.world, sensors=())
    simulator.place((*near, 4.0))
    clearance = simulator.clearance
    assert 0.0 < clearance < 2.0
    for _ in range(150):
        ahead = blocker.footprint.centre[0], blocker.footprint.centre[1], 4.0
        simulator.command(Setpoint(ahead, (1.0, 0.0, 0.0), 0.0))
        simulator.advance(simulator.t + 0.02)
    assert simulator.collisions >= 1
    assert simulator.clearance < 0.1


def test_the_same_seed_flies_the_same_flight() -> None:
    flights = []
    for _ in range(2):
        rig = Rig(wind=(3.0, 0.0, 0.0))
        rig.fly(1.1)
        rig.take_off(2.0)
        flights.append(rig.track)
    assert flights[0] == flights[1]


def test_a_copy_of_a_flight_goes_on_as_the_flight_does() -> None:
    flight = airborne()
    copy = deepcopy(flight)
    for rig in (flight, copy):
        rig.command("leg", FlyTo(target=(3.0, 0.0, 4.0), speed=2.0, nose=YawMode.FREE))
        rig.fly(2.0)
    assert copy.track == flight.track
    assert math.dist(airborne().sim.motion.position, (0.0, 0.0, 4.0)) < 0.2, "that of which both are copies stays"
