"""A command's connection to the running system.

with connect(robot) as system:
    states = system.ask(system.keys.resource_states, QueryStates(), ResourceStates)
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Annotated, Any

import typer

from skillwing.dsl import UnknownNameError
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.client.connection import Connection, find_target, open_connection
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.client.target import Target
from skillwing.services.errors import NoReplyError, RefusedError
from skillwing.services.names import CLIENT
from skillwing.services.processes.process_monitor import ProcessStatus, process_statuses
from skillwing.services.processes.process_state import ProcessState
from skillwing.services.processes.run_options import run_options
from skillwing.services.processes.run_state import read_run_state, running_systems
from skillwing.services.protocol import (
    ErrorCode,
    GoalStatus,
    M,
    Message,
    QueryGoal,
    QueryStates,
    ReadyReport,
    ResourceStates,
    decode,
)
from skillwing.services.robot import find_robot
from skillwing.services.terminal.completion import inputs, running
from skillwing.services.terminal.robot_option import with_robot

RobotOption = Annotated[
    str | None,
    typer.Option(
        "--robot",
        "-r",
        metavar="NAME",
        help="Running robot; needed if there are several.",
        autocompletion=running,
    ),
]
InputsArgument = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="NAME=VALUE", help="Inputs, as in height=5 target=10,5,4 target.x=10.", autocompletion=inputs
    ),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON.")]


@dataclass
class System(Connection):
    """A system that a command is connected to. named: the command has chosen its robot by name."""

    named: bool = False

    def addressed(self, text: str) -> str:
        """A text whose commands in backticks choose this robot, where a command without `--robot` could not."""
        return addressed(text, self.target.robot, named=self.named)

    def ask(self, key: str, message: Message, reply: type[M]) -> M:
        """See `Connection.ask`. The help of a refusal is addressed to this robot."""
        try:
            return super().ask(key, message, reply)
        except RefusedError as refusal:
            help_ = self.addressed(refusal.help)
            raise RefusedError(refusal.code, refusal.message, help=help_, known=refusal.known) from refusal

    def make_interface(self, client: str = "cli", *, owns_goals: bool = False) -> SkillsetInterface:
        return super().make_interface(client, owns_goals=owns_goals)

    def goal(self, skill: str, goal_id: str | None = None) -> GoalStatus | None:
        """Status of a skill's goal: that one, or the running, else the latest. None without such a goal or answer."""
        try:
            return self.ask_for_goal(skill, goal_id)
        except NoReplyError:
            return None

    def ask_for_goal(self, skill: str, goal_id: str | None = None) -> GoalStatus | None:
        """The same, None without such a goal. Raises NoReplyError for a manager that does not answer."""
        try:
            return self.ask(self.keys.goal(skill), QueryGoal(goal_id=goal_id), GoalStatus)
        except RefusedError as error:
            if error.code is ErrorCode.UNKNOWN_GOAL:
                return None
            raise

    def ask_ready(
        self, interface: SkillsetInterface, skill: str, inputs: Mapping[str, Any] | None = None
    ) -> ReadyReport:
        """Answer to `SkillsetInterface.ask_ready`. Raises as that does, NoReplyError and RefusedError."""
        key = self.keys.resource_ready
        answer = self.wait_for_answer(key, lambda take: interface.ask_ready(skill, take, inputs))
        return decode(answer.payload, ReadyReport)

    def process_statuses(self, alive: Collection[str]) -> list[ProcessStatus]:
        """Status of every process. First those that were started, or else those of the robot's table.

        Then all other holders of an alive token that are no clients. alive: the holders of alive tokens.
        """
        target = self.target
        state = None if target.pid is None else read_run_state(target.robot)
        known = target.processes if state is None else state.processes
        known = known or tuple(ProcessState(name=name) for name in self._table())
        names = {name for each in known for name in (each.name, *each.nodes)}
        others = sorted(name for name in alive if name not in names and not name.startswith(CLIENT))
        return process_statuses((*known, *(ProcessState(name=name) for name in others)), alive)

    def _table(self) -> tuple[str, ...]:
        try:
            table = find_robot(self.target.table or self.target.robot)
        except UnknownNameError:
            return ()
        return tuple(spec.name for spec in (*table.functional_layer({}), *table.managers()))

    def alive(self) -> set[str]:
        """Names of the processes that hold a liveliness token."""
        prefix = self.keys.alive("")
        names: set[str] = set()
        watch = self.bus.watch_alive(self.keys.alive("**"), lambda key, alive: names.add(key.removeprefix(prefix)))
        # The router delivers its tokens before the next question. An answer to that question does not matter.
        with contextlib.suppress(NoReplyError, RefusedError):
            self.ask(self.keys.resource_states, QueryStates(), ResourceStates)
        watch.cancel()
        return names


def addressed(text: str, robot: str, *, named: bool) -> str:
    """A text whose commands in backticks choose this robot, if the command was given its name, or other systems of this
    user run.
    """
    return with_robot(text, robot if named or any(state.robot != robot for state in running_systems()) else None)


@contextmanager
def connect(
    robot: str | None = None, *, wait_for_clock: bool = True, beside: ZenohBus | None = None
) -> Iterator[System]:
    """Connect to the running system; raises as `find_target` and `open_connection` do. beside: as for the latter."""
    with open_connection(find_target(robot), client="cli", wait_for_clock=wait_for_clock, beside=beside) as connection:
        yield System(connection.target, connection.bus, connection.skillset, named=robot is not None)


def mission_context(target: Target, mission: str) -> dict[str, Any]:
    """Options of a mission that follow from the site of a running robot; empty for an unknown site.

    For a system that runs here they come from its run state. For another one, such as containers, they come from the
    environment, as its processes read it. Raises InvalidOptionError for an unknown site, and as `find_robot` does.
    """
    if target.pid is not None:
        state = read_run_state(target.robot)
        known = {} if state is None else state.mission_context
    else:
        known = {} if target.table is None else find_robot(target.table).mission_options(run_options(os.environ))
    return known.get(mission, {})
