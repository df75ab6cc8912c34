"""Knowledge of a skillset by parts: exact where possible, approximate elsewhere.

Resources that no skill and no event names together are independent, so each group of related resources is analysed
alone. Within a group, a skill that changes nothing does not affect the others. Each such skill is explored beside the
skills that change something.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cache
from math import prod

from skillwing.dsl.checking.reachability.approximation import Approximation
from skillwing.dsl.checking.reachability.exploration import Budget, Exploration, TooManyError
from skillwing.dsl.checking.reachability.knowledge import Knowledge, SkillSituations
from skillwing.dsl.checking.reachability.situations import Situations
from skillwing.dsl.checking.reachability.statespace import Behaviour, StateSpace
from skillwing.dsl.model import Skill
from skillwing.dsl.queries import named_by

MOST_SKILLS = 16
"""Largest number of skills in one group that change something."""
MOST_STATES = 8192
"""Largest number of combinations of the resources' states in one group."""
MOST_SITUATIONS = 4000
"""Largest number of situations of a file: an editor checks the file at every keystroke."""
_MOST_OUTCOMES = 40_000


class PartByPart:
    """Knowledge by parts (`knowledge.Knowledge`)."""

    def __init__(self, space: StateSpace) -> None:
        self._budget = Budget(MOST_SITUATIONS, _MOST_OUTCOMES)
        self._of: dict[str, tuple[Knowledge, Skill]] = {}
        """Knowledge by skill, each with that skill or with another one of equal behaviour."""
        # Small parts first: a large part may use up the budget.
        parts = sorted(_parts(space), key=lambda part: len(part.skillset.skills))
        known = [self._understand(part) for part in parts]
        self.exact = all(each.exact for each in (*known, *(each for each, _ in self._of.values())))
        self.always = Situations.side_by_side(each.always for each in known)
        self.resting = Situations.side_by_side(each.resting for each in known)

    def of(self, skill: Skill) -> SkillSituations:
        known, like = self._of[skill.name]
        return known.of(like)

    def stuck(self, skill: Skill, name: str, origins: frozenset[str]) -> list[frozenset[str]]:
        known, like = self._of[skill.name]
        return known.stuck(like, name, origins)

    def _understand(self, part: StateSpace) -> Knowledge:
        """Compute the knowledge of the resources of a part. Stores the knowledge of each of its skills."""
        movers = [skill for skill in part.skillset.skills if not part.behaviour(skill).changes_nothing]
        played = self._played(part, movers) if _may_be_played(part, len(movers)) else None
        roughly = cache(lambda: Approximation(part))
        known = played or roughly()
        watching: dict[Behaviour, tuple[Knowledge, Skill]] = {}
        for skill in part.skillset.skills:
            behaviour = part.behaviour(skill)
            if played is None or not behaviour.changes_nothing:
                self._of[skill.name] = known, skill
                continue
            if behaviour not in watching:
                watching[behaviour] = self._played(part, [*movers, skill]) or roughly(), skill
            self._of[skill.name] = watching[behaviour]
        return known

    def _played(self, part: StateSpace, skills: Iterable[Skill]) -> Exploration | None:
        try:
            self._budget.spend(situations=1)
            return Exploration(part.part(part.names, skills, part.skillset.events), self._budget)
        except TooManyError:
            return None


def _may_be_played(part: StateSpace, movers: int) -> bool:
    combinations = prod(len(resource.states) for resource in part.skillset.resources)
    return movers <= MOST_SKILLS and combinations <= MOST_STATES and part.unconstrained.isdisjoint(part.names)


def _parts(space: StateSpace) -> Iterator[StateSpace]:
    """The groups of related resources, with the skills and events that name them.

    Skills and events that name no resource are a group of their own.
    """
    skills = [(skill, space.behaviour(skill).names) for skill in space.skillset.skills]
    events = [(event, tuple(sorted(named_by(event)))) for event in space.skillset.events]
    ties = {names for _, names in (*skills, *events)}
    groups = _groups(space.names, ties)
    for group in dict.fromkeys([*groups.values(), frozenset[str]()]):
        yield space.part(
            group,
            [skill for skill, names in skills if _group_of(names, groups) == group],
            [event for event, names in events if _group_of(names, groups) == group],
        )


def _groups(names: Iterable[str], ties: Iterable[tuple[str, ...]]) -> dict[str, frozenset[str]]:
    """The group of each name: the smallest groups such that no tie crosses two of them."""
    groups = {name: frozenset((name,)) for name in names}
    for tie in ties:
        joined = frozenset[str]().union(*(groups[name] for name in tie))
        groups |= dict.fromkeys(joined, joined)
    return groups


def _group_of(names: tuple[str, ...], groups: dict[str, frozenset[str]]) -> frozenset[str]:
    return groups[names[0]] if names else frozenset()
