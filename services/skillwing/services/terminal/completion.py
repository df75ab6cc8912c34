"""Shell completion: names of the running skillset, or else of the robot that `up` starts by default.

Names come from the skillset's file, without a query to the system. A file that cannot be read gives no names, because a
shell shows no errors during completion.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from importlib.metadata import entry_points
from pathlib import Path
from typing import TypeAlias

import typer

from skillwing.dsl import SkillsetError, load
from skillwing.dsl.model import EnumType, ScalarType, Skillset, Type, UnknownNameError
from skillwing.services.client.connection import find_target
from skillwing.services.client.target import CONNECT, DEFAULT_ROBOT, TABLE
from skillwing.services.errors import NoSystemError, SkillwingError
from skillwing.services.processes.run_state import running_systems
from skillwing.services.robot import ROBOTS, find_robot

MISSIONS = "skillwing.missions"
MISSION_GROUP = "mission"
FILES = (".py", ".xml")
"""Endings of the names of mission files."""

Complete: TypeAlias = Callable[[typer.Context, str], list[str]]
"""Function from the earlier words of the line and the beginning of a word to the word's completions."""


def one_of(names: Callable[[], Iterable[str]]) -> Complete:
    """Completion to names that do not depend on the other words of the line."""

    def complete(ctx: typer.Context, incomplete: str) -> list[str]:
        del ctx
        return _beginning(incomplete, names())

    return complete


def of_skillset(names: Callable[[Skillset, typer.Context], Iterable[str]]) -> Complete:
    """Completion to names of the skillset."""

    def complete(ctx: typer.Context, incomplete: str) -> list[str]:
        try:
            return _beginning(incomplete, names(_skillset(ctx), ctx))
        except (SkillwingError, SkillsetError, UnknownNameError, OSError):
            return []

    return complete


def _inputs(ctx: typer.Context, incomplete: str) -> list[str]:
    """Names of inputs, and after `NAME=` the values of an enum or a bool.

    bash splits words at `=`: the words are then `NAME`, `=` and the beginning of the value, which alone is replaced. An
    `=` at the end does not get here.
    """
    words: list[str] = list(ctx.params.get("inputs") or ())
    try:
        inputs = _skillset(ctx).skill(ctx.params.get("skill") or "").inputs
    except (SkillwingError, SkillsetError, UnknownNameError, OSError):
        return []
    values = {each.name: _values(each.type) for each in inputs}
    if not incomplete and words and words[-1] in values:
        return _beginning("", values[words[-1]])
    if words[-1:] == ["="]:
        return _beginning(incomplete, values.get("".join(words[-2:-1]), ()))
    name, equals, begun = incomplete.partition("=")
    if equals:
        return [f"{name}={value}" for value in _beginning(begun, values.get(name, ()))]
    given = {word.partition("=")[0] for word in words}
    return _beginning(incomplete, (f"{name}=" for name in values if name not in given))


def _values(kind: Type) -> tuple[str, ...]:
    """All values of a type with few of them; empty for any other type."""
    match kind:
        case EnumType(values=values):
            return values
        case ScalarType(name="bool"):
            return ("false", "true")
        case _:
            return ()


def _states(skillset: Skillset, ctx: typer.Context) -> Iterable[str]:
    """States to which an operator may switch the resource from at least one state."""
    resource = skillset.resource(ctx.params.get("resource") or "")
    return dict.fromkeys(edge.target for edge in resource.transitions if edge.extern)


skills = of_skillset(lambda skillset, _: (each.name for each in skillset.skills))
data = of_skillset(lambda skillset, _: (each.name for each in skillset.data))
skills_and_data = of_skillset(lambda skillset, _: (each.name for each in (*skillset.skills, *skillset.data)))
resources = of_skillset(lambda skillset, _: (each.name for each in skillset.resources))
states = of_skillset(_states)
inputs: Complete = _inputs
running = one_of(lambda: (state.robot for state in running_systems()))
robots = one_of(lambda: entry_points(group=ROBOTS).names)


def missions(ctx: typer.Context, incomplete: str) -> list[str]:
    """Installed missions; for a command of the group `mission` files of missions, too, and folders."""
    takes_files = ctx.parent is not None and ctx.parent.info_name == MISSION_GROUP
    files = _mission_files(incomplete) if takes_files else []
    return [*_beginning(incomplete, entry_points(group=MISSIONS).names), *files]


def _mission_files(incomplete: str) -> list[str]:
    folder, slash, begun = incomplete.rpartition("/")
    try:
        found = sorted(Path(f"{folder}{slash}" or ".").iterdir())
    except OSError:
        return []
    shown = [each for each in found if each.name.startswith(begun) and not (each.name.startswith(".") and not begun)]
    names = [each.name + ("/" if each.is_dir() else "") for each in shown if each.is_dir() or each.suffix in FILES]
    return [f"{folder}{slash}{name}" for name in names]


def _skillset(ctx: typer.Context) -> Skillset:
    robot = ctx.params.get("robot")
    if os.environ.get(CONNECT):  # no question to a system elsewhere while somebody types
        return find_robot(os.environ.get(TABLE) or DEFAULT_ROBOT).load_skillset()
    try:
        return load(find_target(robot).skillset)
    except NoSystemError:
        return find_robot(robot or DEFAULT_ROBOT).load_skillset()


def _beginning(incomplete: str, names: Iterable[str]) -> list[str]:
    return sorted(name for name in names if name.startswith(incomplete))
