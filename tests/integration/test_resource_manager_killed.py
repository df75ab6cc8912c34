"""kill -9 of the real resource manager in each state of a goal. The managers and the client are not restarted."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from skillwing.services.bus import Answer, Answered
from skillwing.services.journal.journal import look_into
from skillwing.services.names import JOURNAL_FILE, RESOURCE_MANAGER
from skillwing.services.processes.launcher import StartError
from skillwing.services.processes.lifetime import EXIT_REPLACED
from skillwing.services.protocol import QueryStates, ResourceStates, State, decode, encode
from skillwing.services.testing import SkillsetProcesses

pytestmark = pytest.mark.slow

SKILLSET = """
skillset digger {
    resource engine { initial ON  extern ON -> OFF  extern OFF -> ON }
    resource arm { initial FREE  FREE -> USED  USED -> FREE }
    skill dig {
        effect { take: arm -> USED  free: arm -> FREE }
        precondition { free: resource=(arm == FREE)  success take }
        invariant { engine: resource=(engine == ON) violation=free }
        interrupt { apply=free timeout=5.0 }
        result { success DONE: apply=free }
    }
}
"""
SCRIPT = """
[skill.dig]
forever = true
"""
PATIENCE = 20.0
COFFEE = b"spilt coffee" * 1000


@pytest.fixture(scope="module")
def digger(mocked: Callable[[str, str], SkillsetProcesses]) -> SkillsetProcesses:
    return mocked(SKILLSET, SCRIPT)


def test_killed_while_a_goal_asks_for_its_grant(digger: SkillsetProcesses) -> None:
    digger.kill(RESOURCE_MANAGER)
    goal = digger.send_start("dig")
    digger.run_until(lambda: goal.state is State.VALIDATING, PATIENCE, "the start")
    digger.restart(RESOURCE_MANAGER)
    digger.run_until(lambda: goal.state is State.RUNNING, PATIENCE, "the grant")
    goal.interrupt()
    goal.assert_ended("IT", within=PATIENCE)
    digger.assert_states(arm="FREE")


def test_killed_while_a_goal_runs(digger: SkillsetProcesses) -> None:
    goal = digger.start_skill("dig")
    digger.kill(RESOURCE_MANAGER)
    digger.restart(RESOURCE_MANAGER)
    # Longer than any lease and debounce: the resource manager must know the goal as before.
    digger.run(3.0)
    assert goal.state is State.RUNNING
    digger.assert_states(arm="USED")
    digger.trigger("engine", "OFF")
    goal.assert_ended("RI", invariant="engine", within=PATIENCE)
    digger.assert_states(arm="FREE")
    digger.trigger("engine", "ON")


def test_killed_while_a_goal_gives_back_what_it_holds(digger: SkillsetProcesses) -> None:
    goal = digger.start_skill("dig")
    digger.kill(RESOURCE_MANAGER)
    goal.interrupt()
    digger.run_until(lambda: goal.state is State.INTERRUPTING, PATIENCE, "the interrupt")
    digger.restart(RESOURCE_MANAGER)
    goal.assert_ended("IT", within=PATIENCE)
    digger.assert_states(arm="FREE", within=PATIENCE)


def test_killed_right_after_an_answer_it_has_forgotten_nothing(digger: SkillsetProcesses) -> None:
    for target in ("OFF", "ON", "OFF", "ON"):
        answers: list[Answer] = []
        digger.client.trigger("engine", target, answers.append)
        digger.run_until(lambda answers=answers: bool(answers), PATIENCE, "the answer")
        (answer,) = answers
        assert isinstance(answer, Answered)
        acknowledged = decode(answer.payload, ResourceStates)
        digger.kill(RESOURCE_MANAGER)
        digger.restart(RESOURCE_MANAGER)
        assert states_of(digger) == (acknowledged.step + 1, acknowledged.states), "its return is a step as well"


def test_a_journal_that_it_cannot_read_is_refused_and_left_alone(digger: SkillsetProcesses) -> None:
    journal = digger.launcher.run_dir / JOURNAL_FILE
    digger.kill(RESOURCE_MANAGER)
    _, kept = look_into(journal)
    files = [journal, journal.with_name(f"{JOURNAL_FILE}-wal")]
    whole = [file.read_bytes() for file in files]
    for file in files:
        file.write_bytes(COFFEE)
    with pytest.raises(StartError, match=r"exit code 78[\s\S]*is damaged[\s\S]*Move it away"):
        digger.restart(RESOURCE_MANAGER)
    assert journal.read_bytes() == COFFEE
    for file, content in zip(files, whole, strict=True):
        file.write_bytes(content)
    digger.restart(RESOURCE_MANAGER)
    assert states_of(digger)[1] == {each.resource: each.state for each in kept.resources}


def test_one_that_is_started_by_hand_beside_it_gives_way(digger: SkillsetProcesses, tmp_path: Path) -> None:
    """A process with a journal of its own, which knows no grants, gives way too."""
    goal = digger.start_skill("dig")
    launcher = digger.launcher
    options = {
        "skillset": str(launcher.run_dir.parent / "digger.skillset"),
        "robot": "digger",
        "journal": str(tmp_path / "other.sqlite"),
    }
    stray = subprocess.run(
        [
            *(sys.executable, "-m", "skillwing.services.processes.node_host", "--name", RESOURCE_MANAGER),
            *("--factory", "skillwing.services.managers.resource_manager:make_resource_manager"),
            *("--options", json.dumps(options), "--connect", launcher.endpoint, "--robot", "digger"),
        ],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    assert stray.returncode == EXIT_REPLACED
    assert "Another resource manager is active. End that one first" in stray.stderr
    assert "Traceback" not in stray.stderr
    assert goal.state is State.RUNNING
    digger.assert_states(arm="USED")
    goal.interrupt()
    goal.assert_ended("IT", within=PATIENCE)


def states_of(digger: SkillsetProcesses) -> tuple[int, dict[str, str]]:
    answers: list[Answer] = []

    def ask() -> None:
        digger.bus.ask("digger/resource/state", encode(QueryStates()), take)

    def take(answer: Answer) -> None:
        if isinstance(answer, Answered):
            answers.append(answer)
        else:
            digger.bus.after(0.05, ask, wall=True)

    ask()
    digger.run_until(lambda: bool(answers), PATIENCE, "the states")
    (answer,) = answers
    assert isinstance(answer, Answered)
    states = decode(answer.payload, ResourceStates)
    return states.step, states.states
