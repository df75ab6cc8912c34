"""Reply to the query whether skills may start: what fails, who holds it, and what would change it."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass

from skillwing.dsl.expressions import Environment, evaluate, names_used
from skillwing.dsl.model import Event, Skill, Skillset
from skillwing.dsl.queries import blocked_at_start, can_bring, taken_by, wanted_states
from skillwing.services.core.checks import check_schema
from skillwing.services.core.manager_state import ManagerState
from skillwing.services.core.readiness import failing_preconditions, require_known_data
from skillwing.services.core.resource_table import transition_obstacle
from skillwing.services.core.values import by_path, fit_fields
from skillwing.services.protocol import FailingCheck, Holder, MissingState, QueryReady, ReadyReport, SkillReady


@dataclass(frozen=True, slots=True)
class Situation:
    """Facts from which readiness follows. known: present states and fresh data. holders: of the active grants."""

    skillset: Skillset
    known: Environment
    holders: tuple[Holder, ...] = ()


def ready_report(state: ManagerState, query: QueryReady, now: float) -> ReadyReport:
    """The reply to a query. Refuses an unknown skill, and data that are not known yet after a restart."""
    if query.schema:
        check_schema(state.skillset, query.schema)
    skills = (state.skill(query.skill),) if query.skill else state.skillset.skills
    for skill in skills:
        for check in skill.preconditions.checks:
            require_known_data(state, check.expression, now)
    holders = tuple(
        Holder(skill=grant.skill.name, goal_id=grant.goal_id, owner=grant.owner) for grant in state.ledger.grants
    )
    situation = Situation(state.skillset, state.environment(now), holders)
    return ReadyReport(
        step=state.step, t=now, skills=tuple(skill_ready(situation, skill, query.inputs) for skill in skills)
    )


def skill_ready(situation: Situation, skill: Skill, given: Mapping[str, object] | None = None) -> SkillReady:
    """Readiness of a skill. given: its inputs; None to leave out what only inputs decide."""
    inputs, found = fit_fields(skill.inputs, given or {})
    problems = by_path([each for each in found if given is not None or each.kind != "missing"])
    unusable = {each.path.partition(".")[0].partition("[")[0] for each in found if each.kind != "range"}
    unchecked = tuple(
        check.name for check in skill.preconditions.checks if names_used(check.expression, "input") & unusable
    )
    known = Environment(resources=situation.known.resources, data=situation.known.data, inputs=inputs)
    failing = tuple(
        _failing_checks(situation, skill, failing_preconditions(situation.skillset, skill, known, unchecked))
    )
    running = next((holder for holder in situation.holders if holder.skill == skill.name), None)
    return SkillReady(
        skill=skill.name,
        ready=not failing and not problems and running is None,
        failing=failing,
        inputs=problems,
        unchecked=unchecked,
        running=running,
    )


def _failing_checks(situation: Situation, skill: Skill, failing: Mapping[str, str]) -> Iterator[FailingCheck]:
    states = situation.known.resources
    for check in skill.preconditions.checks:
        if (reason := failing.get(check.name)) is None:
            continue
        names = {scope: tuple(sorted(names_used(check.expression, scope))) for scope in ("data", "input")}
        wanted = {} if any(names.values()) else wanted_states(check.expression, situation.skillset, states)
        yield FailingCheck(
            name=check.name,
            reason=reason,
            missing=_missing(situation, wanted),
            data=names["data"],
            inputs=names["input"],
        )
    effect = f"effect {skill.preconditions.success}"
    if effect in failing:
        wanted = start_sources(situation.skillset, skill, states)
        yield FailingCheck(name=effect, reason=failing[effect], missing=_missing(situation, wanted))


def start_sources(skillset: Skillset, skill: Skill, states: Mapping[str, str]) -> dict[str, list[str]]:
    """The resources that block the start effect of a skill, each with the states from which it could be applied."""
    taken = taken_by(skill)
    return {
        name: [
            state
            for state in skillset.resource(name).states
            if skillset.resource(name).allows(state, taken[name], extern=False)
        ]
        for name in sorted(blocked_at_start(skill, skillset, states))
    }


def _missing(situation: Situation, wanted: Mapping[str, Iterable[str]]) -> tuple[MissingState, ...]:
    return tuple(_missing_state(situation, name, tuple(targets)) for name, targets in wanted.items())


def _missing_state(situation: Situation, name: str, wanted: tuple[str, ...]) -> MissingState:
    skillset, present = situation.skillset, situation.known.resources[name]
    edges = skillset.resource(name).transitions
    return MissingState(
        resource=name,
        state=present,
        wanted=wanted,
        holder=holder_of(situation, name, wanted),
        skills=tuple(skill.name for skill in skillset.skills if can_bring(skill, name, wanted)),
        events=tuple(event.name for event in skillset.events if _brings(situation, event, name, wanted)),
        extern=tuple(edge.target for edge in edges if edge.extern and edge.source == present and edge.target in wanted),
    )


def _brings(situation: Situation, event: Event, resource: str, wanted: Collection[str]) -> bool:
    """True if an event may be fired now and brings the resource to a wanted state."""
    transitions = event.effect.transitions
    if not any(name == resource and target in wanted for name, target in transitions):
        return False
    if event.guard is not None and not evaluate(event.guard, situation.known):
        return False
    states = situation.known.resources
    return transition_obstacle(situation.skillset.resource, states, transitions, extern=True) is None


def holder_of(situation: Situation, resource: str, wanted: Collection[str]) -> Holder | None:
    """The goal whose start has taken a resource, if an effect of its skill brings a wanted state back."""
    for holder in situation.holders:
        skill = situation.skillset.skill(holder.skill)
        if resource in taken_by(skill) and can_bring(skill, resource, wanted):
            return holder
    return None
