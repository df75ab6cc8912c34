"""Definition of a mission: name, options, needs, and the trees that carry it out."""

from __future__ import annotations

import inspect
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

import msgspec
from py_trees.behaviour import Behaviour

from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.mission.options import default_values, read_values
from skillwing.bt_missions.mission.problems import MissionProblem
from skillwing.bt_missions.planning.detour import Position, RoutePlanner
from skillwing.dsl.model import UnknownNameError


class MissionOptions(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Base of the options of a mission. Each field is an option; one without a default is required."""


@dataclass(frozen=True, slots=True)
class Progress:
    """Progress of a mission: waypoints done, all waypoints, and the target of the motion."""

    waypoint: int = 0
    waypoints: int = 0
    goal: Position | None = None
    text: str = ""

    @classmethod
    def of(cls, planner: RoutePlanner) -> Progress:
        """Progress along a route."""
        return cls(min(planner.waypoint, len(planner.route)), len(planner.route), planner.target, planner.summary)


@dataclass(frozen=True, slots=True)
class MissionTrees:
    """Trees of a mission.

    root: carries it out. rescue: brings the robot to its rescue goal after an abort, an exception in a leaf, or an end
    of `root` away from that goal. A robot without a rescue goal needs none. rescues: the same for each robot of a
    mission on several, by its name. unused: other trees of the same file, which are checked but not run.
    """

    root: Behaviour
    rescue: Behaviour | None = None
    progress: Callable[[], Progress] = Progress
    unused: tuple[Behaviour, ...] = ()
    rescues: Mapping[str, Behaviour] = field(default_factory=dict[str, Behaviour])

    @property
    def all(self) -> tuple[Behaviour, ...]:
        return (self.root, *(() if self.rescue is None else (self.rescue,)), *self.rescues.values(), *self.unused)

    def rescue_of(self, robot: str) -> Behaviour | None:
        """The rescue of a robot; an empty name stands for the only one."""
        return self.rescues.get(robot) if robot else self.rescue


class Mission(ABC):
    """Base of missions.

    name: as in `skillwing mission run NAME`. summary: one sentence. Options: its options with defaults.
    needs: for each resource, the states in one of which it has to be before the first tick. owner_grace: wall time in
    seconds, at most 60, for which goals run on while the link between mission and robot is away. robots: names of the
    robots of a mission on several; `needs` then has `left.pad` for the resource `pad` of `left`.
    """

    name: str
    summary: str
    robots: tuple[str, ...] = ()
    needs: Mapping[str, tuple[str, ...]] = MappingProxyType({})
    owner_grace: float = 0.0
    Options: type[MissionOptions] = MissionOptions

    @property
    def file(self) -> Path | None:
        """The file of the mission: for one in Python, the file of its class."""
        try:
            return Path(inspect.getfile(type(self)))
        except (OSError, TypeError):  # a class without a file
            return None

    @property
    def needs_location(self) -> str | None:
        """`file:line` of `needs`: for a mission in Python, of its class."""
        try:
            return f"{inspect.getsourcefile(type(self))}:{inspect.getsourcelines(type(self))[1]}"
        except (OSError, TypeError):  # a class without a file
            return None

    def require_usable(self) -> None:  # noqa: B027 - a mission in Python has loaded, so it is usable
        """Raise FaultyMissionError if the mission cannot run on any robot, as its file is written."""

    @abstractmethod
    def build(self, context: MissionContext, options: Any) -> MissionTrees:
        """Build the trees. Called once, before the robot is ready: read nothing from the robot here."""

    def draft(self, context: MissionContext, options: Any) -> tuple[MissionTrees, list[MissionProblem]]:
        """Build the trees as far as possible, and list the problems that prevent a run."""
        trees: object = self.build(context, options)
        if not isinstance(trees, MissionTrees):
            raise TypeError(f"`build` returns {type(trees).__name__} instead of MissionTrees")
        return trees, []

    @property
    def option_names(self) -> tuple[str, ...]:
        return self.Options.__struct_fields__

    def describe(self) -> dict[str, Any]:
        """Defaults of the options that have one, as plain values: text, numbers, lists."""
        return dict(default_values(self.Options))

    def read_options(self, given: Mapping[str, Any]) -> MissionOptions:
        """The options from plain values; a number may also be text. Raises InvalidOptionError with all problems."""
        names = self.option_names
        unknown = {
            name: str(UnknownNameError(f"option of {self.name}", name, names)) for name in given if name not in names
        }
        return read_values(given, self.Options, unknown)


def split_need(name: str, *, several: bool) -> tuple[str, str]:
    """Robot and resource of a need: `left` and `pad` for `left.pad`; no robot in a mission on one robot."""
    robot, _, resource = name.rpartition(".") if several else ("", "", name)
    return robot, resource
