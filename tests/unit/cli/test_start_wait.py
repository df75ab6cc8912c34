"""What `skillwing start` says while a manager says nothing."""

from __future__ import annotations

import io

import pytest
from rich.console import Console

from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.client.goal_handle import GoalHandle
from skillwing.services.commands.start import SILENCE, wait_for
from skillwing.services.protocol import GoalStatus, State


@pytest.mark.parametrize(("answers_after", "told"), [(0.1, False), (SILENCE + 5.0, True)])
def test_a_silent_manager_is_told_of_while_it_is_waited_for(answers_after: float, told: bool) -> None:
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
