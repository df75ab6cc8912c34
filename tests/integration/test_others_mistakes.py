"""Mistakes that other frameworks made on the way between client and manager; docs/semantics.md lists them all."""

from __future__ import annotations

from skillwing.dsl import parse
from skillwing.services.client.goal_handle import GoalHandle
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.mocking import MockRun, MockScript, make_mock_skill
from skillwing.services.mocking.skill import MockSkillNode
from skillwing.services.names import skill_process
from skillwing.services.protocol import Keys, State
from skillwing.services.testing import SkillsetInProcess

ROVER = parse(
    """
    skillset rover {
        resource wheels { initial FREE  FREE -> TAKEN  TAKEN -> FREE }
        skill drive {
            effect { take: wheels -> TAKEN  release: wheels -> FREE }
            precondition { free: resource=(wheels == FREE)  success take }
            interrupt { apply=release timeout=5.0 }
            result { THERE: apply=release }
        }
        skill turn {
            effect { take: wheels -> TAKEN  release: wheels -> FREE }
            precondition { free: resource=(wheels == FREE)  success take }
            interrupt { apply=release timeout=5.0 }
            result { TURNED: apply=release }
        }
    }
    """,
    "rover.skillset",
)
KEYS = Keys("rover")
DRIVE = skill_process("drive")


def rover(*, mocks: bool = True) -> SkillsetInProcess:
    return SkillsetInProcess(ROVER, script=MockScript(skills={"drive": (MockRun(delay=600.0),)}), mocks=mocks)


def client(robot: SkillsetInProcess, name: str) -> SkillsetInterface:
    return SkillsetInterface(robot.network.bus(name), ROVER, client=name)


def started(robot: SkillsetInProcess, interface: SkillsetInterface) -> GoalHandle:
    goal = interface.start("drive", {})
    robot.run_until(lambda: goal.state in (State.RUNNING, State.TERMINATED))
    return goal


def test_mistake_a_late_acknowledgement_leaves_two_controllers_at_once() -> None:
    """Nav2 #4278, #4659: the client gives up, the server begins all the same."""
    robot = rover()
    manager, _ = robot._running[DRIVE]
    assert isinstance(manager, MockSkillNode)
    manager._stop_listening()
    goal = robot.client.start("drive", {})
    robot.run_until(lambda: goal.done, 60.0)
    assert goal.terminal is not None
    assert goal.terminal.label == "LOST"
    # The manager wakes up and carries out what has been waiting for it, a start among that.
    manager._listening = True
    for callback in manager._unheard:
        callback()
    robot.run(5.0)
    robot.assert_states(wheels="FREE", within=0.0)
    robot.start_skill("turn").assert_ended("S_TURNED")


def test_mistake_to_cancel_all_of_ones_own_goals_ends_those_of_others() -> None:
    """Nav2 #6373."""
    robot = rover()
    goal = started(robot, client(robot, "first"))
    second = client(robot, "second")
    refused = started(robot, second)
    second.interrupt(refused)
    robot.run(5.0)
    assert refused.terminal is not None
    assert refused.terminal.label == "BUSY"
    assert goal.state is State.RUNNING


def test_mistake_a_refusal_carries_no_reason() -> None:
    """Aerostack2 #420."""
    robot = rover()
    robot.start_skill("drive")
    turn = robot.start_skill("turn")
    turn.assert_ended("NR", failing=["free"], reason="wheels is TAKEN")


def test_mistake_whoever_is_alive_is_taken_to_be_reachable() -> None:
    """zenoh #588, #2767: a token arrives before its queryable does, and a query comes back empty at once."""
    robot = rover(mocks=False)
    robot.bus.declare_alive(KEYS.alive(DRIVE))
    goal = robot.client.start("drive", {})
    robot.run(1.0)
    assert goal.terminal is None
    robot.network.attach(make_mock_skill(ROVER, "drive", MockScript(skills={"drive": (MockRun(delay=600.0),)})))
    robot.run_until(lambda: goal.state is State.RUNNING, 5.0)
