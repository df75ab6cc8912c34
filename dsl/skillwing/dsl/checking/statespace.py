"""The states that resources can be in, and reasoning about them by enumeration."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from itertools import product
from math import prod

from skillwing.dsl.expressions import Environment, Expression, evaluate, names_used, references
from skillwing.dsl.model import Resource, Skill, Skillset
from skillwing.dsl.suggest import listed

_MOST_ASSIGNMENTS = 100_000  # beyond this the checker does not enumerate, and stays silent

Assignment = Mapping[str, str]
Possible = Mapping[str, frozenset[str]]


class StateSpace:
    """Where the resources of a skillset can get to.

    reachable: for each resource, the states that some chain of its transitions leads to from the initial one.
    """

    def __init__(self, skillset: Skillset) -> None:
        self._resources = {resource.name: resource for resource in skillset.resources}
        driven = {pair for skill in skillset.skills for effect in skill.effects for pair in effect.transitions}
        self._edges: dict[str, list[tuple[str, str]]] = {}
        self.reachable: dict[str, frozenset[str]] = {}
        for resource in skillset.resources:
            edges = [(edge.source, edge.target) for edge in resource.transitions]
            self.reachable[resource.name] = _closure({resource.initial}, edges)
            self._edges[resource.name] = [
                (edge.source, edge.target)
                for edge in resource.transitions
                if edge.extern or (resource.name, edge.target) in driven
            ]

    def resource(self, name: str) -> Resource:
        return self._resources[name]

    def drift(self, name: str, states: Iterable[str]) -> frozenset[str]:
        """Where the functional layer and the skills together can bring a resource that is in one of `states`."""
        return _closure(states, self._edges[name])

    def assignments(self, names: Collection[str], possible: Possible | None = None) -> Iterator[dict[str, str]]:
        """Every combination of states of the named resources, or none at all if they are too many to enumerate."""
        ordered = sorted(names)
        choices = [sorted((possible or self.reachable)[name]) for name in ordered]
        if prod(len(choice) for choice in choices) > _MOST_ASSIGNMENTS:
            return
        for states in product(*choices):
            yield dict(zip(ordered, states, strict=True))

    def enumerable(self, names: Collection[str]) -> bool:
        """Tell whether `assignments` enumerates these resources."""
        return prod(len(self.reachable[name]) for name in names) <= _MOST_ASSIGNMENTS


def about_resources(expression: Expression) -> bool:
    """Tell whether the expression speaks of resources only, so that enumeration can judge it."""
    return all(name.scope == "resource" for name in references(expression))


def resources_of(expressions: Iterable[Expression]) -> frozenset[str]:
    """The resources that any of the expressions names."""
    return frozenset[str]().union(*(names_used(expression, "resource") for expression in expressions))


def holds(expression: Expression, states: Assignment) -> bool:
    return evaluate(expression, Environment(resources=states))


def satisfiable(expression: Expression, space: StateSpace) -> bool:
    """Tell whether some states of the resources named satisfy the expression; assumed where they are too many."""
    names = names_used(expression, "resource")
    return not space.enumerable(names) or any(holds(expression, states) for states in space.assignments(names))


def described(states: Assignment) -> str:
    """Say an assignment in words, for a message."""
    return listed(f"{name} == {state}" for name, state in sorted(states.items())) if states else "always"


def start_applies(skill: Skill, states: Assignment, space: StateSpace) -> bool:
    """Tell whether every transition of the start effect can be taken from `states`."""
    return all(
        space.resource(name).allows(states[name], target, extern=False)
        for name, target in skill.transitions(skill.preconditions.success)
    )


def _closure(starts: Iterable[str], edges: Iterable[tuple[str, str]]) -> frozenset[str]:
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
