"""The table of a robot: its skillset, the processes that make it up, and who manages which skill.

A robot package declares one `Robot`, called `ROBOT` in its `robot.py` and installed under the entry-point group
`skillwing.robots`; launcher, command line and containers read everything about it from there.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib.metadata import entry_points
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal

from skillwing.dsl import load
from skillwing.dsl.model import Skillset, UnknownNameError
from skillwing.dsl.packages import import_name, name_problem
from skillwing.services.errors import InvalidOptionError
from skillwing.services.names import DATA_MANAGER, JOURNAL_FILE, RESOURCE_MANAGER, skill_process
from skillwing.services.options import imported
from skillwing.services.processes.restart_policy import Restart

ROBOTS = "skillwing.robots"
MANAGERS = "skillwing.services.managers"
RECORDING = "skillwing.services.recording"
RECORDER = "recorder"
"""The process that writes a run down."""
TABLE = "robot.py"

ClockKind = Literal["wall", "robot"]


@dataclass(frozen=True)
class ProcessSpec:
    """One process: a node and what its factory is called with.

    name: unique in the robot; also the node's name and the tail of its liveliness key.
    factory: `package.module:function`, called with `options`, which have to survive JSON.
    essential: the robot cannot go on without it; without any other it loses a part of what it can.
    extra: pip extra that its image needs, None for none.
    restart: what becomes of it when it dies. `never` is for a process that cannot take up where another one ended.
    host: name of the process that it shares with all others that name the same host; None for a process of its own.
    """

    name: str
    factory: str
    options: dict[str, Any] = field(default_factory=dict)
    essential: bool = True
    extra: str | None = None
    restart: Restart = "always"
    host: str | None = None


def _nothing(options: dict[str, Any]) -> tuple[ProcessSpec, ...]:
    return ()


def _plain(options: dict[str, Any]) -> dict[str, Any]:
    return {}


@dataclass(frozen=True)
class Robot:
    """What a robot is made of.

    skillset: its file, called after the skillset in it. hooks: for each skill with a manager, the developer's class
    (`package.module:Class`). functional_layer: from run options (`seed`, `speed`, `faults`, `run_dir`) to the processes
    below the managers; none by default.
    clock: `robot` where one process of the functional layer owns the time, `wall` where the robot lives in ours.
    recorder: from run options to what the recorder is told of this robot: the `scene` of its dashboard with its
    `scene_options`, and the `collectors` of what else its runs leave behind (docs/recordings.md).
    judge: `package.module:function`, who says of a finished flight what only this robot's world can tell
    (`report/mission_report.py`); None if nobody does.
    briefing: `package.module:function`, from run options to what is known beforehand of the place where the robot is:
    options of missions, by mission. It is named, for what it needs managers do without; None where nothing is known.
    checker: `package.module:function`, which raises InvalidOptionError for run options that the functional layer could
    not run with, before anything is started; None if only its processes can tell.
    published_by: of each datum that is published only while one of some skills runs, those skills.
    not_to_be_left: of resources, the states in which nobody should leave the robot alone, with what follows then on
    `the robot is`, such as `in the air`.
    """

    name: str
    skillset: Path
    hooks: Mapping[str, str]
    functional_layer: Callable[[dict[str, Any]], tuple[ProcessSpec, ...]] = _nothing
    clock: ClockKind = "robot"
    recorder: Callable[[dict[str, Any]], dict[str, Any]] = _plain
    briefing: str | None = None
    judge: str | None = None
    checker: str | None = None
    published_by: Mapping[str, tuple[str, ...]] = field(default_factory=dict[str, tuple[str, ...]])
    not_to_be_left: Mapping[str, Mapping[str, str]] = field(default_factory=dict[str, Mapping[str, str]])

    def load_skillset(self) -> Skillset:
        """Read the skillset file; raises `SkillsetError` with everything that is wrong in it."""
        return load(self.skillset)

    def managers(self, run: Mapping[str, Any] = MappingProxyType({})) -> tuple[ProcessSpec, ...]:
        """The data manager, the resource manager, and one skill manager for each skill with hooks.

        run: options of the run, of which `run_dir` gets the resource manager's journal, which otherwise dies with it,
        and `durable` makes that safe from power loss. Without one skill manager the system goes on: that skill's goals
        end LOST, and nobody can start it.
        """
        options = {"skillset": str(self.skillset)}
        journal: dict[str, Any] = {"robot": self.name, "durable": bool(run.get("durable"))}
        if run.get("run_dir") is not None:
            journal["journal"] = str(Path(run["run_dir"]) / JOURNAL_FILE)
        return (
            ProcessSpec(DATA_MANAGER, f"{MANAGERS}.data_manager:make_data_manager", options, essential=False),
            ProcessSpec(RESOURCE_MANAGER, f"{MANAGERS}.resource_manager:make_resource_manager", options | journal),
            *(
                ProcessSpec(
                    skill_process(skill),
                    f"{MANAGERS}.skill_manager:make_skill_manager",
                    {**options, "hooks": hooks},
                    essential=False,
                )
                for skill, hooks in self.hooks.items()
            ),
        )

    def observers(self, run: dict[str, Any]) -> tuple[ProcessSpec, ...]:
        """Who only looks on: the recorder, for a run that leaves something behind.

        run: options of the run, of which `run_dir` says where to write; `viewer_url` names a Rerun viewer or server to
        show the run in as well, `viewer` another way of showing it (`spawn`, `serve`).
        """
        if run.get("run_dir") is None:
            return ()
        options = {"run_dir": str(run["run_dir"]), "skillset": str(self.skillset), **self.recorder(run)}
        if run.get("viewer_url") is not None:
            options |= {"viewer": "connect", "url": run["viewer_url"]}
        elif run.get("viewer") is not None:
            options["viewer"] = run["viewer"]
        return (ProcessSpec(RECORDER, f"{RECORDING}.recorder:make_recorder", options, essential=False, extra="viewer"),)

    def brief(self, run: dict[str, Any]) -> dict[str, dict[str, Any]]:
        """What missions are told of the place of this run, by mission. Raises InvalidOptionError for an unknown one."""
        return {} if self.briefing is None else imported({"briefing": self.briefing}, "briefing")(run)

    def check(self, run: dict[str, Any]) -> None:
        """Raise InvalidOptionError for a run that could not be, as far as that can be known beforehand."""
        if self.checker is not None:
            imported({"checker": self.checker}, "checker")(run)

    def process(self, name: str, options: dict[str, Any]) -> ProcessSpec:
        """One process of the table, by name, for these run options; raises UnknownNameError."""
        specs = (*self.functional_layer(options), *self.managers(options), *self.observers(options))
        for spec in specs:
            if spec.name == name:
                return spec
        raise UnknownNameError(f"process of {self.name}", name, (spec.name for spec in specs))


class UnknownRobotError(UnknownNameError):
    """No robot of that name is installed. Besides what is, `str()` says what else a robot may be named by."""

    def __init__(self, reference: str) -> None:
        super().__init__("robot", reference, robot_names())

    def __str__(self) -> str:
        return f"{super().__str__()} The folder of a robot package may be named, too: `./{self.name}`."


def robot_names() -> tuple[str, ...]:
    """The installed robots."""
    return tuple(sorted(entry_points(group=ROBOTS).names))


def find_robot(reference: str) -> Robot:
    """A robot by its name, if it is installed, by its package folder, or as `package.module:ROBOT`.

    A folder is made importable, in this process and in those that it starts, and so is a package in the current one.
    Raises UnknownRobotError, which says what is installed, and InvalidOptionError where there is no table or it cannot
    be loaded.
    """
    found = entry_points(group=ROBOTS, name=reference)
    if found:
        return next(iter(found)).load()
    folder = Path(reference)
    if folder.is_dir():
        return _in_folder(folder)
    if ":" in reference:
        here, package = Path.cwd(), reference.partition(":")[0].partition(".")[0]
        if (here / package).is_dir() or (here / f"{package}.py").is_file():
            _make_importable(here)
        return _loaded(reference)
    if len(folder.parts) > 1:
        raise InvalidOptionError("robot", f"There is no folder `{reference}`. Name that of a robot package.")
    raise UnknownRobotError(reference)


def _in_folder(folder: Path) -> Robot:
    if not (folder / TABLE).is_file():
        sentence = f"`{folder}` holds no {TABLE}. Make a robot package with `skillwing generate FILE -o {folder}`."
        raise InvalidOptionError("robot", sentence)
    if problem := name_problem(folder):
        raise InvalidOptionError("robot", problem)
    package, root = import_name(folder)
    _make_importable(root)
    robot = _loaded(f"{package}.{Path(TABLE).stem}:ROBOT")
    module = sys.modules[f"{package}.{Path(TABLE).stem}"]
    if Path(module.__file__ or "").resolve() != (folder / TABLE).resolve():
        sentence = f"`{package}` is imported from {module.__file__}, not from `{folder}`. Rename the folder."
        raise InvalidOptionError("robot", sentence)
    return robot


def _make_importable(root: Path) -> None:
    """Put a folder on the path, behind all others, of this process and of those that it starts."""
    if str(root) not in sys.path:
        sys.path.append(str(root))
        inherited = os.environ.get("PYTHONPATH")
        os.environ["PYTHONPATH"] = os.pathsep.join([*([inherited] if inherited else []), str(root)])


def _loaded(path: str) -> Robot:
    robot = imported({"robot": path}, "robot")
    if not isinstance(robot, Robot):
        raise InvalidOptionError("robot", f"`{path}` is no `Robot`. Name the table of a robot: `package.robot:ROBOT`.")
    return robot
