"""Advice on a skill that may not start: the ways to make each failing precondition hold."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from skillwing.dsl.model import Skillset
from skillwing.dsl.suggest import listed
from skillwing.services.diagnosis.consequences import causes
from skillwing.services.protocol import FailingCheck, Holder, MissingState, SkillReady
from skillwing.services.ready_reasons import goal_text, holding
from skillwing.services.terminal.system_state import SystemState


def start_advice(skillset: Skillset, ready: SkillReady, failing: Sequence[str], now: SystemState) -> Iterator[str]:
    """Advice after a refused start. failing: as in the terminal answer; ready: the readiness now.

    A precondition that holds by now has a sentence, too.
    """
    skill = skillset.skill(ready.skill)
    still = {check.name for check in ready.failing}
    own = [*(check.name for check in skill.preconditions.checks), f"effect {skill.preconditions.success}"]
    yield from (f"{name}: holds by now. Start it again." for name in own if name in failing and name not in still)
    yield from ready_advice(skillset, ready, now)


def ready_advice(skillset: Skillset, ready: SkillReady, now: SystemState) -> Iterator[str]:
    """A sentence on the running goal of a skill, and on each resource, datum and input of a failing precondition.

    Those on a precondition begin with its name. A resource that the running goal holds has none of its own.
    """
    if (running := ready.running) is not None:
        goal = goal_text(running, _mission_name(running, now))
        yield f"`{running.skill}` runs for {goal}; {_way_to_end(running, now)}"
    for check in ready.failing:
        missing = [each for each in check.missing if running is None or each.holder != running]
        yield from (f"{check.name}: {_way_to_state(skillset, each, now)}" for each in missing)
        yield from (f"{check.name}: {way}" for way in _ways_to_values(check, now))


def _ways_to_values(check: FailingCheck, now: SystemState) -> Iterator[str]:
    for name in check.data:
        yield _way_to_datum(name, now)
    for name in check.inputs:
        yield f"`{name}` is an input of the start; give another one."


def _way_to_state(skillset: Skillset, missing: MissingState, now: SystemState) -> str:
    """The goal that holds a resource, or the ways to bring the resource to a wanted state."""
    if (holder := missing.holder) is not None:
        return f"{holding(missing.resource, holder, _mission_name(holder, now))}; {_way_to_end(holder, now)}"
    ways: list[str] = []
    if missing.events:
        some = "the event" if len(missing.events) == 1 else "each of the events"
        ways.append(f"{some} {listed(missing.events)} does that")
    if missing.extern:
        ways.append(_way_to_report(skillset, missing.resource, missing.extern, now))
    if missing.skills:
        effects = "an effect" if len(missing.skills) == 1 else "effects"
        ways.append(f"so it does by {effects} of {listed(missing.skills)}")
    aim = f"`{missing.resource}` has to become {' or '.join(missing.wanted)}"
    if not ways:
        return f"{aim}; nothing leads there from {missing.state} at once."
    return f"{aim}; {'; '.join(ways)}."


def _mission_name(holder: Holder, now: SystemState) -> str | None:
    mission = now.running.get(holder.skill)
    return None if mission is None else mission.name


def _way_to_end(holder: Holder, now: SystemState) -> str:
    mission = now.running.get(holder.skill)
    if mission is None:
        return f"`skillwing interrupt {holder.skill}` ends it."
    return "`skillwing mission abort` calls it off" + (f", and {mission.rescue} follows." if mission.rescue else ".")


def _way_to_report(skillset: Skillset, resource: str, targets: Sequence[str], now: SystemState) -> str:
    """The ways to a state that skills do not set. `trigger` is one only without a robot, which would undo it."""
    mocked = now.reporter == "mock"
    skills = causes(skillset, resource, targets, now.states, now.reactions, mocked=mocked)
    starts = " or ".join(f"`skillwing start {name}`" for name in skills)
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
