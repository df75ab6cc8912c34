"""Connections of scripts and commands to a running system."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from skillwing.dsl import SkillsetError, load
from skillwing.dsl.model import Skillset
from skillwing.services.access.exposure import require_address
from skillwing.services.bus import Answer, Answered
from skillwing.services.bus.clock import FollowedClock, WallClock
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.client.joining import join
from skillwing.services.client.retry import wait_for_answer
from skillwing.services.client.target import CONNECT, READY_TIMEOUT, ROBOT_NAME, Target, find_target_at
from skillwing.services.errors import NoReplyError, NoSystemError, SeveralSystemsError, SkillwingError
from skillwing.services.processes.run_state import RunState, read_run_state, running_systems
from skillwing.services.protocol import Keys, M, Message, QueryStates, ResourceStates, decode, encode
from skillwing.services.robot import robot_names


def find_target(
    robot: str | None = None, *, endpoint: str | None = None, table: str | None = None, schema: str | None = None
) -> Target:
    """The system at an endpoint, else at SKILLWING_CONNECT, else the one that runs here.

    robot: its name, or a reference of its table. It may be missing if one system runs there, or one with the skillset
    of the hash `schema`; at an endpoint, one with the skillset of `table`. Without a name SKILLWING_ROBOT counts as the
    table. A robot elsewhere tells its skillset itself. table: of the robot that is meant, as `find_robot` takes it; it
    is used if the robot does not answer. Raises NoSystemError, SeveralSystemsError, InvalidOptionError for a malformed
    address, and as `find_robot` does.
    """
    source = "endpoint" if endpoint else CONNECT
    endpoint = endpoint or os.environ.get(CONNECT)
    if endpoint:
        require_address(endpoint, source)
        return find_target_at(endpoint, robot, table)
    state = running_system(robot, schema=schema)
    if state is None:
        raise NoSystemError(_not_running(robot))
    return _target(state)


def _not_running(robot: str | None) -> str:
    """Sentences on a system that does not run, and the command that starts one of that name."""
    if robot is None:
        return "No system is running. Start one with `skillwing up`."
    text = f"No system of `{robot}` is running."
    if robot in robot_names() or not ROBOT_NAME.fullmatch(robot):
        return f"{text} Start one with `skillwing up --robot {robot}`."
    return f"{text} Start it with `skillwing up` and its `--robot`, or `--robot-name {robot}`."


def running_system(robot: str | None = None, *, schema: str | None = None) -> RunState | None:
    """The system that runs here, of this name or any; None without one.

    schema: as for `find_target`. Raises SeveralSystemsError.
    """
    systems = running_systems() if robot is None else tuple(filter(None, [read_run_state(robot)]))
    fitting = systems
    if len(systems) > 1 and schema is not None:
        fitting = tuple(state for state in systems if _schema_of(state) == schema) or systems
    if len(fitting) <= 1:
        return fitting[0] if fitting else None
    names = ", ".join(f"`{state.robot}`" for state in systems)
    name = fitting[0].robot
    choice = f'Choose one: `--robot {name}` in a command, `connect("{name}")` in a script.'
    raise SeveralSystemsError(f"Several systems are running: {names}. {choice}")


def _schema_of(state: RunState) -> str | None:
    """Hash of a running system's skillset; None if its file cannot be read."""
    try:
        return load(state.skillset).schema_hash
    except (OSError, SkillsetError):
        return None


def _target(state: RunState) -> Target:
    return Target(
        state.robot,
        state.endpoint,
        Path(state.skillset),
        state.clock,
        pid=state.pid,
        run_dir=Path(state.run_dir),
        mock=state.mock,
        topology=state.topology,
        listens=state.listens,
        keys=None if state.keys is None else Path(state.keys),
        processes=state.processes,
        rescue_goal=state.rescue_goal,
        without_goals=state.without_goals,
        shared=state.shared,
    )


@dataclass
class Connection:
    """A system that this process is connected to."""

    target: Target
    bus: ZenohBus
    skillset: Skillset
    keys: Keys = field(init=False)

    def __post_init__(self) -> None:
        self.keys = Keys(self.skillset.name)

    def ask(self, key: str, message: Message, reply: type[M]) -> M:
        """Ask and wait for the reply. Raises RefusedError, or NoReplyError if there is none."""
        return decode(self.wait_for_answer(key, lambda take: self.bus.ask(key, encode(message), take)).payload, reply)

    def wait_for_answer(self, key: str, ask: Callable[[Callable[[Answer], None]], None]) -> Answered:
        """Call `ask` with a callback and wait for that call. Raises as `ask` does; `key` is for the error."""
        return wait_for_answer(self.bus, key, ask)

    def make_interface(self, client: str, *, owns_goals: bool = False) -> SkillsetInterface:
        """The skillset's interface, its resource states known. Raises NoReplyError, or RefusedError with the reason."""
        interface = SkillsetInterface(self.bus, self.skillset, client=client, owns_goals=owns_goals)
        if not self.bus.run_until(lambda: interface.ready, READY_TIMEOUT):
            self.ask(self.keys.resource_states, QueryStates(), ResourceStates)
            raise NoReplyError(self.keys.resource_states)
        return interface


@contextmanager
def open_connection(
    target: Target, *, client: str, wait_for_clock: bool = True, beside: ZenohBus | None = None
) -> Iterator[Connection]:
    """Connect to a system. client: role of this process, part of the name of its node. beside: bus of another system,
    whose thread runs the callbacks of this one too.

    Raises NoSystemError if there is none, KeysError and NotKnownError where its router asks for a key. With
    `wait_for_clock` the robot time is known on return; a SkillwingError says that the clock is silent.
    """
    skillset = load(target.skillset)
    clock = FollowedClock() if target.clock == "robot" else WallClock()
    try:
        bus = join(target.robot, target.endpoint, client, clock, beside)
    except NoSystemError as error:
        raise _without_router(target) or error from error
    try:
        if wait_for_clock and isinstance(clock, FollowedClock) and not bus.run_until(clock.has_started, READY_TIMEOUT):
            raise SkillwingError(
                "Robot time does not pass: no process publishes the clock. Look at `skillwing status`."
            )
        yield Connection(target, bus, skillset)
    finally:
        bus.close()


def _without_router(target: Target) -> NoSystemError | None:
    """The error for a system that runs on this machine, but whose router does not answer; None for others."""
    if target.pid is None:
        return None
    runs = f"`{target.robot}` runs (process {target.pid}), but its router does not answer at {target.endpoint}."
    remedy = f"Start that router again, or stop this system with `skillwing down --robot {target.robot}`."
    return NoSystemError(f"{runs} {remedy}", target.endpoint)


def require_schema(connection: Connection, expected: str | None) -> None:
    """Raise SkillwingError if a system's skillset is not the one that its client was generated from."""
    skillset = connection.skillset
    if expected is not None and skillset.schema_hash != expected:
        raise SkillwingError(
            f"`{connection.target.robot}` runs another skillset than this code was made from: `{skillset.name}`, as it "
            "is now. Connect to the robot that this code is for; if that is the one, run `skillwing generate` again."
        )
