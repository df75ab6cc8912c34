"""Resource leaks: a skill ends, a resource that it took stays taken, and no transition can ever bring it back."""

from __future__ import annotations

from skillwing.dsl.checking.reachability.knowledge import Knowledge, ends_of
from skillwing.dsl.checking.reachability.situations import Situations
from skillwing.dsl.checking.reachability.statespace import StateSpace, closure
from skillwing.dsl.diagnostics.report import DiagnosticReport
from skillwing.dsl.model import Skill


def report_leaks(
    skill: Skill, startable: Situations, knowledge: Knowledge, space: StateSpace, report: DiagnosticReport
) -> None:
    """Warn of each resource that a skill takes at its start and may never give back.

    startable: the situations in which the skill can start. A resource without a way back by its own transitions, such
    as a parachute, is for single use and no leak.
    """
    for name, taken in skill.transitions(skill.preconditions.success):
        origins = startable.states(name) - {taken}
        left: set[str] = set()
        labels: list[str] = []
        stuck = knowledge.stuck(skill, name, origins) if origins else []
        for (label, effect), states in zip(ends_of(skill), stuck, strict=bool(origins)):
            # States in which the skill itself leaves it; another author brings it to all others.
            own = {taken, *(target for changed, target in skill.transitions(effect) if changed == name)}
            promised = {state for state in states & own if _leads_back(name, state, origins, space)}
            if promised:
                left |= promised
                labels.append(label)
        if left:
            message = (
                f"`{skill.name}` takes `{name}` and leaves it {' or '.join(sorted(left))} when it ends by "
                f"{' or '.join(labels)}; nothing brings it back to {' or '.join(sorted(origins))}."
            )
            if left == {taken}:
                advice = f"Apply an effect with `{name} -> {min(origins)}` there too."
            else:
                advice = f"Let a skill that can start then bring `{name}` from {min(left)} to {min(origins)}."
            report.add("SW080", skill.span, message, advice)


def _leads_back(name: str, state: str, origins: frozenset[str], space: StateSpace) -> bool:
    edges = ((edge.source, edge.target) for edge in space.resource(name).transitions)
    return bool(closure((state,), edges) & origins)
