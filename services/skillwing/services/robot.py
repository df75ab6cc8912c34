"""The table of a robot: its skillset, its processes, and the manager of each skill.

A robot package declares one `Robot`, called `ROBOT` in its `robot.py` and installed under the entry-point group
`skillwing.robots`. Launcher, command line and containers read everything about the robot from there.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal

import msgspec

from skillwing.dsl import load
from skillwing.dsl.model import Skillset, UnknownNameError
from skillwing.dsl.packages import import_name, name_problem
from skillwing.services.errors import InvalidOptionError
from skillwing.services.names import DATA_MANAGER, JOURNAL_FILE, RESOURCE_MANAGER, skill_process
from skillwing.services.options import imported
from skillwing.services.python_path import make_importable
from skillwing.services.rescue_goal import RescueGoal

ROBOTS = "skillwing.robots"
MANAGERS = "skillwing.services.managers"
RECORDING = "skillwing.services.recording"
RECORDER = "recorder"
"""Name of the process that records a run."""
TABLE = "robot.py"

ClockKind = Literal["wall", "robot"]
Restart = Literal["always", "never"]


@dataclass(frozen=True)
class ProcessSpec:
    """One process: a node, its factory and the factory's options.

    name: unique in the robot; also the node's name and the end of its liveliness key.
    factory: `package.module:function`, called with `options`, which must survive JSON.
    essential: the robot cannot go on without it. Without any other process it loses only a part of its abilities.
    extra: pip extra that its image needs, None for none.
    restart: `never` is for a process that cannot continue from the end of an earlier one.
    host: name of a process that all nodes with the same host share; None for a process of its own.
    resolver: `package.module:function` from `options` to the factory's options. It turns names, as of a site or a file,
    into plain values, and may need packages that readers of the table lack. None for final options.
    """

    name: str
    factory: str
    options: dict[str, Any] = field(default_factory=dict)
    essential: bool = True
    extra: str | None = None
    restart: Restart = "always"
    host: str | None = None
    resolver: str | None = None

    def resolved(self) -> ProcessSpec:
        """The process with final options, for the side that starts it. Raises InvalidOptionError."""
        if self.resolver is None:
            return self
        try:
            options = imported({"resolver": self.resolver}, "resolver")(self.options)
        except ValueError as error:
            raise InvalidOptionError("options", f"`{self.name}` cannot use its options: {error}.") from error
        return replace(self, options=options, resolver=None)


def _nothing(options: dict[str, Any]) -> tuple[ProcessSpec, ...]:
    return ()


def _plain(options: dict[str, Any]) -> dict[str, Any]:
    return {}


@dataclass(frozen=True)
class Robot:
    """The parts of a robot.

    skillset: its file, which has the name of the skillset. hooks: for each skill with a manager, the developer's class
    (`package.module:Class`). functional_layer: from run options (`seed`, `speed`, `faults`, `run_dir`) to the processes
    below the managers; none by default.
    clock: `robot` if a process of the functional layer owns the time, `wall` for a robot in wall time.
    recorder: from run options to this robot's options of the recorder: the `scene` of its dashboard with its
    `scene_options`, and the `collectors` of further files (docs/recordings.md).
    judge: `package.module:function` that adds facts from the robot's true world to the report of a mission
    (`report/mission_report.py`); None without one.
    mission_context: `package.module:function` from run options to facts about the site: options of missions, by
    mission. It is a name, because managers do not have the packages that it needs; None for an unknown site.
    checker: `package.module:function` that raises InvalidOptionError for run options which the functional layer cannot
    use, before anything starts; None without one.
    published_by: skills without which a datum is not published, by datum.
    topics: `package.module:TOPICS`, the rows of its functional layer with the names of its processes. With keys, each
    of these processes may offer its own topics only. None: they share all keys below `fl/`.
    shared_processes: processes of the functional layer that work at other robots as well, such as the simulator of a
    world that several share. With keys, `keys add-robot --with` lets them do there what that robot's own ones may.
    mission_templates: package with `template.xml` and `template.py.txt`, beginnings of own missions. None: they are
    drafted from the skillset.
    rescue_goal: the state to which the robot is brought before anybody leaves it alone. None for a robot that may be
    left anywhere.
    without_goals: a sentence on what the robot does by itself while no goal commands it, for operators whose link to it
    is away. Empty for a robot that does nothing.
    shared: several missions may use it at once, as the judge of a fleet. A mission on other robots as well does not
    occupy it: it has neither status nor tree there.
    """

    name: str
    skillset: Path
    hooks: Mapping[str, str]
    functional_layer: Callable[[dict[str, Any]], tuple[ProcessSpec, ...]] = _nothing
    clock: ClockKind = "robot"
    recorder: Callable[[dict[str, Any]], dict[str, Any]] = _plain
    mission_context: str | None = None
    judge: str | None = None
    checker: str | None = None
    published_by: Mapping[str, tuple[str, ...]] = field(default_factory=dict[str, tuple[str, ...]])
    rescue_goal: RescueGoal | None = None
    without_goals: str = ""
    mission_templates: str | None = None
    topics: str | None = None
    shared_processes: tuple[str, ...] = ()
    shared: bool = False

    def load_skillset(self) -> Skillset:
        """Read the skillset file; raises `SkillsetError` with all its problems."""
        return load(self.skillset)

    def managers(self, run: Mapping[str, Any] = MappingProxyType({})) -> tuple[ProcessSpec, ...]:
        """The data manager, the resource manager, and one skill manager for each skill with hooks.

        run: options of the run. `run_dir` is the directory of the resource manager's journal; without it there is no
        journal. `durable` makes the journal safe from power loss. `keep` is the size in bytes that the recorded steps
        may have without a recorder, which deletes old ones earlier. The system can go on without a skill manager: that
        skill's goals end LOST, and it cannot be started.
        """
        options = {"skillset": str(self.skillset)}
        journal: dict[str, Any] = {"robot": self.name, "durable": bool(run.get("durable"))}
        if self.rescue_goal is not None:
            journal["rescue_goal"] = msgspec.json.decode(msgspec.json.encode(self.rescue_goal))
        if self.without_goals:
            journal["without_goals"] = self.without_goals
        if self.shared:
            journal["shared"] = True
        if run.get("run_dir") is not None:
            journal["journal"] = str(Path(run["run_dir"]) / JOURNAL_FILE)
        if run.get("keep") is not None:
            journal["steps_bytes"] = int(run["keep"])
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
        """The recorder, for a run with a directory.

        run: options of the run. `run_dir` is the directory. `keep` is the size in bytes that the files of the run may
        have. `viewer_url` names a Rerun viewer or server that shows the
        run, too, and `viewer` another way to show it (`spawn`, `serve`).
        """
        if run.get("run_dir") is None:
            return ()
        options = {"run_dir": str(run["run_dir"]), "skillset": str(self.skillset), **self.recorder(run)}
        options |= {} if run.get("keep") is None else {"keep": int(run["keep"])}
        if run.get("viewer_url") is not None:
            options |= {"viewer": "connect", "url": run["viewer_url"]}
        elif run.get("viewer") is not None:
            options["viewer"] = run["viewer"]
        return (ProcessSpec(RECORDER, f"{RECORDING}.recorder:make_recorder", options, essential=False, extra="viewer"),)

    def mission_options(self, run: dict[str, Any]) -> dict[str, dict[str, Any]]:
        """Options of missions that follow from the site of a run, by mission. Raises InvalidOptionError for a site that
        does not exist."""
        if self.mission_context is None:
            return {}
        return imported({"mission_context": self.mission_context}, "mission_context")(run)

    def check(self, run: dict[str, Any]) -> None:
        """Raise InvalidOptionError for options of a run that the robot's checker rejects, and for a wrong table."""
        skillset = self.load_skillset()
        if self.rescue_goal is not None:
            self.rescue_goal.require_fit(skillset)
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
    """A robot that is not installed. `str()` names the installed ones, and the other forms of a robot's name.

    running: names of robots that run, for a command that takes those as well.
    """

    def __init__(self, reference: str, running: Iterable[str] = ()) -> None:
        super().__init__("robot", reference, tuple(dict.fromkeys((*running, *robot_names()))))

    def __str__(self) -> str:
        return f"{super().__str__()} The folder of a robot package is possible, too: `./{self.name}`."


