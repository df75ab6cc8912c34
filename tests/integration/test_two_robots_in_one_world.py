"""Two robots whose drones fly in one simulator, over Zenoh: one owner of time, which neither of them can stop."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, closing
from dataclasses import replace
from pathlib import Path

import pytest

from skillwing.m600.robot import ROBOT
from skillwing.onboard.topics.guidance import (
    GUIDANCE_COMMAND,
    GUIDANCE_STATUS,
    GuidanceCommand,
    GuidanceStatus,
    Motion,
    MotionState,
    TakeOff,
)
from skillwing.onboard.topics.truth import TRUTH, Truth
from skillwing.services.access.identity_files import process_identity
from skillwing.services.access.key_store import KeyStore
from skillwing.services.access.robots import robot_access
from skillwing.services.bus import Answer, Answered
from skillwing.services.bus.clock import FollowedClock
from skillwing.services.bus.reading import message_reader
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.processes.launcher import Launcher
from skillwing.services.processes.router import LOOPBACK_WITH_KEYS
from skillwing.services.protocol import CLOCK_KEY, ClockTick, encode

PATIENCE = 120.0
HEIGHT = 3.0
SENSORS = ("imu", "range", "gnss")
ROBOTS = ("left", "right")
LAYERS = {
    "left": {"seed": 1, "speed": 0.0, "robots": {robot: {} for robot in ROBOTS}},
    "right": {"seed": 1, "speed": 0.0, "world_of": "left"},
}


class Client:
    """Commands guidance of one robot, and receives its truth and its time. No clock waits for it."""

    def __init__(self, bus: ZenohBus) -> None:
        self.bus = bus
        self.truth: list[Truth] = []
        self.ticks: list[float] = []
        self.guidance: GuidanceStatus | None = None
        bus.subscribe(TRUTH, message_reader(Truth, self.truth.append))
        bus.subscribe(CLOCK_KEY, message_reader(ClockTick, self._on_tick))
        bus.subscribe(GUIDANCE_STATUS, message_reader(GuidanceStatus, self._on_guidance))

    def command(self, goal: str, token: int, motion: Motion) -> Answer:
        answers: list[Answer] = []
        message = encode(GuidanceCommand(goal_id=goal, token=token, motion=motion))
        self.bus.ask(GUIDANCE_COMMAND, message, answers.append)
        assert self.bus.run_until(lambda: bool(answers), PATIENCE)
        return answers[0]

    def take_off(self) -> None:
        """Ask again while guidance does not know the home point yet."""
        token = 1
        while not isinstance(self.command("up", token, TakeOff(height=HEIGHT, speed=2.0)), Answered):
            token += 1
            before = len(self.ticks)
            assert token < 100
            assert self.bus.run_until(lambda known=before: len(self.ticks) > known + 20, PATIENCE)

    def is_up(self) -> bool:
        body = self.guidance.body if self.guidance is not None else None
        return body is not None and body.goal_id == "up" and body.state is MotionState.DONE

    def _on_tick(self, tick: ClockTick) -> None:
        if tick.complete:
            self.ticks.append(tick.t)

    def _on_guidance(self, status: GuidanceStatus) -> None:
        self.guidance = status


class TwoRobots:
    """Simulator and guidance of the left robot, guidance of the right one, and a client of each."""

    def __init__(self, stack: ExitStack, folder: Path, keys: Path) -> None:
        self.launchers: dict[str, Launcher] = {}
        self.clients: dict[str, Client] = {}
        for robot in ROBOTS:
            specs = [spec for spec in ROBOT.functional_layer(LAYERS[robot]) if spec.name in ("sim", "guidance")]
            if robot == "left":
                specs[0].options["sensors"] = SENSORS
            router = self.launchers["left"].endpoint if self.launchers else None
            launcher = stack.enter_context(
                Launcher(robot, ROBOT.skillset.stem, folder / robot, clock="robot", router=router, keys=keys)
            )
            self.launchers[robot] = launcher
            if router is None:
                launcher.start_router(LOOPBACK_WITH_KEYS)
            launcher.start(specs)
            # The manager of `takeoff` may command guidance.
            pilot = process_identity(keys, robot, "skill/takeoff")
            bus = stack.enter_context(
                closing(ZenohBus("pilot", robot, launcher.endpoint, FollowedClock(), identity=pilot))
            )
            self.clients[robot] = Client(bus)


@pytest.fixture(scope="module")
def robots(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TwoRobots]:
    """Both robots, with keys: the simulator of `left` may work at `right`, and nothing else may."""
    folder = tmp_path_factory.mktemp("two")
    keys = folder / "keys"
    store = KeyStore.init(keys, ["127.0.0.1"])
    store.add_robot(robot_access(replace(ROBOT, name="left"), works_at=["right"]))
    store.add_robot(robot_access(replace(ROBOT, name="right")))
    with ExitStack() as stack:
        yield TwoRobots(stack, folder, keys)


@pytest.mark.slow
def test_both_drones_fly_at_the_same_time_and_the_time_of_one_goes_on_without_the_other(robots: TwoRobots) -> None:
    left, right = (robots.clients[robot] for robot in ROBOTS)
    for client in (left, right):
        client.take_off()
    for client in (left, right):
        assert client.bus.run_until(client.is_up, PATIENCE)
        assert abs(client.truth[-1].position[2] - HEIGHT) < 0.5
        assert client.truth[-1].collisions == 0
    where = {truth.t: truth.separation for truth in left.truth}
    both = [truth for truth in right.truth if truth.t in where]
    assert len(both) > 10
    assert all(truth.separation == where[truth.t] for truth in both)
    assert left.truth[-1].position[1] > 3.0 > -3.0 > right.truth[-1].position[1]
    # A slow client may miss ticks, but both robots are at the same times.
    assert len(set(left.ticks) & set(right.ticks)) > 10

    robots.launchers["right"].stop()
    reached = left.ticks[-1]
    assert left.bus.run_until(lambda: left.ticks[-1] > reached + 10.0, PATIENCE)
    assert left.is_up()


def test_the_table_gives_the_simulator_to_one_robot_and_none_to_the_other() -> None:
    names = [[spec.name for spec in replace(ROBOT, name=robot).functional_layer(LAYERS[robot])] for robot in ROBOTS]
    assert names[0] == ["sim", *names[1]]
