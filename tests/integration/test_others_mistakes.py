"""Mistakes that other frameworks made on the way between client and manager; docs/semantics.md lists them all."""

from __future__ import annotations

from skillwing.dsl import parse
from skillwing.services.bus import Answer, Answered, Refused
from skillwing.services.client.goal_handle import GoalHandle
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.mocking import MockRun, MockScript, make_mock_skill
from skillwing.services.mocking.skill import MockSkillNode
from skillwing.services.names import skill_process
from skillwing.services.protocol import ErrorCode, GoalStatus, InterruptGoal, Keys, State, decode, encode
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


def interrupted(robot: SkillsetInProcess, goal_id: str) -> str | None:
    """End of a goal by its manager for a client without the interface, or the refusal."""
    told: list[Answer] = []
    robot.bus.ask(KEYS.interrupt("drive"), encode(InterruptGoal(goal_id=goal_id, client="second")), told.append)
    robot.run_until(lambda: bool(told))
    match told:
        case [Answered(payload)]:
            terminal = decode(payload, GoalStatus).terminal
            return terminal.label if terminal else None
        case [Refused(error)]:
            return error.code
        case _:
            return None


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
    """Nav2 #6373: there a goal that has ended, or was refused, is cancelled by way of the one that runs."""
    robot = rover()
    first, second = client(robot, "first"), client(robot, "second")
    ended = started(robot, second)
    second.interrupt(ended)
    robot.run_until(lambda: ended.done)
    goal = started(robot, first)
    refused = started(robot, second)
    at_once = second.start("drive", {})
    second.interrupt(at_once)
    robot.run_until(lambda: at_once.done)
    labels = [each.terminal.label for each in (ended, refused, at_once) if each.terminal is not None]
    assert labels == ["IT", "BUSY", "BUSY"]
    # The interface sends nothing for what is over; other clients may, and for no id, which elsewhere means all of them.
    told = [interrupted(robot, goal_id) for goal_id in (ended.goal_id, refused.goal_id, "of-nobody", "")]
    assert told[:2] == ["IT", "BUSY"]
    assert told[2:] == [ErrorCode.UNKNOWN_GOAL, ErrorCode.BAD_REQUEST]
    robot.run(5.0)
    assert goal.state is State.RUNNING
    first.interrupt(goal)
    robot.run_until(lambda: goal.done)
    assert goal.terminal is not None
    assert goal.terminal.label == "IT"


def test_mistake_a_refusal_carries_no_reason() -> None:
    """Aerostack2 #420."""
    robot = rover()
    robot.start_skill("drive")
    turn = robot.start_skill("turn")
    turn.assert_ended("NR", failing=["free"], reason="wheels is TAKEN")


def test_mistake_a_live_process_is_taken_to_be_reachable() -> None:
    """zenoh #588, #2767: a token arrives before its queryable does, and a query comes back empty at once."""
    robot = rover(mocks=False)
    robot.bus.declare_alive(KEYS.alive(DRIVE))
    goal = robot.client.start("drive", {})
    robot.run(1.0)
    assert goal.terminal is None
    robot.network.attach(make_mock_skill(ROVER, "drive", MockScript(skills={"drive": (MockRun(delay=600.0),)})))
    robot.run_until(lambda: goal.state is State.RUNNING, 5.0)
