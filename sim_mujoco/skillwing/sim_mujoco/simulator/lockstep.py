"""Advance of drones that share one world: tick by tick, and step by step within a tick."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

from skillwing.sim_mujoco.navigation.navigator import Solution
from skillwing.sim_mujoco.physics.dynamics import Dynamics
from skillwing.sim_mujoco.sensors.channel import Measurement
from skillwing.sim_mujoco.sensors.health import ConditionChange

TICK = 0.01
"""Period of the sensors; the autopilot guides every second tick [s]."""
STEPS = round(TICK / Dynamics.dt)
"""Number of steps of physics in a tick."""


@dataclass(slots=True)
class Output:
    """Output of an advance in time: measurements, navigation solutions, changes of health by sensor."""

    measurements: list[Measurement] = field(default_factory=list)
    solutions: list[Solution] = field(default_factory=list)
    health: list[tuple[str, ConditionChange]] = field(default_factory=list)


class Vehicle(Protocol):
    """A drone between the steps of its world."""

    @property
    def t(self) -> float: ...
    def begin_tick(self, output: Output) -> None: ...
    def begin_step(self) -> None: ...
    def end_step(self, step: int) -> None: ...
    def end_tick(self, output: Output) -> None: ...


def advance_together(vehicles: Sequence[Vehicle], dynamics: Dynamics, until: float) -> list[Output]:
    """Advance all vehicles of one world to `until`, in whole ticks. Their order has no effect on their motion."""
    outputs = [Output() for _ in vehicles]
    both = tuple(zip(vehicles, outputs, strict=True))
    while vehicles[0].t + TICK <= until + 1e-9:
        for vehicle, output in both:
            vehicle.begin_tick(output)
        for step in range(STEPS):
            for vehicle in vehicles:
                vehicle.begin_step()
            dynamics.step()
            for vehicle in vehicles:
                vehicle.end_step(step)
        for vehicle, output in both:
            vehicle.end_tick(output)
    return outputs
