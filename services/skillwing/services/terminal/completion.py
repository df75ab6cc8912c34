"""Shell completion: names of the running skillset, or else of the robot that `up` starts by default.

Names come from the skillset's file, without a query to the system. A file that cannot be read gives no names, because a
shell shows no errors during completion.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from importlib.metadata import entry_points
from typing import TypeAlias

import typer

from skillwing.dsl import SkillsetError, load
from skillwing.dsl.model import Skillset, UnknownNameError
from skillwing.services.client.connection import DEFAULT_ROBOT, find_target
from skillwing.services.errors import NoSystemError, SkillwingError
from skillwing.services.processes.run_state import running_systems
from skillwing.services.robot import ROBOTS, find_robot

MISSIONS = "skillwing.missions"

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


def _input_words(skillset: Skillset, ctx: typer.Context) -> Iterable[str]:
    given = {word.partition("=")[0] for word in ctx.params.get("inputs") or ()}
    inputs = skillset.skill(ctx.params.get("skill") or "").inputs
    return [f"{each.name}=" for each in inputs if each.name not in given]


def _states(skillset: Skillset, ctx: typer.Context) -> Iterable[str]:
    """States to which an operator may switch the resource from at least one state."""
    resource = skillset.resource(ctx.params.get("resource") or "")
    return dict.fromkeys(edge.target for edge in resource.transitions if edge.extern)


skills = of_skillset(lambda skillset, _: (each.name for each in skillset.skills))
data = of_skillset(lambda skillset, _: (each.name for each in skillset.data))
skills_and_data = of_skillset(lambda skillset, _: (each.name for each in (*skillset.skills, *skillset.data)))
resources = of_skillset(lambda skillset, _: (each.name for each in skillset.resources))
states = of_skillset(_states)
inputs = of_skillset(_input_words)
running = one_of(lambda: (state.robot for state in running_systems()))
robots = one_of(lambda: entry_points(group=ROBOTS).names)
missions = one_of(lambda: entry_points(group=MISSIONS).names)


def _skillset(ctx: typer.Context) -> Skillset:
    robot = ctx.params.get("robot")
    try:
        return load(find_target(robot).skillset)
    except NoSystemError:
        return find_robot(robot or DEFAULT_ROBOT).load_skillset()


def _beginning(incomplete: str, names: Iterable[str]) -> list[str]:
    return sorted(name for name in names if name.startswith(incomplete))
