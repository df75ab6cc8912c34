"""Advice after a refused start: the ways to make each failing precondition hold."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from skillwing.dsl.expressions import names_used
from skillwing.dsl.model import Skill, Skillset
from skillwing.dsl.queries import can_bring, holds, taken_by, wanted_states
from skillwing.dsl.suggest import listed
from skillwing.services.diagnosis.consequences import causes
from skillwing.services.terminal.system_state import SystemState


def start_advice(skillset: Skillset, skill: Skill, failing: Sequence[str], now: SystemState) -> Iterator[str]:
    """A sentence for each failing precondition, which begins with its name.

    failing: as in the terminal answer, in which `effect take` is a start effect that cannot be applied. A precondition
    that holds by now has a sentence, too.
    """
    for check in skill.preconditions.checks:
        if check.name not in failing:
            continue
        if check.kind == "resource" and holds(check.expression, now.states):
            yield f"{check.name}: holds by now. Start it again."
            continue
        wanted = wanted_states(check.expression, skillset, now.states) if check.kind == "resource" else {}
        for resource, targets in wanted.items():
            yield f"{check.name}: {_way_to_state(skillset, resource, targets, now)}"
        for name in sorted(names_used(check.expression, "data")):
            yield f"{check.name}: {_way_to_datum(name, now)}"
        for name in sorted(names_used(check.expression, "input")):
            yield f"{check.name}: `{name}` is an input of the start; give another one."
    for effect in skill.effects:
        if (name := f"effect {effect.name}") in failing:
            for resource, target in effect.transitions:
                edges = skillset.resource(resource).transitions
                sources = [edge.source for edge in edges if edge.target == target and not edge.extern]
                if now.states[resource] not in (*sources, target):
                    yield f"{name}: {_way_to_state(skillset, resource, sources, now)}"


def busy_advice(skill: str, mission: str | None) -> str:
    """Advice about a goal of the same skill. mission: its mission, as in `SystemState.running`."""
    return f"`{skill}` runs{_started_by(mission)}; {_way_to_end(skill, mission)}"


def _way_to_state(skillset: Skillset, resource: str, targets: Sequence[str], now: SystemState) -> str:
    """The skill that holds a resource, or the ways to bring the resource to one of these states."""
    for name, mission in now.running.items():
        skill = skillset.skill(name)
        taken = taken_by(skill)
        if resource in taken and can_bring(skill, resource, targets):
            return f"`{name}` holds `{resource}`{_started_by(mission)}; {_way_to_end(name, mission)}"
    present = now.states[resource]
    edges = skillset.resource(resource).transitions
    reported = [edge.target for edge in edges if edge.extern and edge.source == present and edge.target in targets]
    aim = f"`{resource}` has to become {' or '.join(targets)}"
    ways: list[str] = []
    if reported:
        ways.append(_way_to_report(skillset, resource, reported, now))
    if skills := [skill.name for skill in skillset.skills if can_bring(skill, resource, targets)]:
        ways.append(f"so it does by {'an effect' if len(skills) == 1 else 'effects'} of {listed(skills)}")
    if not ways:
        return f"{aim}; nothing leads there from {present} at once."
    return f"{aim}; {'; '.join(ways)}."


def _started_by(mission: str | None) -> str:
    return "" if mission is None else f" for mission `{mission}`"


def _way_to_end(skill: str, mission: str | None) -> str:
    if mission is None:
        return f"`skillwing interrupt {skill}` ends it."
    return "`skillwing mission abort` calls it off and runs its rescue."


def _way_to_report(skillset: Skillset, resource: str, targets: Sequence[str], now: SystemState) -> str:
    """The ways to a state that skills do not set. `trigger` is one only without a robot, which would undo it."""
    starts = " or ".join(
        f"`skillwing start {name}`" for name in causes(skillset, resource, targets, now.states, now.reactions)
    )
    by_hand = f"`skillwing trigger {resource} {targets[0]}`"
    match now.reporter:
        case "robot":
            return f"the robot reports that after {starts}" if starts else "only the robot can report that"
        case "mock":
            return f"the mocked world does that after {starts}, or {by_hand}" if starts else f"here {by_hand} does that"
        case "nobody":
            return f"no bridge is there to report that (docs/robots.md), {by_hand} does in its place"


def _way_to_datum(datum: str, now: SystemState) -> str:
    publishers = now.published_by.get(datum, ())
    if publishers and now.reporter == "robot" and now.running.keys().isdisjoint(publishers):
        return f"`{datum}` comes only while one runs that publishes it: {listed(publishers)}."
    if datum not in now.unheard:
        return f"`{datum}` comes from the robot; see it with `skillwing data {datum}`."
    if now.reporter == "nobody":
        mocks = f"or mock it: `skillwing down`, then `skillwing up --robot {now.robot} --mock`"
        return f"`{datum}` was never received: no bridge runs. Write one (docs/robots.md), {mocks}."
    return f"`{datum}` was never received; `skillwing doctor` checks the processes that should publish it."
