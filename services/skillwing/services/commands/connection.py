"""A command's connection to the running system.

with connect(robot) as system:
    states = system.ask(system.keys.resource_states, QueryStates(), ResourceStates)
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import typer

from skillwing.dsl import load
from skillwing.dsl.model import Skillset
from skillwing.services.bus import Answer, Answered, Refused
from skillwing.services.bus.clock import FollowedClock, WallClock
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.bus.zenoh_session import RouterUnreachableError
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.commands.exit_codes import NoSystemError
from skillwing.services.errors import RefusedError, SkillwingError
from skillwing.services.processes.run_state import read_run_state, running_systems
from skillwing.services.protocol import (
    ErrorCode,
    GoalStatus,
    Keys,
    M,
    Message,
    QueryGoal,
    QueryStates,
    ResourceStates,
    decode,
    encode,
)
from skillwing.services.robot import ClockKind, find_robot

CONNECT_TIMEOUT = 3.0
ANSWER_TIMEOUT = 2.0
READY_TIMEOUT = 5.0

RobotOption = Annotated[
    str | None, typer.Option("--robot", "-r", metavar="NAME", help="Which running robot; needed if there are several.")
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON.")]


class UnansweredError(SkillwingError):
    """A process of the system does not answer. key: what was asked."""

    def __init__(self, key: str) -> None:
        self.key = key
        super().__init__(f"Nobody answers at `{key}`. See what is running with `skillwing status`.")


@dataclass(frozen=True, slots=True)
class Target:
    """A system to talk to. Where it was found by the environment, pid and run_dir are None."""

    robot: str
    endpoint: str
    skillset: Path
    clock: ClockKind
    pid: int | None = None
    run_dir: Path | None = None
    mock: bool = False


@dataclass
class System:
    """A system that a command is connected to."""

    target: Target
    bus: ZenohBus
    skillset: Skillset
    keys: Keys = field(init=False)

    def __post_init__(self) -> None:
        self.keys = Keys(self.skillset.name)

    def ask(self, key: str, message: Message, reply: type[M]) -> M:
        """Ask and wait for the reply. Raises RefusedError, or UnansweredError if there is none."""
        return decode(self.wait_for_answer(key, lambda take: self.bus.ask(key, encode(message), take)).payload, reply)

    def wait_for_answer(self, key: str, ask: Callable[[Callable[[Answer], None]], None]) -> Answered:
        """Call `ask` with a callback and wait until that is called. Raises as `ask` does; `key` is for the error."""
        answers: list[Answer] = []
        ask(answers.append)
        self.bus.run_until(lambda: bool(answers), 2 * ANSWER_TIMEOUT)
        match answers:
            case [Answered() as answer]:
                return answer
            case [Refused(error)]:
                raise RefusedError(error.code, error.message, help=error.help, known=error.known)
            case _:
                raise UnansweredError(key)

    def make_interface(self, client: str = "cli") -> SkillsetInterface:
        """The skillset's interface, its resource states known. Raises UnansweredError."""
        interface = SkillsetInterface(self.bus, self.skillset, client=client)
        if not self.bus.run_until(lambda: interface.ready, READY_TIMEOUT):
            raise UnansweredError(self.keys.resource_states)
        return interface

    def goal(self, skill: str, goal_id: str | None = None) -> GoalStatus | None:
        """How a skill's goal is doing: that one, or the running, else the latest. None if there is no such goal."""
        try:
            return self.ask(self.keys.goal(skill), QueryGoal(goal_id=goal_id), GoalStatus)
        except UnansweredError:
            return None
        except RefusedError as error:
            if error.code is ErrorCode.UNKNOWN_GOAL:
                return None
            raise

    def alive(self) -> set[str]:
        """The processes that hold a liveliness token, by name."""
        prefix = self.keys.alive("")
        names: set[str] = set()
        watch = self.bus.watch_alive(self.keys.alive("**"), lambda key, alive: names.add(key.removeprefix(prefix)))
        # The router names the tokens it knows before it passes on what is asked next, be that answered or not.
        with contextlib.suppress(UnansweredError, RefusedError):
            self.ask(self.keys.resource_states, QueryStates(), ResourceStates)
        watch.cancel()
        return names


def find_target(robot: str | None) -> Target:
    """The system that SKILLWING_CONNECT and SKILLWING_ROBOT name, or the one that runs here.

    robot: its name, None if there is only one. Raises NoSystemError.
    """
    endpoint = os.environ.get("SKILLWING_CONNECT")
    if endpoint:
        table = find_robot(robot or os.environ.get("SKILLWING_ROBOT") or "m600")
        return Target(table.name, endpoint, table.skillset, table.clock)
    systems = running_systems() if robot is None else tuple(filter(None, [read_run_state(robot)]))
    match systems:
        case ():
            which = f" of `{robot}`" if robot else ""
            raise NoSystemError(f"No system{which} is running. Start one with `skillwing up`.")
        case (state,):
            return Target(
                state.robot,
                state.endpoint,
                Path(state.skillset),
                state.clock,
                pid=state.pid,
                run_dir=Path(state.run_dir),
                mock=state.mock,
            )
        case _:
            names = ", ".join(f"`{state.robot}`" for state in systems)
            raise NoSystemError(f"Several systems are running: {names}. Choose one with --robot NAME.")


@contextmanager
def connect(robot: str | None = None, *, wait_for_clock: bool = True) -> Iterator[System]:
    """Connect to the running system.

    Raises NoSystemError where there is none. With `wait_for_clock` its time is known then, and a SkillwingError says
    so if its clock is silent.
    """
    target = find_target(robot)
    skillset = load(target.skillset)
    clock = FollowedClock() if target.clock == "robot" else WallClock()
    try:
        bus = ZenohBus(f"cli-{os.getpid()}", target.robot, target.endpoint, clock, CONNECT_TIMEOUT)
    except RouterUnreachableError as error:
        raise NoSystemError(str(error)) from error
    try:
        if wait_for_clock and isinstance(clock, FollowedClock) and not bus.run_until(clock.has_started, READY_TIMEOUT):
            raise SkillwingError("Robot time does not pass: nobody publishes the clock. Look at `skillwing status`.")
        yield System(target, bus, skillset)
    finally:
        bus.close()
