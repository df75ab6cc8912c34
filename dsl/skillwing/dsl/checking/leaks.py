"""Leaks: a skill ends, a resource it took stays taken, and nothing in the skillset can ever bring it back."""

from __future__ import annotations

from collections.abc import Iterator

from skillwing.dsl.checking.statespace import StateSpace, about_resources, holds, resources_of, start_applies
from skillwing.dsl.diagnostics.report import Report
from skillwing.dsl.model import Skill, Skillset


def report_leaks(skillset: Skillset, space: StateSpace, report: Report) -> None:
    """Warn of every resource that a skill takes at its start and can lose for good at one of its ends."""
    for skill in skillset.skills:
        for name, taken in skill.transitions(skill.preconditions.success):
            origins = _states_before(skill, name, taken, space)
            ends = [end for end, effect in _ends(skill, name, taken, space) if not _moves(skill, effect, name)]
            if not origins or not ends or origins & _recoverable(skillset, name, taken, space):
                continue
            back = " or ".join(sorted(origins))
            message = (
                f"`{skill.name}` takes `{name}` and leaves it {taken} when it ends by {' or '.join(ends)}; "
                f"nothing brings it back to {back}."
            )
            advice = f"Apply an effect with `{name} -> {back}` there too."
            report.add("SW080", skill.span, message, advice)


def _states_before(skill: Skill, name: str, taken: str, space: StateSpace) -> frozenset[str]:
    """The states from which the start effect really moves the resource."""
    return frozenset(state for state in space.reachable[name] - {taken} if _startable(skill, name, state, space))


def _ends(skill: Skill, name: str, taken: str, space: StateSpace) -> Iterator[tuple[str, str | None]]:
    """Every way to end in which the resource can still be in the state taken, with the effect that is applied."""
    for result in skill.results:
        yield f"result {result.name}", result.apply
    yield "interruption", skill.interrupt.apply
    yield "loss of its manager", skill.lost
    for invariant in skill.invariants:
        names = resources_of([invariant.expression])
        breaks_while_taken = (
            name not in names
            or not about_resources(invariant.expression)
            or not space.enumerable(names)
            or any(
                states[name] == taken and not holds(invariant.expression, states) for states in space.assignments(names)
            )
        )
        if breaks_while_taken:
            yield f"violation of {invariant.name}", invariant.violation


def _moves(skill: Skill, effect: str | None, name: str) -> bool:
    return any(changed == name for changed, _ in skill.transitions(effect))


def _recoverable(skillset: Skillset, name: str, taken: str, space: StateSpace) -> frozenset[str]:
    """Where the resource can get to from `taken` once the skill is over: by itself, or by skills that can start."""
    reached = {taken}
    frontier = [taken]
    edges = space.resource(name).transitions
    while frontier:
        state = frontier.pop()
        onward = {edge.target for edge in edges if edge.extern and edge.source == state}
        for skill in skillset.skills:
            if not any(_moves(skill, effect.name, name) for effect in skill.effects):
                continue
            if _startable(skill, name, state, space):
                onward |= {
                    target for effect in skill.effects for changed, target in effect.transitions if changed == name
                }
        frontier += onward - reached
        reached |= onward
    return frozenset(reached)


def _startable(skill: Skill, name: str, state: str, space: StateSpace) -> bool:
    """Tell whether the skill can start, with its start effect, while the resource is in that state."""
    checks = [item.expression for item in skill.preconditions.checks if about_resources(item.expression)]
    names = resources_of(checks) | {changed for changed, _ in skill.transitions(skill.preconditions.success)} | {name}
    if not space.enumerable(names):
        return True
    possible = dict(space.reachable) | {name: frozenset({state})}
    return any(
        all(holds(check, states) for check in checks) and start_applies(skill, states, space)
        for states in space.assignments(names, possible)
    )
