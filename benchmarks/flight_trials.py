"""Flights of benchmarks/flight_tests.py: single flights of the simulated drone over open ground, with their figures.
The autopilot flies by its own navigation; figures are of the true motion.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Collection
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skillwing.onboard.frames.extent import Box
from skillwing.onboard.frames.vectors import Vector, axes, heading_of, norm, wrap
from skillwing.onboard.guidance.trajectory import Segment, straight
from skillwing.sim_mujoco.autopilot.autopilot import FailsafeLimits, Mode, Setpoint
from skillwing.sim_mujoco.physics.wind import Gust
from skillwing.sim_mujoco.simulator.lockstep import Output
from skillwing.sim_mujoco.simulator.simulator import Simulator
from skillwing.sim_mujoco.world.terrain import make_terrain
from skillwing.sim_mujoco.world.world import World, make_world

STILL: Vector = (0.0, 0.0, 0.0)
PLACE: Vector = (15.0, 10.0, 15.0)
WIND: Vector = (8.0, 4.0, 0.0)
PERIOD = 0.02
SETTLING = 4.0
Plan = Callable[[float], Setpoint | None]


def open_ground(seed: int, amplitude: float = 0.45) -> World:
    """Terrain of a seed, with hills of this height [m] and no obstacles."""
    terrain = make_terrain(np.random.default_rng(seed), (15.0, 10.0), (35.0, 30.0), amplitude=amplitude)
    return dataclasses.replace(make_world(seed), obstacles=(), terrain=terrain)


class Flight:
    """One flight from a hover in the air, with a record of the true motion every 20 ms."""

    def __init__(self, world: World, place: Vector = PLACE, **options: Any) -> None:
        self.prepare(world, place, ("range",), options)
        self.simulator.place(place)
        # Rotors start for a setpoint that is higher.
        x, y, z = place
        self.simulator.command(Setpoint((x, y, z + 0.1), STILL, 0.0))
        self.simulator.advance(PERIOD)

    def prepare(self, world: World, place: Vector, sensors: Collection[str], options: dict[str, Any]) -> None:
        """Make a drone with these sensors on its pad, and an empty record."""
        self.simulator = Simulator(world, sensors=sensors, **options)
        self.place = place
        self.times: list[float] = []
        self.positions: list[Vector] = []
        self.velocities: list[Vector] = []
        self.headings: list[float] = []
        self.tilts: list[float] = []
        self.failsafes: list[str] = []

    def fly(self, seconds: float, plan: Plan, until: Callable[[], bool] = lambda: False) -> Flight:
        """Send the plan's setpoints (None: no setpoint) for some time, or until the condition holds."""
        simulator = self.simulator
        end = simulator.t + seconds
        while simulator.t < end - 1e-9 and not until():
            setpoint = plan(simulator.t)
            if setpoint is not None:
                simulator.command(setpoint)
            self.hear(simulator.advance(simulator.t + PERIOD))
            motion = simulator.motion
            self.times.append(simulator.t)
            self.positions.append(motion.position)
            self.velocities.append(motion.velocity)
            self.headings.append(heading_of(motion.quaternion))
            self.tilts.append(math.acos(min(1.0, max(-1.0, axes(motion.quaternion)[2][2]))))
            self.failsafes.append(simulator.autopilot.failsafe)
        return self

    def hear(self, happened: Output) -> None:
        """Output of the last 20 ms for other nodes; there are none here."""

    def land(self, plan: Plan, seconds: float = 60.0) -> Flight:
        """Fly until the drone is on the ground, and wait for its rotors to stop."""
        self.fly(seconds, plan, lambda: self.simulator.autopilot.on_ground)
        return self.fly(0.5, lambda _: None)

    @property
    def landed(self) -> bool:
        """True if the drone stands upright on the ground and had no collision."""
        simulator = self.simulator
        return simulator.autopilot.on_ground and simulator.collisions == 0 and self.tilts[-1] < math.radians(30.0)

    @property
    def touchdown_speed(self) -> float:
        """Highest speed in the last 0.2 s before the drone came to rest for good [m/s]."""
        speeds = np.linalg.norm(self.velocities, axis=1)
        moving = np.flatnonzero(speeds > 0.2)
        last = int(moving[-1]) if len(moving) else 0
        return float(speeds[max(0, last - 10) : last + 1].max())

    def drift(self, since: float) -> float:
        """Horizontal distance between the positions at `since` and at the end [m]."""
        start = self.positions[np.searchsorted(self.times, since)]
        return math.dist(start[:2], self.positions[-1][:2])

    def errors(self, wanted: Vector, since: float) -> NDArray[np.float64]:
        """Distances (N,) from a place after the time `since` [m]."""
        away = np.array(self.positions) - np.array(wanted)
        return np.linalg.norm(away, axis=1)[np.array(self.times) >= since]


