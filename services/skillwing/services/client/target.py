"""Systems that a process may connect to, and the search for one at an endpoint.

A robot elsewhere tells its skillset, its clock and its rescue goal itself. So its name is enough for every command.
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path

import msgspec

from skillwing.dsl import SkillsetError, load
from skillwing.dsl.model import UnknownNameError
from skillwing.dsl.suggest import listed
from skillwing.dsl.whole_files import write_whole
from skillwing.services.bus import Answered, Refused, Topology
from skillwing.services.client.joining import find_robots, join
from skillwing.services.client.retry import accepted, ask_until_answered
from skillwing.services.errors import InvalidOptionError, NoReplyError, NoSystemError, SeveralSystemsError
from skillwing.services.names import RESOURCE_MANAGER
from skillwing.services.processes.process_state import ProcessState
from skillwing.services.processes.run_state import runtime_dir
from skillwing.services.protocol import Keys, QueryRobot, RobotDescription, decode, encode
from skillwing.services.rescue_goal import RescueGoal
from skillwing.services.robot import ClockKind, Robot, find_robot, robot_names

CONNECT = "SKILLWING_CONNECT"
"""Environment variable with the endpoint of a system elsewhere."""
TABLE = "SKILLWING_ROBOT"
"""Environment variable with the table of that system."""
DEFAULT_ROBOT = "m600"
READY_TIMEOUT = 5.0
ROBOT_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")
"""Name that can be a part of keys and file names."""


@dataclass(frozen=True, slots=True)
class Target:
    """A system to connect to. pid, run_dir: None if it was not found by its run state.

    topology: how its processes meet; a process from outside is always a client of the router. listens: address of its
    own router, as others reach it. keys: folder of its certificates. processes: the started ones with their state;
    empty if only the robot's table is known. rescue_goal, without_goals, shared: as in that table. table: its
    reference, as `find_robot` takes it; None if no table is known.
    """

    robot: str
    endpoint: str
    skillset: Path
    clock: ClockKind
    pid: int | None = None
    run_dir: Path | None = None
    mock: bool = False
    topology: Topology = "router"
    listens: str = ""
    keys: Path | None = None
    processes: tuple[ProcessState, ...] = ()
    rescue_goal: RescueGoal | None = None
    without_goals: str = ""
    shared: bool = False
    table: str | None = None


def find_target_at(endpoint: str, robot: str | None = None, table: str | None = None) -> Target:
    """The system of a robot at an endpoint; robot and table as for `find_target`.

    A robot whose resource manager is away is known by the table of SKILLWING_ROBOT, by `table`, or by that of its name.
    Raises NoSystemError, at once for a router that does not answer, SeveralSystemsError, and as `find_robot` does.
    """
    known = os.environ.get(TABLE)
    if robot is not None and not ROBOT_NAME.fullmatch(robot):
        return target_of_table(endpoint, None, robot)
    if robot is None and known:
        return target_of_table(endpoint, None, known)
    try:
        name, skillset = _chosen(endpoint, robot, table)
        return _told_target(endpoint, name, skillset)
    except (NoSystemError, NoReplyError) as error:
        if isinstance(error, SeveralSystemsError) or (isinstance(error, NoSystemError) and error.endpoint is not None):
            raise
        try:
            return target_of_table(endpoint, robot, known or table or robot or DEFAULT_ROBOT)
        except UnknownNameError:
            raise error from None


def target_of_table(endpoint: str, robot: str | None, table: str) -> Target:
    """The system that should be at an endpoint, by a table alone. robot: its name, else that of the table."""
    known = find_robot(table)
    return Target(
        *(robot or known.name, endpoint, known.skillset, known.clock),
        rescue_goal=known.rescue_goal,
        without_goals=known.without_goals,
        shared=known.shared,
        table=table,
    )


def _chosen(endpoint: str, robot: str | None, table: str | None) -> tuple[str, str]:
    """Name and skillset's name of the robot at a router that is meant."""
    present = find_robots(endpoint, robot)
    if robot is None and table is not None and len(present) > 1:
        skillset = find_robot(table).load_skillset().name
        present = {name: each for name, each in present.items() if each == skillset} or present
    if robot is None and len(present) > 1:
        first = next(iter(present))
        choice = f'Choose one: `--robot {first}` in a command, `connect("{first}", ...)` in a script.'
        raise SeveralSystemsError(f"Several robots are at {endpoint}: {listed(present)}. {choice}")
    name = robot or next(iter(present), "")
    if name not in present:
        others = f"Those there are {listed(present)}." if present else "Start one with `skillwing up`."
        which = f"robot `{robot}`" if robot else "robot"
        raise NoSystemError(f"No {which} is at {endpoint}. {others}")
    return name, present[name]


def _told_target(endpoint: str, robot: str, skillset: str) -> Target:
    """The target that a robot describes itself. Raises NoSystemError, NoReplyError, RefusedError."""
    told = _description(endpoint, robot, Keys(skillset).resource_robot)
    found = _installed(robot, told.schema)
    file = _kept(skillset, told) if found is None else found[1].skillset
    return Target(
        robot,
        endpoint,
        file,
        told.clock,
        # The others are found by their alive tokens: a robot's table does not say which of them are mocked.
        processes=(ProcessState(name=RESOURCE_MANAGER),),
        rescue_goal=msgspec.convert(told.rescue_goal, RescueGoal | None),
        without_goals=told.without_goals,
        shared=told.shared,
        table=None if found is None else found[0],
    )


def _description(endpoint: str, robot: str, key: str) -> RobotDescription:
    answers: list[Answered | Refused] = []
    bus = join(robot, endpoint, "cli")
    try:
        ask_until_answered(bus, key, encode(QueryRobot()), answers.append)
        bus.run_until(lambda: bool(answers), READY_TIMEOUT)
    finally:
        bus.close()
    return decode(accepted(answers[0] if answers else None, key).payload, RobotDescription)


def _installed(robot: str, schema: str) -> tuple[str, Robot] | None:
    """An installed robot with this skillset, and its reference: that of the same name, else the first one."""
    names = robot_names()
    for name in sorted(names, key=lambda each: each != robot):
        try:
            table = find_robot(name)
            if table.load_skillset().schema_hash == schema:
                return name, table
        except (InvalidOptionError, UnknownNameError, SkillsetError, OSError):
            continue
    return None


def _kept(skillset: str, told: RobotDescription) -> Path:
    """A file of this user with a skillset that a robot has told."""
    folder = runtime_dir() / "skillsets"
    folder.mkdir(mode=0o700, exist_ok=True)
    file = folder / f"{skillset}-{told.schema}.skillset"
    if not file.is_file() or load(file).schema_hash != told.schema:
        write_whole(file, told.source)
    return file
