"""A command's connection to the running system.

with connect(robot) as system:
    states = system.ask(system.keys.resource_states, QueryStates(), ResourceStates)
"""

from __future__ import annotations

import contextlib
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from typing import Annotated

import typer

from skillwing.dsl import UnknownNameError
from skillwing.services.client.connection import Connection, find_target, open_connection
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.errors import RefusedError, UnansweredError
from skillwing.services.names import CLIENT
from skillwing.services.processes.process_monitor import Entry, entries_of
from skillwing.services.processes.process_state import ProcessState
from skillwing.services.processes.run_state import read_run_state
from skillwing.services.protocol import ErrorCode, GoalStatus, QueryGoal, QueryStates, ResourceStates
from skillwing.services.robot import find_robot
from skillwing.services.terminal.completion import running

RobotOption = Annotated[
    str | None,
    typer.Option(
        "--robot",
        "-r",
        metavar="NAME",
        help="Which running robot; needed if there are several.",
        autocompletion=running,
    ),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON.")]


class System(Connection):
    """A system that a command is connected to."""

    def make_interface(self, client: str = "cli", *, owns_goals: bool = False) -> SkillsetInterface:
        return super().make_interface(client, owns_goals=owns_goals)

    def goal(self, skill: str, goal_id: str | None = None) -> GoalStatus | None:
        """How a skill's goal is doing: that one, or the running, else the latest. None if nobody knows of one."""
        try:
            return self.ask_for_goal(skill, goal_id)
        except UnansweredError:
            return None

    def ask_for_goal(self, skill: str, goal_id: str | None = None) -> GoalStatus | None:
        """The same, None if there is no such goal. Raises UnansweredError if its manager says nothing."""
        try:
            return self.ask(self.keys.goal(skill), QueryGoal(goal_id=goal_id), GoalStatus)
        except RefusedError as error:
            if error.code is ErrorCode.UNKNOWN_GOAL:
                return None
            raise

    def entries(self, alive: Collection[str]) -> list[Entry]:
        """Every process and how it is, the known ones first: those that were started, as far as is known, else those
        of the robot's table. Then whoever else holds an alive token and is no client. alive: who holds one."""
        target = self.target
        state = None if target.pid is None else read_run_state(target.robot)
        known = target.processes if state is None else state.processes
        known = known or tuple(ProcessState(name=name) for name in self._table())
        names = {name for each in known for name in (each.name, *each.nodes)}
        others = sorted(name for name in alive if name not in names and not name.startswith(CLIENT))
        return entries_of((*known, *(ProcessState(name=name) for name in others)), alive)

    def _table(self) -> tuple[str, ...]:
        try:
            table = find_robot(self.target.robot)
        except UnknownNameError:
            return ()
        return tuple(spec.name for spec in (*table.functional_layer({}), *table.managers()))

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


@contextmanager
def connect(robot: str | None = None, *, wait_for_clock: bool = True) -> Iterator[System]:
    """Connect to the running system; raises as `find_target` and `open_connection` do."""
    with open_connection(find_target(robot), client="cli", wait_for_clock=wait_for_clock) as connection:
        yield System(connection.target, connection.bus, connection.skillset)