def stay(place: Vector = PLACE, heading: float = 0.0) -> Plan:
    """Plan that holds a position."""
    return lambda _: Setpoint(place, STILL, heading)


def along(start: Vector, velocity: Vector, since: float) -> Plan:
    """Plan that flies straight on without a target."""

    def plan(t: float) -> Setpoint:
        gone = max(0.0, t - since)
        x, y, z = (p + v * gone for p, v in zip(start, velocity, strict=True))
        return Setpoint((x, y, z), velocity, 0.0)

    return plan


def follow(segment: Segment, heading: float) -> Plan:
    """Plan that follows a segment as guidance does."""

    def plan(t: float) -> Setpoint:
        position, velocity, acceleration = segment.at(t)
        return Setpoint(position, velocity, heading, acceleration=acceleration)

    return plan


def nothing(_: float) -> None:
    """Plan without setpoints."""


# --- control -----------------------------------------------------------------------------------------------------


def step_response(seed: int) -> tuple[Flight, dict[str, float]]:
    """Step of the position setpoint by 10 m to the east."""
    x, y, z = PLACE
    return _way_of_ten_metres(seed, lambda begun: stay((x + 10.0, y, z)))


def guided_leg(seed: int) -> tuple[Flight, dict[str, float]]:
    """Leg of 10 m to the east at 3 m/s, flown as guidance flies a segment."""
    x, y, z = PLACE
    return _way_of_ten_metres(seed, lambda begun: follow(straight(PLACE, (x + 10.0, y, z), 3.0, begun), 0.0))


def _way_of_ten_metres(seed: int, plan_from: Callable[[float], Plan]) -> tuple[Flight, dict[str, float]]:
    flight = Flight(open_ground(seed)).fly(SETTLING, stay())
    begun = flight.simulator.t
    flight.fly(14.0, plan_from(begun))
    away = (np.array(flight.positions) - np.array(PLACE))[np.array(flight.times) > begun]
    t90 = PERIOD * float(np.argmax(away[:, 0] >= 9.0))
    return flight, {
        "t90, s": t90,
        "overshoot, cm": 100.0 * max(0.0, float(away[:, 0].max()) - 10.0),
        "sideways, cm": 100.0 * float(np.abs(away[:, 1]).max()),
        "up or down, cm": 100.0 * float(np.abs(away[:, 2]).max()),
    }


def turn(seed: int) -> tuple[Flight, dict[str, float]]:
    """Step of the heading setpoint from east to north."""
    flight = Flight(open_ground(seed)).fly(SETTLING, stay())
    begun = flight.simulator.t
    flight.fly(8.0, stay(heading=math.pi / 2))
    off = np.array([wrap(h - math.pi / 2) for h in flight.headings])
    there = next(t for t, o in zip(flight.times, off, strict=True) if t > begun and abs(o) < math.radians(5.0))
    return flight, {
        "within 5 degrees after, s": there - begun,
        "overshoot, degrees": math.degrees(max(0.0, off.max())),
        "place kept within, cm": 100.0 * float(flight.errors(PLACE, begun).max()),
    }


