"""Flights of benchmarks/flight_tests.py that lose the satellite receiver, with and without odometry."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
from flight_trials import PERIOD, SETTLING, Flight, along, follow, nothing, open_ground, stay
from mapping_flight import as_navigation, free_route
from odometry_on_flight import give, make_odometry

from skillwing.onboard.frames.vectors import Vector
from skillwing.onboard.guidance.trajectory import straight
from skillwing.onboard.odometry.odometry import Phase
from skillwing.sim_mujoco.navigation.odometry_aid import OdometryReport
from skillwing.sim_mujoco.simulator.lockstep import Output
from skillwing.sim_mujoco.world.world import World, make_world

_AT_REST = 3.5
"""Time on the pad before takeoff; odometry needs 2 s of it [s]."""
_HEIGHT, _CLIMB = 10.0, 1.5


class SeeingFlight(Flight):
    """One flight from the pad with LiDAR, IMU, and the odometry of the mapping process.

    astray: horizontal error of navigation and its stated standard deviation, at each solution [m].
    """

    def __init__(self, world: World, place: Vector, **options: Any) -> None:
        """place: target of the flight."""
        self.prepare(world, place, ("range", "lidar", "imu"), options)
        self._odometry = make_odometry()
        self.astray: list[tuple[float, float]] = []

    def hear(self, happened: Output) -> None:
        odometry = self._odometry
        for solution in happened.solutions:
            odometry.navigation(as_navigation(solution))
            # Solutions belong to the beginning of the 20 ms.
            if self.positions:
                self.astray.append((math.dist(solution.position[:2], self.positions[-1][:2]), solution.sigma))
        for measurement in happened.measurements:
            fix = give(odometry, measurement)
            if fix is not None and odometry.begun_at is not None:
                x, y, z = (fix.levelled.turn.T @ fix.levelled.velocity).tolist()
                good = odometry.phase is Phase.TRACKING
                self.simulator.odometry(OdometryReport(fix.t, odometry.begun_at, (x, y, z), good))


def lost_fixes(seed: int, **options: Any) -> tuple[Flight, dict[str, float]]:
    """Permanent loss of the satellite receiver in a hover; setpoints continue."""
    flight = Flight(open_ground(seed), **options).fly(8.0, stay())
    return _without_fixes(flight)


def lost_fixes_seeing(seed: int, blind_after: float = math.inf, **options: Any) -> tuple[Flight, dict[str, float]]:
    """The same loss 10 m above the pad of a courtyard, with odometry until its LiDAR fails as well."""
    world = make_world(seed)
    flight = _risen(world, (*world.home, _HEIGHT), **options)
    return _without_fixes(flight, blind_after)


def route_without_fixes(seed: int) -> tuple[Flight, dict[str, float]]:
    """Route of a courtyard without obstacles in the way, flown at 2 m/s with odometry and without fixes.

    The courtyards are those of `benchmarks/odometry.py`, from seed 11 on.
    """
    world = free_route(10 + seed)
    flight = _risen(world, world.route[0])
    simulator, begun = flight.simulator, flight.simulator.t
    simulator.set_fault("gnss", "blackout", on=True)
    for start, end in pairwise(world.route):
        heading = math.atan2(end[1] - start[1], end[0] - start[0])
        flight.fly(2.5, stay(start, heading), lambda: bool(flight.failsafes[-1]))
        if not flight.failsafes[-1]:
            segment = straight(start, end, 2.0, simulator.t)
            flight.fly(segment.profile.duration, follow(segment, heading), lambda: bool(flight.failsafes[-1]))
    trusted, known = simulator.t, len(flight.astray)
    flight.land(nothing)
    since = round((trusted - begun) / PERIOD)
    astray = np.array(flight.astray[known - since : known])
    return flight, {
        "flown on for, s": trusted - begun,
        "then off by, m": float(astray[-1, 0]),
        "by its own account, m": float(astray[-1, 1]),
        "at most off by, sigma": float((astray[:, 0] / astray[:, 1]).max()),
        "landed": float(flight.landed),
        "touchdown speed, m/s": flight.touchdown_speed,
    }


def _risen(world: World, place: Vector, **options: Any) -> SeeingFlight:
    """A flight after takeoff, in a hover above the pad."""
    flight = SeeingFlight(world, place, **options)
    flight.fly(_AT_REST, nothing)
    flight.fly(place[2] / _CLIMB, along(flight.positions[-1], (0.0, 0.0, _CLIMB), flight.simulator.t))
    flight.fly(SETTLING, stay(place))
    return flight


def _without_fixes(flight: Flight, blind_after: float = math.inf) -> tuple[Flight, dict[str, float]]:
    simulator, begun = flight.simulator, flight.simulator.t
    simulator.set_fault("gnss", "blackout", on=True)
    flight.fly(min(blind_after, 300.0), stay(flight.place), lambda: simulator.autopilot.on_ground)
    if blind_after < math.inf:
        simulator.set_fault("lidar", "blackout", on=True)
    flight.land(stay(flight.place), 300.0)
    at = next((t for t, text in zip(flight.times, flight.failsafes, strict=True) if "navigation" in text), math.nan)
    there = flight.positions[np.searchsorted(flight.times, at) - 1]
    return flight, {
        "lands after, s": at - begun,
        "landed": float(flight.landed),
        "touchdown speed, m/s": flight.touchdown_speed,
        "drift until then, m": math.dist(flight.place[:2], there[:2]),
        "drift in all, m": flight.drift(begun),
    }