def robot_names() -> tuple[str, ...]:
    """Names of the installed robots."""
    from importlib.metadata import entry_points  # noqa: PLC0415 - as in `find_robot`

    return tuple(sorted(entry_points(group=ROBOTS).names))


def find_robot(reference: str) -> Robot:
    """A robot by its name, if it is installed, by its package folder, or as `package.module:ROBOT`.

    A folder becomes importable in this process and its children. So does a package in the current folder.
    Raises UnknownRobotError with the installed robots, and InvalidOptionError for a table that is missing or cannot be
    loaded.
    """
    # Most processes are hosts that the launcher gives factories: they ask for no robot.
    from importlib.metadata import entry_points  # noqa: PLC0415

    found = entry_points(group=ROBOTS, name=reference)
    if found:
        return next(iter(found)).load()
    folder = Path(reference)
    if folder.is_dir():
        return _in_folder(folder)
    if ":" in reference:
        here, package = Path.cwd(), reference.partition(":")[0].partition(".")[0]
        if (here / package).is_dir() or (here / f"{package}.py").is_file():
            make_importable(here)
        return _loaded(reference)
    if len(folder.parts) > 1 or "/" in reference:
        raise InvalidOptionError("robot", f"There is no folder `{reference}`. Name that of a robot package.")
    raise UnknownRobotError(reference)


def _in_folder(folder: Path) -> Robot:
    if not (folder / TABLE).is_file():
        sentence = f"`{folder}` holds no {TABLE}. Make a robot package with `skillwing generate FILE -o {folder}`."
        raise InvalidOptionError("robot", sentence)
    if problem := name_problem(folder):
        raise InvalidOptionError("robot", problem)
    package, root = import_name(folder)
    make_importable(root)
    robot = _loaded(f"{package}.{Path(TABLE).stem}:ROBOT")
    module = sys.modules[f"{package}.{Path(TABLE).stem}"]
    if Path(module.__file__ or "").resolve() != (folder / TABLE).resolve():
        sentence = f"`{package}` is imported from {module.__file__}, not from `{folder}`. Rename the folder."
        raise InvalidOptionError("robot", sentence)
    return robot


def _loaded(path: str) -> Robot:
    robot = imported({"robot": path}, "robot")
    if not isinstance(robot, Robot):
        raise InvalidOptionError("robot", f"`{path}` is no `Robot`. Name the table of a robot: `package.robot:ROBOT`.")
    return robot