def hover(seed: int, seconds: float = 40.0, **options: Any) -> tuple[Flight, dict[str, float]]:
    """Hover, in the wind of `options`."""
    flight = Flight(open_ground(seed), **options).fly(8.0 + seconds, stay())
    errors = 100.0 * flight.errors(PLACE, 8.0)
    return flight, {
        "RMS, cm": float(np.sqrt((errors**2).mean())),
        "largest, cm": float(errors.max()),
        "largest tilt, degrees": math.degrees(max(flight.tilts)),
    }


def into_wind(seed: int) -> tuple[Flight, dict[str, float]]:
    """Step of the wind: the drone starts level and at rest in steady wind."""
    flight = Flight(open_ground(seed), wind=WIND).fly(12.0, stay())
    errors = flight.errors(PLACE, 0.0)
    back = np.flatnonzero(errors > 0.1)
    return flight, {
        "largest deviation, cm": 100.0 * float(errors.max()),
        "back within 10 cm after, s": flight.times[int(back[-1])] if len(back) else 0.0,
    }


def gust(seed: int) -> tuple[Flight, dict[str, float]]:
    """Hover in a gust of 10 m/s that lasts 3 s."""
    gusts = [Gust(SETTLING, (10.0, 0.0, 0.0), 3.0)]
    flight = Flight(open_ground(seed), gusts=gusts).fly(SETTLING + 8.0, stay())
    return flight, {"largest deviation, cm": 100.0 * float(flight.errors(PLACE, SETTLING).max())}


# --- landing -----------------------------------------------------------------------------------------------------


def land_on_a_slope(seed: int, amplitude: float) -> tuple[Flight, dict[str, float]]:
    """Land by the range-finder on the steepest place of the seed's terrain, and take off again."""
    world = open_ground(seed, amplitude)
    (x, y), slope = _steepest(world)
    high = world.terrain.highest + 6.0
    flight = Flight(world, (x, y, high)).fly(1.0, stay((x, y, high)))
    flight.land(nothing)
    landed, speed, drift = flight.landed, flight.touchdown_speed, flight.drift(1.0)
    tilt = math.degrees(flight.tilts[-1])
    flight.fly(8.0, stay((x, y, flight.positions[-1][2] + 3.0)))
    up = flight.simulator.autopilot.mode is Mode.FOLLOW and flight.simulator.collisions == 0
    return flight, {
        "slope, degrees": slope,
        "landed": float(landed),
        "touchdown speed, m/s": speed,
        "drift, cm": 100.0 * drift,
        "stands tilted by, degrees": tilt,
        "took off again": float(up),
    }


def _steepest(world: World) -> tuple[tuple[float, float], float]:
    """Steepest place of the ground away from its border, and its slope [degrees]."""
    heights = world.terrain.heights
    (cx, cy), (hx, hy) = world.terrain.centre, world.terrain.half
    north, east = np.gradient(heights, 2 * hy / (heights.shape[0] - 1), 2 * hx / (heights.shape[1] - 1))
    slopes = np.hypot(east, north)[10:-10, 10:-10]
    row, column = np.unravel_index(int(slopes.argmax()), slopes.shape)
    x = cx - hx + (column + 10) * 2 * hx / (heights.shape[1] - 1)
    y = cy - hy + (row + 10) * 2 * hy / (heights.shape[0] - 1)
    return (float(x), float(y)), math.degrees(math.atan(slopes.max()))


# --- failsafes ---------------------------------------------------------------------------------------------------


