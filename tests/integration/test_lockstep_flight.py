"""Real processes as fast as they keep up: no step of the loop over simulator and guidance is lost."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import closing
from itertools import pairwise
from pathlib import Path

import pytest

from skillwing.m600.robot import ROBOT
from skillwing.onboard.topics.flight import AUTOPILOT_SETPOINT, FLIGHT, AutopilotSetpoint, FlightState
from skillwing.onboard.topics.guidance import (
    GUIDANCE_COMMAND,
    GUIDANCE_STATUS,
    FlyTo,
    GuidanceCommand,
    GuidanceStatus,
    Motion,
    MotionState,
    TakeOff,
    YawMode,
)
from skillwing.onboard.topics.truth import TRUTH, Truth
from skillwing.services.bus import Answer, Answered
from skillwing.services.bus.clock import FollowedClock
from skillwing.services.bus.reading import message_reader
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.processes.launcher import Launcher
from skillwing.services.protocol import encode

PATIENCE = 90.0
STEP = 0.02
HEIGHT = 10.0
"""Flight height, above all obstacles [m]."""


class Flight:
    """Simulator and guidance as processes, with the sensors that they need here, and the client that commands them."""

    def __init__(self, bus: ZenohBus) -> None:
        self._bus = bus
        self._goals = 0
        self.setpoints: list[AutopilotSetpoint] = []
        self.truth: Truth | None = None
        self.state: FlightState | None = None
        self.failsafes: set[str] = set()
        self.guidance: GuidanceStatus | None = None
        bus.subscribe(AUTOPILOT_SETPOINT, message_reader(AutopilotSetpoint, self.setpoints.append))
        bus.subscribe(TRUTH, message_reader(Truth, self._on_truth))
        bus.subscribe(FLIGHT, message_reader(FlightState, self._on_state))
        bus.subscribe(GUIDANCE_STATUS, message_reader(GuidanceStatus, self._on_guidance))

    def fly(self, motion: Motion) -> None:
        """Carry out a motion to its end."""
        self._goals += 1
        goal = f"goal-{self._goals}"
        command = encode(GuidanceCommand(goal_id=goal, token=self._goals, motion=motion))
        answers: list[Answer] = []
        self._bus.ask(GUIDANCE_COMMAND, command, answers.append)
        assert self._bus.run_until(lambda: bool(answers), PATIENCE)
        assert isinstance(answers[0], Answered), answers
        assert self._bus.run_until(lambda: self._is_done(goal), PATIENCE), self.guidance

    def until_ready(self) -> None:
        assert self._bus.run_until(
            lambda: self.state is not None and self.state.home_valid and self.guidance is not None, PATIENCE
        )

    def _is_done(self, goal: str) -> bool:
        body = self.guidance.body if self.guidance is not None else None
        return body is not None and body.goal_id == goal and body.state is MotionState.DONE

    def _on_truth(self, truth: Truth) -> None:
        self.truth = truth

    def _on_state(self, state: FlightState) -> None:
        self.state = state
        if state.failsafe:
            self.failsafes.add(state.failsafe)

    def _on_guidance(self, status: GuidanceStatus) -> None:
        self.guidance = status


@pytest.fixture
def flight(tmp_path: Path) -> Iterator[Flight]:
    sim, guidance, *_ = ROBOT.functional_layer({"seed": 1, "speed": 0.0})
    sim.options["sensors"] = ("imu", "range", "gnss")
    with Launcher(ROBOT.name, ROBOT.skillset.stem, tmp_path, clock="robot") as launcher:
        launcher.start([sim, guidance])
        # The simulator waits for this client too, so that it misses no step.
        with closing(ZenohBus("pilot", ROBOT.name, launcher.endpoint, FollowedClock(lag=0.0))) as bus:
            yield Flight(bus)


@pytest.mark.slow
def test_the_simulator_waits_for_guidance_at_every_step(flight: Flight) -> None:
    target = (20.0, 0.0, HEIGHT)
    flight.until_ready()
    flight.fly(TakeOff(height=HEIGHT, speed=3.0))
    flight.setpoints.clear()
    flight.fly(FlyTo(target=target, speed=5.0, nose=YawMode.FREE))
    times = [setpoint.t for setpoint in flight.setpoints]
    assert len(times) > 4.0 / STEP
    assert {round(later - sooner, 6) for sooner, later in pairwise(times)} == {STEP}
    assert flight.failsafes == set()
    assert flight.truth is not None
    assert math.dist(flight.truth.position, target) < 0.5
