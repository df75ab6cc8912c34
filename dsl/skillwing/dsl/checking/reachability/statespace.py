"""Resources, effects and predicates of a skillset in the form that the analysis uses."""

from __future__ import annotations

import copy
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import TypeAlias

from skillwing.dsl.checking.reachability.relations import Relation, Relations
from skillwing.dsl.checking.reachability.situations import Changes
from skillwing.dsl.expressions import Expression
from skillwing.dsl.model import Event, Resource, Skill, Skillset
from skillwing.dsl.queries import unapplied_effects

Guard: TypeAlias = Relation | None
"""A predicate: its relation, or None if it may be true or false in any situation (`Relations.of`)."""


@dataclass(frozen=True, slots=True)
class Behaviour:
    """The behaviour of a skill without its names. Skills of equal behaviour are analysed once.

    checks, invariants, results: in declaration order; an invariant with its violation effect, a result with its effect
    and postcondition. unapplied: the effects that nothing applies. names: of all resources that the skill names.
    """

    names: tuple[str, ...]
    checks: tuple[Guard, ...]
    start: Changes
    refusal: Changes
    invariants: tuple[tuple[Guard, Changes], ...]
    results: tuple[tuple[Changes, Guard], ...]
    interrupt: Changes
    lost: Changes
    unapplied: tuple[Changes, ...]

    @property
    def judged_checks(self) -> list[Relation]:
        return [check for check in self.checks if check is not None]

    @property
    def judged_invariants(self) -> list[Relation]:
        return [guard for guard, _ in self.invariants if guard is not None]

    @property
    def changes_nothing(self) -> bool:
        return not any(self.effects())

    def effects(self) -> Iterator[Changes]:
        yield from (self.start, self.refusal, self.interrupt, self.lost)
        yield from (effect for _, effect in self.invariants)
        yield from (effect for effect, _ in self.results)


class StateSpace:
    """The resources of a skillset, its effects and its predicates. names: of all resources, in declaration order.

    unconstrained: resources that an unknown element may move at any time, by any of their transitions.
    """

    def __init__(self, skillset: Skillset, unconstrained: Collection[str] = ()) -> None:
        self.skillset = skillset
        self.unconstrained = frozenset(unconstrained)
        self.relations = Relations(skillset.resources)
        self.names = tuple(resource.name for resource in skillset.resources)
        self._resources = {resource.name: resource for resource in skillset.resources}
        self._sources: dict[tuple[str, str, bool], frozenset[str]] = {}
        for resource in skillset.resources:
            for extern in (False, True):
                for target in resource.states:
                    edges = (edge for edge in resource.transitions if (edge.target, edge.extern) == (target, extern))
                    # Naming the state that a resource is in is open to everybody and changes nothing.
                    sources = frozenset({target, *(edge.source for edge in edges)})
                    self._sources[resource.name, target, extern] = sources
        self._changes: dict[tuple[tuple[tuple[str, str], ...], bool], Changes] = {}
        self._behaviours = {skill.name: self._behaviour(skill) for skill in skillset.skills}

    def part(self, names: Collection[str], skills: Iterable[Skill], events: Iterable[Event]) -> StateSpace:
        """A part with some of the resources, and with the skills and events that name no others."""
        resources = tuple(resource for resource in self.skillset.resources if resource.name in names)
        part = copy.copy(self)
        part.names = tuple(resource.name for resource in resources)
        part.skillset = replace(self.skillset, resources=resources, skills=tuple(skills), events=tuple(events))
        return part

    def resource(self, name: str) -> Resource:
        return self._resources[name]

    def behaviour(self, skill: Skill) -> Behaviour:
        return self._behaviours[skill.name]

    def guard(self, expression: Expression | None) -> Guard:
        return None if expression is None else self.relations.of(expression)

    def changes(self, transitions: tuple[tuple[str, str], ...], extern: bool = False) -> Changes:
        """The transitions of an effect, each with its source states."""
        key = transitions, extern
        if key not in self._changes:
            self._changes[key] = tuple((name, state, self._sources[name, state, extern]) for name, state in transitions)
        return self._changes[key]

    def event(self, event: Event) -> Changes:
        return self.changes(event.effect.transitions, extern=True)

    def _behaviour(self, skill: Skill) -> Behaviour:
        effects: dict[str | None, Changes] = {effect.name: self.changes(effect.transitions) for effect in skill.effects}
        effects[None] = ()
        checks = tuple([self.guard(check.expression) for check in skill.preconditions.checks])
        invariants = tuple([(self.guard(item.expression), effects[item.violation]) for item in skill.invariants])
        results = tuple([(effects[result.apply], self.guard(result.post)) for result in skill.results])
        guards = (*checks, *(guard for guard, _ in invariants), *(post for _, post in results))
        named = {name for guard in guards if guard is not None for name in guard.names}
        changed = {name for changes in effects.values() for name, _, _ in changes}
        return Behaviour(
            tuple(sorted(named | changed)),
            checks,
            effects[skill.preconditions.success],
            effects[skill.preconditions.failure],
            invariants,
            results,
            effects[skill.interrupt.apply],
            effects[skill.lost],
            tuple([effects[effect.name] for effect in unapplied_effects(skill)]),
        )


def closure(starts: Iterable[str], edges: Iterable[tuple[str, str]]) -> frozenset[str]:
    """The states that are reachable by edges from the first ones."""
    pairs = list(edges)
    reached = set(starts)
    frontier = list(reached)
    while frontier:
        here = frontier.pop()
        for source, target in pairs:
            if source == here and target not in reached:
                reached.add(target)
                frontier.append(target)
    return frozenset(reached)
