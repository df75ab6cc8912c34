"""`skillwing start` with a silent manager, and Ctrl-C while it follows a goal."""

from __future__ import annotations

import io
import re
import signal
from contextlib import nullcontext
from pathlib import Path

import pytest
from cli_page import PAGE
from rich.console import Console

from skillwing.dsl import parse
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.client.goal_handle import GoalHandle
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.commands.start import SILENCE, follow_to_end, wait_for
from skillwing.services.mocking import MockScript, make_mock_managers
from skillwing.services.processes.in_process import RobotInProcess
from skillwing.services.processes.stop_signal import SAME_REQUEST
from skillwing.services.protocol import Ending, GoalStatus, State, Terminal
from skillwing.services.robot import Robot


@pytest.mark.parametrize(("answers_after", "told"), [(0.1, False), (SILENCE + 5.0, True)])
def test_a_silent_manager_is_reported_during_the_wait(answers_after: float, told: bool) -> None:
    bus, goal, output = InProcessNetwork().bus("cli"), GoalHandle("1", "park"), io.StringIO()

    def answer() -> None:
        goal.advance(GoalStatus(goal_id="1", skill="park", state=State.RUNNING, t=bus.now()))

    bus.after(answers_after, answer)
    wait_for(bus, goal, lambda: goal.state is State.RUNNING, Console(file=output, width=200))
    assert goal.state is State.RUNNING
    assert ("The manager of `park` is alive and does not answer" in output.getvalue()) is told


def test_nothing_is_printed_among_json() -> None:
    bus, goal = InProcessNetwork().bus("cli"), GoalHandle("1", "park")
    wait_for(bus, goal, lambda: goal.done, None)
    assert bus.now() >= SILENCE


@pytest.mark.parametrize(("apart", "left"), [(0.0, False), (0.9 * SAME_REQUEST, False), (1.1 * SAME_REQUEST, True)])
def test_ctrl_c_interrupts_the_goal_once_and_another_wish_leaves_it(apart: float, left: bool) -> None:
    bus, goal, output = InProcessNetwork().bus("cli"), GoalHandle("1", "park"), io.StringIO()
    interrupted: list[GoalHandle] = []

    def end() -> None:
        terminal = Terminal(ending=Ending.INTERRUPTED, reason="As was asked.")
        goal.advance(GoalStatus(goal_id="1", skill="park", state=State.TERMINATED, t=bus.now(), terminal=terminal))

    for t in (1.0, 1.0 + apart):
        bus.after(t, lambda: signal.raise_signal(signal.SIGINT))
    bus.after(5.0, end)
    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt) if left else nullcontext():
        follow_to_end(bus, goal, interrupted.append, Console(file=output, width=200))
    assert interrupted == [goal]
    assert goal.done is not left
    assert output.getvalue().count("Interrupting;") == 1
    assert signal.getsignal(signal.SIGINT) == before


GATE = parse("skillset gate { skill wait { result { success DONE } } }")
STATES = re.compile(r"^ +[0-9.]+ s  ([A-Z]+)", re.MULTILINE)


def test_a_followed_goal_goes_through_the_states_of_the_page() -> None:
    output = io.StringIO()
    with RobotInProcess(Robot(GATE.name, Path("gate.skillset"), {})) as robot:
        for manager in make_mock_managers(GATE, MockScript()):
            robot.attach(manager)
        bus = robot.network.bus("cli", GATE.name)
        interface = SkillsetInterface(bus, GATE, client="cli")
        goal = interface.start("wait", {})
        follow_to_end(bus, goal, interface.interrupt, Console(file=output, width=200))
    example = PAGE.read_text(encoding="utf-8").partition("## A flight by hand")[2].split("```")[1]
    assert list(dict.fromkeys(STATES.findall(output.getvalue()))) == list(dict.fromkeys(STATES.findall(example)))
