"""What would make a guard on resources hold. Pure."""

from __future__ import annotations

from collections.abc import Mapping

from skillwing.dsl.expressions import Environment, Expression, evaluate, names_used
from skillwing.dsl.model import Skillset


def holds(guard: Expression, states: Mapping[str, str]) -> bool:
    """Whether a guard that names nothing but resources holds. Raises KeyError for a resource without a state."""
    return evaluate(guard, Environment(resources=states))


def sufficient_changes(guard: Expression, skillset: Skillset, states: Mapping[str, str]) -> dict[str, list[str]]:
    """The resources each of which could make a guard hold, all others as they are, and the states in which it would.

    Empty where it takes more than one. Whether a transition leads to such a state is not asked.
    """
    found: dict[str, list[str]] = {}
    for name in sorted(names_used(guard, "resource")):
        if good := [state for state in skillset.resource(name).states if holds(guard, {**states, name: state})]:
            found[name] = good
    return found
