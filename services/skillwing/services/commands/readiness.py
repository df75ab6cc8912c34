"""Who can make a skill ready: what to tell whose start was refused because preconditions fail."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from math import prod

from skillwing.dsl.expressions import Expression, names_used
from skillwing.dsl.guards import holds, sufficient_changes
from skillwing.dsl.model import Skill, Skillset
from skillwing.dsl.suggest import listed

_MOST_COMBINATIONS = 4096


def ways_out(skillset: Skillset, skill: Skill, failing: Sequence[str], states: Mapping[str, str]) -> Iterator[str]:
    """For each failing precondition, who can make it hold, in sentences that begin with its name.

    failing: as in the terminal answer, where `effect take` is a start effect that cannot be applied. states: of the
    resources, as they are now; a precondition that holds meanwhile is told, too.
    """
    for check in skill.preconditions.checks:
        if check.name not in failing:
            continue
        if check.kind == "resource" and holds(check.expression, states):
            yield f"{check.name}: holds by now. Start it again."
            continue
        wanted = _wanted(skillset, check.expression, states) if check.kind == "resource" else {}
        for resource, targets in wanted.items():
            yield f"{check.name}: {_who_moves(skillset, resource, states[resource], targets)}"
        for name in sorted(names_used(check.expression, "data")):
            yield f"{check.name}: `{name}` is for the robot to tell; see it with `skillwing data {name}`."
        for name in sorted(names_used(check.expression, "input")):
            yield f"{check.name}: `{name}` is an input of the start; give another one."
    for effect in skill.effects:
        if (name := f"effect {effect.name}") in failing:
            for resource, target in effect.transitions:
                edges = skillset.resource(resource).transitions
                sources = [edge.source for edge in edges if edge.target == target and not edge.extern]
                if states[resource] not in (*sources, target):
                    yield f"{name}: {_who_moves(skillset, resource, states[resource], sources)}"


def _wanted(skillset: Skillset, guard: Expression, states: Mapping[str, str]) -> dict[str, list[str]]:
    """The states in which a guard would hold, for each resource that could make it so alone; else for all it names."""
    names = sorted(names_used(guard, "resource"))
    every = {name: skillset.resource(name).states for name in names}
    alone = sufficient_changes(guard, skillset, states)
    if alone or prod(map(len, every.values())) > _MOST_COMBINATIONS:
        return alone
    together = [dict(zip(names, chosen, strict=True)) for chosen in product(*every.values())]
    good = [each for each in together if holds(guard, {**states, **each})]
    found = {name: sorted({each[name] for each in good}, key=every[name].index) for name in names}
    return {name: targets for name, targets in found.items() if targets and states[name] not in targets}


def _who_moves(skillset: Skillset, resource: str, present: str, targets: Sequence[str]) -> str:
    edges = skillset.resource(resource).transitions
    reported = [edge.target for edge in edges if edge.extern and edge.source == present and edge.target in targets]
    skills = [
        skill.name
        for skill in skillset.skills
        if any(
            name == resource and target in targets for effect in skill.effects for name, target in effect.transitions
        )
    ]
    aim = f"`{resource}` has to become {' or '.join(targets)}"
    ways: list[str] = []
    if reported:
        by_hand = f"`skillwing trigger {resource} {reported[0]}`"
        ways.append(f"the robot reports that, or {by_hand} does in its place")
    if skills:
        ways.append(f"so it does by {'an effect' if len(skills) == 1 else 'effects'} of {listed(skills)}")
    if not ways:
        return f"{aim}; nothing leads there from {present} at once."
    return f"{aim}; {'; '.join(ways)}."
