"""Queries on a model: resources that skills take and need, guards that hold, and changes that make them hold. Pure."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from itertools import product
from math import prod

from skillwing.dsl.expressions import (
    Comparison,
    Environment,
    Expression,
    Name,
    NamedValue,
    evaluate,
    names_used,
    terms,
)
from skillwing.dsl.model import Effect, Event, Skill, Skillset

_MOST_COMBINATIONS = 4096


# --- skills and events


def taken_by(skill: Skill) -> dict[str, str]:
    """The resources that a start of the skill changes, each with its new state."""
    return dict(skill.transitions(skill.preconditions.success))


def changed_by(skill: Skill) -> frozenset[str]:
    """The resources that an effect of the skill names."""
    return frozenset(resource for effect in skill.effects for resource, _ in effect.transitions)


def unapplied_effects(skill: Skill) -> list[Effect]:
    """The effects of the skill that nothing in it applies."""
    applied = {
        skill.preconditions.success,
        skill.preconditions.failure,
        skill.interrupt.apply,
        skill.lost,
        *(invariant.violation for invariant in skill.invariants),
        *(result.apply for result in skill.results),
    }
    return [effect for effect in skill.effects if effect.name not in applied]


def can_bring(skill: Skill, resource: str, targets: Collection[str]) -> bool:
    """True if the skill has an effect that brings the resource to one of these states."""
    changes = (change for effect in skill.effects for change in effect.transitions)
    return any(name == resource and target in targets for name, target in changes)


def checks_of(skill: Skill) -> dict[str, frozenset[str]]:
    """The resources that each precondition of the skill names, by the name of the precondition."""
    return {check.name: names_used(check.expression, "resource") for check in skill.preconditions.checks}


def needed_by(skill: Skill) -> frozenset[str]:
    """The resources that the preconditions of the skill name."""
    return frozenset[str]().union(*checks_of(skill).values())


def guards_of(skill: Skill) -> Iterator[Expression]:
    """The preconditions, invariants and postconditions of a skill."""
    yield from (check.expression for check in skill.preconditions.checks)
    yield from (invariant.expression for invariant in skill.invariants)
    yield from (result.post for result in skill.results if result.post is not None)


def guarded_by(skill: Skill) -> frozenset[str]:
    """The resources that a guard of the skill names."""
    return frozenset(name for guard in guards_of(skill) for name in names_used(guard, "resource"))


def named_by(element: Skill | Event) -> frozenset[str]:
    """All resources that a skill or an event names."""
    if isinstance(element, Skill):
        return guarded_by(element) | changed_by(element)
    guarded = frozenset[str]() if element.guard is None else names_used(element.guard, "resource")
    return guarded.union(name for name, _ in element.effect.transitions)


def states_named(skillset: Skillset) -> frozenset[tuple[str, str]]:
    """The states that guards and effects name, each with its resource."""
    guards = [event.guard for event in skillset.events if event.guard is not None]
    guards += [guard for skill in skillset.skills for guard in guards_of(skill)]
    effects = [event.effect for event in skillset.events]
    effects += [effect for skill in skillset.skills for effect in skill.effects]
    asked = (pair for guard in guards for pair in _states_asked(guard))
    return frozenset(asked).union(change for effect in effects for change in effect.transitions)


def _states_asked(guard: Expression) -> Iterator[tuple[str, str]]:
    for term in terms(guard):
        match term:
            case Comparison(left=Name(scope="resource") as name, right=NamedValue(name=state)):
                yield name.root, state
            case Comparison(left=NamedValue(name=state), right=Name(scope="resource") as name):
                yield name.root, state
            case _:
                pass


def data_in_guards(skillset: Skillset) -> frozenset[str]:
    """The data that a guard of the skillset names."""
    guards = [event.guard for event in skillset.events if event.guard is not None]
    guards += [guard for skill in skillset.skills for guard in guards_of(skill)]
    return frozenset(name for guard in guards for name in names_used(guard, "data"))


# --- states


def holds(guard: Expression, states: Mapping[str, str]) -> bool:
    """True if a guard on resources alone holds. Raises UnboundNameError for a resource without a state."""
    return evaluate(guard, Environment(resources=states))


def sufficient_changes(guard: Expression, skillset: Skillset, states: Mapping[str, str]) -> dict[str, list[str]]:
    """The resources that could each make a guard hold alone, with the states in which it would.

    Empty if more than one resource has to change. Transitions are not considered.
    """
    found: dict[str, list[str]] = {}
    for name in sorted(names_used(guard, "resource")):
        if good := [state for state in skillset.resource(name).states if holds(guard, {**states, name: state})]:
            found[name] = good
    return found


def wanted_states(guard: Expression, skillset: Skillset, states: Mapping[str, str]) -> dict[str, list[str]]:
    """Wanted states as in `sufficient_changes`, or of all resources that have to change if one is not enough."""
    names = sorted(names_used(guard, "resource"))
    every = {name: skillset.resource(name).states for name in names}
    alone = sufficient_changes(guard, skillset, states)
    if alone or prod(map(len, every.values())) > _MOST_COMBINATIONS:
        return alone
    together = [dict(zip(names, chosen, strict=True)) for chosen in product(*every.values())]
    good = [each for each in together if holds(guard, {**states, **each})]
    found = {name: sorted({each[name] for each in good}, key=every[name].index) for name in names}
    return {name: targets for name, targets in found.items() if targets and states[name] not in targets}


def blocked_at_start(skill: Skill, skillset: Skillset, states: Mapping[str, str]) -> frozenset[str]:
    """The resources that the start effect of a skill cannot change from these states."""
    taken = taken_by(skill).items()
    return frozenset(
        name for name, target in taken if not skillset.resource(name).allows(states[name], target, extern=False)
    )


def could_start(skill: Skill, skillset: Skillset, states: Mapping[str, str]) -> bool:
    """True if the states of resources allow a start of the skill. Data and inputs are not considered."""
    checks = [check.expression for check in skill.preconditions.checks if check.kind == "resource"]
    return all(holds(check, states) for check in checks) and not blocked_at_start(skill, skillset, states)
