"""Run state: one small file per robot, by which other commands find a running system.

The files are in a directory that only the user can read. A file is stale, and is removed, if its process is gone or its
process id belongs to another process.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import tempfile
import threading
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import MappingProxyType
from typing import Any

import msgspec

from skillwing.dsl.whole_files import write_whole
from skillwing.services.bus import Topology
from skillwing.services.disk import UnwritableError
from skillwing.services.errors import SkillwingError
from skillwing.services.processes.proc_files import started
from skillwing.services.processes.process_state import ProcessState
from skillwing.services.rescue_goal import RescueGoal
from skillwing.services.robot import ClockKind, Robot


class RunState(msgspec.Struct, frozen=True, kw_only=True):
    """A running system.

    robot: its name and namespace. endpoint: of the router. skillset: path of the `.skillset` file. clock: owner of
    robot time. pid, pid_started: the process that runs it. run_dir: directory of its logs. mock: nothing in it is real.
    topology: way in which processes meet. listens: address of its own router, as others reach it. keys: folder of its
    certificates. processes: state of those that were started. mission_context: facts about the site for missions, by
    mission. viewer: page for browsers, None for none. active_work: sentences on what its end would cut short, empty for
    nothing. rescue_goal, mission_templates, without_goals, shared: as in the robot's table.
    """

    robot: str
    endpoint: str
    skillset: str
    clock: ClockKind
    pid: int
    pid_started: str
    run_dir: str
    mock: bool = False
    topology: Topology = "router"
    listens: str = ""
    keys: str | None = None
    processes: tuple[ProcessState, ...] = ()
    mission_context: dict[str, dict[str, Any]] = {}
    viewer: str | None = None
    active_work: str = ""
    rescue_goal: RescueGoal | None = None
    mission_templates: str | None = None
    without_goals: str = ""
    shared: bool = False


def runtime_dir() -> Path:
    """The user's own directory for such files; made if it is missing."""
    base = os.environ.get("XDG_RUNTIME_DIR")
    root = Path(base) / "skillwing" if base else Path(tempfile.gettempdir()) / f"skillwing-{os.getuid()}"
    root.mkdir(mode=0o700, parents=True, exist_ok=True)
    return root


def write_run_state(state: RunState) -> None:
    """Announce a system. Raises OSError; then the announcement of before stays."""
    write_whole(_path(state.robot), msgspec.json.format(msgspec.json.encode(state)))


def read_run_state(robot: str) -> RunState | None:
    """The running system of a robot; None without one."""
    path = _path(robot)
    content = _content(path)
    state = _decoded(content)
    if _is_current(state):
        return state
    # The file is missing or stale. Another process may announce a new system at this moment.
    if content is not None and _content(path) == content:
        path.unlink(missing_ok=True)
    return None


def remove_run_state(robot: str) -> None:
    """Withdraw a system that has stopped."""
    _path(robot).unlink(missing_ok=True)


@contextmanager
def reserved(robot: str) -> Iterator[None]:
    """Be the only process of this user that runs the robot; raises SkillwingError if another one does.

    The kernel releases the lock at every end of this process.
    """
    with (runtime_dir() / f"{robot}.lock").open("w", encoding="utf-8") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise SkillwingError(
                f"A system of `{robot}` runs already. Stop it first with `skillwing down --robot {robot}`."
            ) from error
        yield


class Announcement:
    """The run state of a system that this process runs. `update` may be called on any thread."""

    def __init__(self, state: RunState) -> None:
        """Announce the system. Raises UnwritableError."""
        self._state = state
        self._over = False
        self._lock = threading.Lock()
        try:
            write_run_state(state)
        except OSError as error:
            raise UnwritableError(_path(state.robot), error) from error

    def update(self, processes: Iterable[ProcessState], active_work: str = "") -> None:
        """Announce the state of the processes and the active work; a missing file is written again."""
        with self._lock:
            state = msgspec.structs.replace(self._state, processes=tuple(processes), active_work=active_work)
            with contextlib.suppress(OSError):  # neither a full disk nor a folder that is gone may end the system
                if not self._over and (self._state != state or not _path(state.robot).exists()):
                    self._state = state
                    write_run_state(self._state)

    def end(self) -> None:
        with self._lock:
            self._over = True
            with contextlib.suppress(OSError):
                remove_run_state(self._state.robot)


@contextmanager
def announced(
    robot: Robot,
    endpoint: str,
    run_dir: Path,
    *,
    clock: ClockKind | None = None,
    mock: bool = False,
    topology: Topology = "router",
    listens: str = "",
    keys: Path | None = None,
    processes: Iterable[ProcessState] = (),
    mission_context: Mapping[str, dict[str, Any]] = MappingProxyType({}),
    viewer: str | None = None,
) -> Iterator[Announcement]:
    """Let other commands find the system that this process runs, for as long as the context lasts."""
    pid = os.getpid()
    announcement = Announcement(
        RunState(
            robot=robot.name,
            endpoint=endpoint,
            skillset=str(robot.skillset),
            clock=clock or robot.clock,
            pid=pid,
            pid_started=started(pid) or "",
            run_dir=str(run_dir),
            mock=mock,
            topology=topology,
            listens=listens,
            keys=None if keys is None else str(keys.absolute()),
            processes=tuple(processes),
            mission_context=dict(mission_context),
            viewer=viewer,
            rescue_goal=robot.rescue_goal,
            mission_templates=robot.mission_templates,
            without_goals=robot.without_goals,
            shared=robot.shared,
        )
    )
    try:
        yield announcement
    finally:
        announcement.end()


def running_systems() -> tuple[RunState, ...]:
    """All systems of this user that run, by robot name."""
    found = (read_run_state(path.stem) for path in sorted(runtime_dir().glob("*.json")))
    return tuple(state for state in found if state is not None)


def stale_run_states() -> tuple[str, ...]:
    """Robots whose file was left by a killed process. Call it before `read_run_state`, which removes such files."""
    found = sorted(runtime_dir().glob("*.json"))
    return tuple(path.stem for path in found if not _is_current(_decoded(_content(path))))


def _content(path: Path) -> bytes | None:
    try:
        return path.read_bytes()
    except OSError:
        return None


def _decoded(content: bytes | None) -> RunState | None:
    try:
        return None if content is None else msgspec.json.decode(content, type=RunState)
    except msgspec.DecodeError:
        return None


def _is_current(state: RunState | None) -> bool:
    return state is not None and started(state.pid) == state.pid_started


def _path(robot: str) -> Path:
    return runtime_dir() / f"{robot}.json"
