"""Who can make a skill ready: what to tell whose start was refused because preconditions fail."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from skillwing.dsl.expressions import names_used
from skillwing.dsl.guards import holds
from skillwing.dsl.model import Skill, Skillset
from skillwing.dsl.suggest import listed
from skillwing.services.diagnosis.consequences import causes, states_wanted
from skillwing.services.terminal.system_state import Situation


def ways_out(skillset: Skillset, skill: Skill, failing: Sequence[str], now: Situation) -> Iterator[str]:
    """For each failing precondition, who can make it hold, in sentences that begin with its name.

    failing: as in the terminal answer, where `effect take` is a start effect that cannot be applied. A precondition
    that holds meanwhile is told, too.
    """
    for check in skill.preconditions.checks:
        if check.name not in failing:
            continue
        if check.kind == "resource" and holds(check.expression, now.states):
            yield f"{check.name}: holds by now. Start it again."
            continue
        wanted = states_wanted(skillset, check.expression, now.states) if check.kind == "resource" else {}
        for resource, targets in wanted.items():
            yield f"{check.name}: {_who_moves(skillset, resource, targets, now)}"
        for name in sorted(names_used(check.expression, "data")):
            yield f"{check.name}: {_who_tells(name, now)}"
        for name in sorted(names_used(check.expression, "input")):
            yield f"{check.name}: `{name}` is an input of the start; give another one."
    for effect in skill.effects:
        if (name := f"effect {effect.name}") in failing:
            for resource, target in effect.transitions:
                edges = skillset.resource(resource).transitions
                sources = [edge.source for edge in edges if edge.target == target and not edge.extern]
                if now.states[resource] not in (*sources, target):
                    yield f"{name}: {_who_moves(skillset, resource, sources, now)}"


def way_out_of_busy(skill: str, mission: str | None) -> str:
    """What to do about a goal of the same skill. mission: which has started it, as in `Situation.running`."""
    return f"`{skill}` runs{_started_by(mission)}; {_way_to_end(skill, mission)}"


def _who_moves(skillset: Skillset, resource: str, targets: Sequence[str], now: Situation) -> str:
    """Who holds a resource that a skill needs in another state, or who brings it there."""
    for name, mission in now.running.items():
        skill = skillset.skill(name)
        taken = dict(skill.transitions(skill.preconditions.success))
        if resource in taken and _leads(skill, resource, targets):
            return f"`{name}` holds `{resource}`{_started_by(mission)}; {_way_to_end(name, mission)}"
    present = now.states[resource]
    edges = skillset.resource(resource).transitions
    reported = [edge.target for edge in edges if edge.extern and edge.source == present and edge.target in targets]
    aim = f"`{resource}` has to become {' or '.join(targets)}"
    ways: list[str] = []
    if reported:
        ways.append(_who_reports(skillset, resource, reported, now))
    if skills := [skill.name for skill in skillset.skills if _leads(skill, resource, targets)]:
        ways.append(f"so it does by {'an effect' if len(skills) == 1 else 'effects'} of {listed(skills)}")
    if not ways:
        return f"{aim}; nothing leads there from {present} at once."
    return f"{aim}; {'; '.join(ways)}."


def _started_by(mission: str | None) -> str:
    return "" if mission is None else f" for mission `{mission}`"


def _way_to_end(skill: str, mission: str | None) -> str:
    if mission is None:
        return f"`skillwing interrupt {skill}` ends it."
    return "`skillwing mission abort` calls it off, which lands a drone."


def _leads(skill: Skill, resource: str, targets: Sequence[str]) -> bool:
    return any(
        name == resource and target in targets for effect in skill.effects for name, target in effect.transitions
    )


def _who_reports(skillset: Skillset, resource: str, targets: Sequence[str], now: Situation) -> str:
    """Who brings a resource to a state that skills do not give it. By hand only where no robot would contradict."""
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


def _who_tells(datum: str, now: Situation) -> str:
    publishers = now.published_by.get(datum, ())
    if publishers and now.reporter == "robot" and now.running.keys().isdisjoint(publishers):
        return f"`{datum}` comes only while one runs that publishes it: {listed(publishers)}."
    if datum not in now.unheard:
        return f"`{datum}` is for the robot to tell; see it with `skillwing data {datum}`."
    if now.reporter == "nobody":
        mocks = f"or mock it: `skillwing down`, then `skillwing up --robot {now.robot} --mock`"
        return f"`{datum}` was never received: no bridge runs. Write one (docs/robots.md), {mocks}."
    return f"`{datum}` was never received; `skillwing doctor` tells whether all runs that should publish it."
