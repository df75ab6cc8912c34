"""What a mission is."""

from __future__ import annotations

import inspect
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
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
from skillwing.services.errors import InvalidOptionError


class MissionOptions(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Base of the options of a mission; each field is one option, which has to be given where it has no default."""


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a mission is: waypoints done of all, and where the drone is flying to."""

    waypoint: int = 0
    waypoints: int = 0
    goal: Position | None = None
    text: str = ""

    @classmethod
    def of(cls, planner: RoutePlanner) -> Progress:
        """How far a route has been flown."""
        return cls(min(planner.waypoint, len(planner.route)), len(planner.route), planner.target, planner.account)


@dataclass(frozen=True, slots=True)
class MissionTrees:
    """What a mission is made of. root: flies it. rescue: brings the drone to safety when `root` cannot go on, because
    somebody aborted the mission or a leaf raised, and when `root` has ended in the air. unused: what else was written
    beside them, to be checked and never flown."""

    root: Behaviour
    rescue: Behaviour
    progress: Callable[[], Progress]
    unused: tuple[Behaviour, ...] = ()


class Mission(ABC):
    """A mission of the library.

    name: as in `skillwing mission run NAME`. summary: one sentence. Options: its options with defaults.
    needs: for each resource, the states in one of which it has to be before the tree is ticked for the first time.
    """

    name: str
    summary: str
    needs: Mapping[str, tuple[str, ...]] = MappingProxyType({})
    Options: type[MissionOptions] = MissionOptions

    @property
    def file(self) -> Path | None:
        """Where it is written: for a mission in Python the file of its class."""
        try:
            return Path(inspect.getfile(type(self)))
        except (OSError, TypeError):  # made where there is no file
            return None

    @property
    def needs_location(self) -> str | None:
        """`file:line` where `needs` are written: for a mission in Python that of its class."""
        try:
            return f"{inspect.getsourcefile(type(self))}:{inspect.getsourcelines(type(self))[1]}"
        except (OSError, TypeError):  # made where there is no file
            return None

    def require_usable(self) -> None:  # noqa: B027 - what is read from no file is usable
        """Raises FaultyMissionError where it cannot be flown for what is written in its file, on whatever robot."""

    @abstractmethod
    def build(self, context: MissionContext, options: Any) -> MissionTrees:
        """Build the trees. Called once, before the robot is known to be ready: look at nothing yet."""

    def draft(self, context: MissionContext, options: Any) -> tuple[MissionTrees, list[MissionProblem]]:
        """Build the trees as far as that goes, and list what keeps them from being flown."""
        trees: object = self.build(context, options)
        if not isinstance(trees, MissionTrees):
            raise TypeError(f"`build` returns {type(trees).__name__} instead of MissionTrees")
        return trees, []

    @property
    def option_names(self) -> tuple[str, ...]:
        return self.Options.__struct_fields__

    def describe(self) -> dict[str, Any]:
        """The default of each option that has one, as plain values: text, numbers, lists."""
        return dict(default_values(self.Options))

    def read_options(self, given: Mapping[str, Any]) -> MissionOptions:
        """The options from their plain form, where numbers may also be text. Raises InvalidOptionError."""
        for name in given:
            if name not in self.option_names:
                known = UnknownNameError(f"option of {self.name}", name, self.option_names)
                raise InvalidOptionError(name, str(known))
        return read_values(given, self.Options)
