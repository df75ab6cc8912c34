"""`XmlMission`: a tree file as a mission."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, cast

import msgspec
from py_trees.behaviour import Behaviour

from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.mission.mission import Mission, MissionOptions, MissionTrees, Progress
from skillwing.bt_missions.mission.options import option_text, plain_value
from skillwing.bt_missions.mission.problems import MissionProblem
from skillwing.bt_missions.xml.blackboard import Blackboard
from skillwing.bt_missions.xml.builder import Builder
from skillwing.bt_missions.xml.document import FileProblem, TreeFileError
from skillwing.bt_missions.xml.node_type import PortError
from skillwing.bt_missions.xml.plans import PlanRoute
from skillwing.bt_missions.xml.port_types import LIST, PYTHON_TYPES, SHAPES
from skillwing.bt_missions.xml.tree_file import RESCUE, DeclaredPort, TreeFile, read_tree_file
from skillwing.bt_missions.xml.values import read_option
from skillwing.dsl.model import ArrayType
from skillwing.dsl.suggest import did_you_mean, listed
from skillwing.services.errors import InvalidOptionError
from skillwing.services.protocol import LONGEST_OWNER_GRACE

OWNER_GRACE = "owner_grace"
"""Key of the metadata for `Mission.owner_grace`."""
NEEDS = "needs"
"""Key of the metadata for the resource states that a mission needs at its start."""
ROBOTS = "robots"
"""Key of the metadata for the names of the robots of a mission on several."""


def load_mission(file: Path) -> XmlMission:
    """The mission in a tree file. Raises TreeFileError for other files.

    A mission with `problems` cannot run, but it can be checked, to list the problems of its trees as well.
    """
    return XmlMission(read_tree_file(file))


class XmlMission(Mission):
    """Mission from a tree file. name: ID of the main tree. Its input ports are the options, and the metadata of its
    model hold summary, needs and owner_grace.

    problems: those of the file's frame, of the options and of the metadata.
    """

    def __init__(self, source: TreeFile) -> None:
        self._source = source
        problems = list(source.problems)
        self.name = source.main or source.file.stem
        self.summary = source.main_model.metadata.get("summary", "")
        self.robots = tuple(source.main_model.metadata.get(ROBOTS, "").split())
        self.needs = dict(_needs(source, problems))
        self.owner_grace = _owner_grace(source, problems)
        fields = list(_options(source, problems))
        self.problems = tuple(problems)
        options = msgspec.defstruct("Options", fields, bases=(MissionOptions,), frozen=True, kw_only=True)
        self.Options = cast(type[MissionOptions], options)

    @property
    def file(self) -> Path:
        return self._source.file

    @property
    def needs_location(self) -> str | None:
        return f"{self.file}:{self._source.main_model.lines.get(NEEDS, 0)}"

    def require_usable(self) -> None:
        """Raise TreeFileError with the problems of the file, if there are any."""
        if self.problems:
            raise TreeFileError(self._source.file, self.problems)

    def build(self, context: MissionContext, options: MissionOptions) -> MissionTrees:
        """Build the trees. Raises TreeFileError with all problems of the file and with the skillset."""
        trees, problems = self._draft(context, options)
        if problems:
            raise TreeFileError(self._source.file, problems)
        return trees

    def draft(self, context: MissionContext, options: MissionOptions) -> tuple[MissionTrees, list[MissionProblem]]:
        trees, problems = self._draft(context, options)
        return trees, [problem.in_file(self._source.file) for problem in problems]

    def _draft(self, context: MissionContext, options: MissionOptions) -> tuple[MissionTrees, list[FileProblem]]:
        builder = Builder(self._source, context)
        blackboard = Blackboard()
        for port in self._source.main_model.ports:
            # An option that could not be read is reported already.
            blackboard.entry(port.name).allow_empty()
        problems = list(self.problems)
        ports = {port.name: port for port in self._source.main_model.ports}
        for field in msgspec.structs.fields(self.Options):
            port, value = ports[field.name], getattr(options, field.name)
            try:
                value = _own_value(value, port, context) if field.type is Any else value
                blackboard.entry(field.name).set(value)
            except PortError as error:
                problems.append(FileProblem(port.line, f"Option {error}"))
        root = builder.build(self._source.main, blackboard)
        rescues = {
            robot: builder.build(tree, blackboard, robot)
            for robot, own in context.robots.items()
            if (tree := self._rescue_tree(own)) is not None
        }
        unused = tuple(builder.build_unused())
        builder.finish()
        trees = MissionTrees(root, rescues.pop("", None), lambda: _progress(root), unused, rescues)
        return trees, [*problems, *builder.problems]

    def _rescue_tree(self, context: MissionContext) -> str | None:
        """The tree that rescues a robot: `rescue_left` for `left`, otherwise `rescue`.

        Of several robots only those with a rescue goal have the latter.
        """
        own = f"{RESCUE}_{context.robot}"
        if own in self._source.trees:
            return own
        is_rescued = not context.robot or context.rescue_goal is not None
        return RESCUE if is_rescued and RESCUE in self._source.trees else None


def _progress(root: Behaviour) -> Progress:
    plan = next((node for node in root.iterate() if isinstance(node, PlanRoute)), None)
    return Progress() if plan is None else Progress.of(plan.route.planner)


def _options(source: TreeFile, problems: list[FileProblem]) -> Iterator[tuple[str, Any, Any]]:
    for port in source.main_model.ports:
        if not port.name.isidentifier() or port.name.startswith("_"):
            text = f"`{port.name}` cannot name an option; write a letter, then letters, digits or `_`."
            problems.append(FileProblem(port.line, text))
        elif port.default is None:
            problems.append(FileProblem(port.line, f"Option `{port.name}` has no default; give it one."))
        else:
            yield from _option(port, port.default, problems)


def _option(port: DeclaredPort, default: str, problems: list[FileProblem]) -> Iterator[tuple[str, Any, Any]]:
    kind = PYTHON_TYPES.get(port.kind, Any)
    try:
        plain = default if kind is str else plain_value(port.name, default)
        if port.kind in SHAPES and not _fits(plain, kind):
            kind = Any
        value = msgspec.convert(None if plain == "" else plain, kind, strict=False)
        is_mutable = isinstance(value, list | dict)
        yield port.name, kind, msgspec.field(default_factory=lambda: value) if is_mutable else value
    except (InvalidOptionError, msgspec.ValidationError) as error:
        problems.append(FileProblem(port.line, f"The default of option `{port.name}` cannot be read: {error}."))


def _fits(plain: object, kind: Any) -> bool:
    try:
        msgspec.convert(None if plain == "" else plain, kind, strict=False)
    except msgspec.ValidationError:
        return False
    return True


def _own_value(value: object, port: DeclaredPort, context: MissionContext) -> Any:
    """The value of an option whose type is one of a skillset. Raises PortError."""
    named = {kind.name: kind for own in context.robots.values() for kind in own.skillset.types}
    name = port.kind.removesuffix(LIST)
    if name not in named and port.kind in PYTHON_TYPES:
        raise PortError(f"`{port.name}` is `{option_text(value)}`, which is no {port.kind}. Change its default.")
    if name not in named:
        known = [*PYTHON_TYPES, *named]
        others = f"; it may be {listed(known, limit=30)}, or a list of a skillset's type as `TYPE{LIST}`."
        raise PortError(f"`{port.name}` is of type `{port.kind}`{did_you_mean(name, known, others)}")
    return read_option(value, ArrayType(named[name], None) if port.kind.endswith(LIST) else named[name], port.name)


def _owner_grace(source: TreeFile, problems: list[FileProblem]) -> float:
    """Parse `owner_grace="20"`."""
    model = source.main_model
    text = model.metadata.get(OWNER_GRACE, "0")
    try:
        seconds = float(text)
    except ValueError:
        seconds = -1.0
    if 0.0 <= seconds <= LONGEST_OWNER_GRACE:
        return seconds
    sentence = f"`{OWNER_GRACE}` is `{text}`; it takes seconds from 0 to {LONGEST_OWNER_GRACE:g}."
    problems.append(FileProblem(model.lines[OWNER_GRACE], sentence))
    return 0.0


def _needs(source: TreeFile, problems: list[FileProblem]) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Parse `needs="SDK_authority: AVAILABLE; zed_status: OK FAILED"`."""
    model = source.main_model
    for need in filter(str.strip, model.metadata.get(NEEDS, "").split(";")):
        resource, colon, states = need.partition(":")
        if colon and states.split():
            yield resource.strip(), tuple(states.split())
        else:
            text = f"`{need.strip()}` in `needs` is not of the form RESOURCE: STATE ..."
            problems.append(FileProblem(model.lines[NEEDS], text))
