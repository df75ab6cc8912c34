"""Skills that bring a robot into a state which only the robot itself reports.

Effects of skills change only the resources that skills own. That a forklift has a pallet after `pick` follows from a
postcondition, or from the script of the robot's mock.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from skillwing.dsl.expressions import names_used
from skillwing.dsl.model import Result, Skill, Skillset
from skillwing.dsl.queries import holds, wanted_states
from skillwing.services.errors import InvalidOptionError

if TYPE_CHECKING:
    from skillwing.services.mocking.script import Reaction, When


def causes(
    skillset: Skillset,
    resource: str,
    targets: Collection[str],
    states: Mapping[str, str],
    reactions: Iterable[Reaction],
    *,
    mocked: bool,
) -> list[str]:
    """The skills after which a resource is in one of these states; not those that first need another state of it.

    The robot's mock does it when they begin or succeed, or the postcondition of their success promises it. A mocked
    world keeps no such promise. states: of all resources now. reactions: of the mock.
    """
    moments = [each.when for each in reactions if each.when and each.trigger.get(resource) in targets]

    def brings(skill: Skill) -> bool:
        promised = not mocked and any(
            _promises(skillset, result, resource, targets, states) for result in skill.results
        )
        return promised or any(_is_begin_or_success(skill, moment) for moment in moments)

    found = [skill for skill in skillset.skills if brings(skill)]
    return [skill.name for skill in found if not _waits_for(skillset, skill, resource, states)]


def reactions_known(file: Path, skillset: Skillset) -> tuple[Reaction, ...]:
    """Reactions of this robot's mock, from the script beside its skillset file; none for a file that cannot be read."""
    from skillwing.services.mocking.script_file import load_scripts  # noqa: PLC0415 - needed when something is amiss
    from skillwing.services.mocking.system import scripts_for  # noqa: PLC0415

    try:
        return load_scripts(scripts_for(file), skillset).reactions
    except (InvalidOptionError, OSError):
        return ()


def _is_begin_or_success(skill: Skill, moment: When) -> bool:
    if moment.starts == skill.name:
        return True
    endings = {moment.ending} if isinstance(moment.ending, str) else set(moment.ending)
    successes = {result.name for result in skill.results if result.success}
    return moment.ends == skill.name and (not moment.ending or not successes.isdisjoint(endings))


def _waits_for(skillset: Skillset, skill: Skill, resource: str, states: Mapping[str, str]) -> bool:
    """True if a precondition of the skill fails because of this resource."""
    demands = [check.expression for check in skill.preconditions.checks if check.kind == "resource"]
    failing = [expression for expression in demands if not holds(expression, states)]
    return any(resource in wanted_states(expression, skillset, states) for expression in failing)


def _promises(
    skillset: Skillset, result: Result, resource: str, targets: Collection[str], states: Mapping[str, str]
) -> bool:
    """True for a success whose postcondition puts this resource into one of these states."""
    if not result.success or result.post is None or names_used(result.post, "data") | names_used(result.post, "input"):
        return False
    promised = wanted_states(result.post, skillset, states).get(resource, [])
    return bool(promised) and set(promised) <= set(targets)