def fence_run(seed: int, direction: Vector, wind_speed: float) -> tuple[Flight, dict[str, float]]:
    """Flight at full speed against a wall of the fence, with tailwind."""
    fence = Box((-20.0, -20.0, -1.0), (50.0, 40.0, 30.0))
    top = 2.0 if direction[2] else 6.0
    velocity = (top * direction[0], top * direction[1], top * direction[2])
    wind = (wind_speed * direction[0], wind_speed * direction[1], 0.0)
    flight = Flight(open_ground(seed), wind=wind, limits=FailsafeLimits(fence=fence)).fly(SETTLING, stay())
    flight.fly(16.0, along(PLACE, velocity, flight.simulator.t))
    places = np.array(flight.positions)
    gaps = np.minimum(np.array(fence.high) - places, places - np.array(fence.low)).min(axis=1)
    return flight, {
        "speed, m/s": max(norm(v) for v in flight.velocities),
        "least distance, m": float(gaps.min()),
        "at rest": float(norm(flight.velocities[-1]) < 0.5),
    }


def rotor_out(seed: int, rotor: int, left: float, **options: Any) -> tuple[Flight, dict[str, float]]:
    """Loss of a rotor's thrust down to the share `left`, in flight to the east at 3 m/s."""
    flight = Flight(open_ground(seed), **options).fly(SETTLING, stay())
    flight.fly(3.0, along(PLACE, (3.0, 0.0, 0.0), flight.simulator.t))
    begun = flight.simulator.t
    flight.simulator.set_fault(f"rotor/{rotor}", "weak", on=True, magnitude=left)
    x, y, z = flight.positions[-1]
    flight.land(stay((x, y, z)), 40.0)
    found = next((t for t, text in zip(flight.times, flight.failsafes, strict=True) if "rotor" in text), None)
    named = any(text.startswith(f"rotor {rotor} failed") for text in flight.failsafes)
    after = np.array(flight.times) > begun
    heights = np.array([p[2] for p in flight.positions])[after]
    spin = np.diff(np.unwrap(flight.headings)) / PERIOD
    return flight, {
        "found after, s": math.nan if found is None else found - begun,
        "right one": float(named),
        "landed": float(flight.landed),
        "touchdown speed, m/s": flight.touchdown_speed if found is not None else math.nan,
        "drift, m": flight.drift(begun),
        "climbed or sank at once, m": float(abs(heights[: round(1.0 / PERIOD)] - z).max()),
        "largest tilt, degrees": math.degrees(float(np.array(flight.tilts)[after].max())),
        "largest yaw rate, degrees/s": math.degrees(float(np.abs(spin[after[1:]]).max())),
    }


def silence(seed: int, **options: Any) -> tuple[Flight, dict[str, float]]:
    """End of all setpoints in flight at 5 m/s."""
    flight = Flight(open_ground(seed), **options).fly(SETTLING, stay())
    flight.fly(4.0, along(PLACE, (5.0, 0.0, 0.0), flight.simulator.t))
    begun = flight.simulator.t
    flight.land(nothing)
    at = {text: t for t, text in reversed(list(zip(flight.times, flight.failsafes, strict=True)))}
    return flight, {
        "brakes after, s": at[Mode.HOVER.value] - begun,
        "stops within, m": flight.drift(begun),
        "lands after, s": at[Mode.LAND.value] - begun,
        "landed": float(flight.landed),
        "touchdown speed, m/s": flight.touchdown_speed,
    }


def low_battery(seed: int, **options: Any) -> tuple[Flight, dict[str, float]]:
    """Critical battery in a hover 25 m above the ground, while setpoints continue."""
    place = (15.0, 10.0, 25.0)
    flight = Flight(open_ground(seed), place, battery_percent=8.3, **options).land(stay(place), 90.0)
    at = next(t for t, text in zip(flight.times, flight.failsafes, strict=True) if text)
    return flight, {
        "down after, s": flight.times[-1] - 0.5 - at,
        "landed": float(flight.landed),
        "touchdown speed, m/s": flight.touchdown_speed,
        "drift, m": flight.drift(at),
        "charge left, %": flight.simulator.battery.percent,
    }
