"""A skillset in ONERA's robot language runs as mocks without a change."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from skillwing.dsl import load
from skillwing.services.bus import Answer
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.client.interface import GoalHandle, SkillsetInterface
from skillwing.services.mocking import MockRun, MockScript, make_mock_managers

FORKLIFT = load(Path(__file__).parents[2] / "examples" / "onera" / "forklift.rl")
TARGET = {"target": {}, "speed": 1.0}


class Forklift:
    """All managers of the forklift as mocks, and a client."""

    def __init__(self, **runs: MockRun) -> None:
        self.network = InProcessNetwork()
        script = MockScript(skills={skill: (run,) for skill, run in runs.items()})
        for node in make_mock_managers(FORKLIFT, script):
            self.network.attach(node)
        self.client = SkillsetInterface(self.network.bus("client"), FORKLIFT, client="client")
        self.network.run_for(0.1)

    def start(self, skill: str, inputs: dict[str, Any]) -> GoalHandle:
        goal = self.client.start(skill, inputs)
        self.network.run_for(0.5)
        return goal

    def ends(self, goal: GoalHandle) -> str:
        assert self.network.run_until(lambda: goal.done, 60.0)
        assert goal.terminal is not None
        self.network.run_for(0.1)
        return goal.terminal.label

    def trigger(self, resource: str, target: str) -> None:
        answers: list[Answer] = []
        self.client.trigger(resource, target, answers.append)
        assert self.network.run_until(lambda: bool(answers), 5.0)


def test_a_skill_takes_its_resource_and_gives_it_back() -> None:
    forklift = Forklift(drive_to=MockRun(delay=2.0, result="arrived"))
    goal = forklift.start("drive_to", TARGET)
    assert forklift.client.state("drive") == "Used"
    assert forklift.ends(goal) == "S_arrived"
    assert forklift.client.state("drive") == "Free"


@pytest.mark.parametrize(("resource", "state"), [("operator", "OnBoard"), ("bumper", "Pressed")])
def test_an_invariant_ends_the_goal_when_an_event_or_the_functional_layer_breaks_it(resource: str, state: str) -> None:
    forklift = Forklift(drive_to=MockRun(forever=True))
    goal = forklift.start("drive_to", TARGET)
    forklift.trigger(resource, state)
    assert forklift.ends(goal) == "RI"
    assert forklift.client.state("drive") == "Free"
    assert forklift.ends(forklift.start("drive_to", TARGET)) == "NR"


def test_an_interruption_applies_the_inline_effect() -> None:
    forklift = Forklift(lift=MockRun(forever=True))
    goal = forklift.start("lift", {"pallet": {}})
    assert forklift.client.states["forks"] == "Moving"
    forklift.client.interrupt(goal)
    assert forklift.ends(goal) == "IT"
    assert (forklift.client.state("forks"), forklift.client.state("drive")) == ("Empty", "Free")


def test_an_effect_with_two_changes_makes_both() -> None:
    forklift = Forklift(lift=MockRun(result="lifted"))
    assert forklift.ends(forklift.start("lift", {"pallet": {}})) == "S_lifted"
    assert (forklift.client.state("forks"), forklift.client.state("drive")) == ("Loaded", "Free")
