"""Analysis of skills and events with an error: the guards and effects that were read are judged alone.

Nothing is known of the situations in which a damaged element is evaluated, except that they are among all situations of
the skillset. A guard that holds in none of them is wrong, whatever is meant by the rest.
"""

from __future__ import annotations

from skillwing.dsl.checking.effect_analysis import EffectAnalysis
from skillwing.dsl.checking.impossible_guards import (
    report_check,
    report_checks,
    report_guard,
    report_invariant,
    report_invariants,
    report_post,
)
from skillwing.dsl.checking.reachability.situations import Situations
from skillwing.dsl.checking.reachability.statespace import StateSpace
from skillwing.dsl.checking.resource_analysis import report_transitions
from skillwing.dsl.diagnostics.report import DiagnosticReport
from skillwing.dsl.expressions import Expression
from skillwing.dsl.model import Event, Skill


def report_damaged_event(event: Event, always: Situations, space: StateSpace, report: DiagnosticReport) -> None:
    """Report what is wrong with the readable part of an event. always: all situations of the skillset."""
    guard = space.guard(event.guard)
    if guard is not None and always.where(guard).empty:
        report_guard(event, guard, always, report)
    report_transitions(event, space, report)


def report_damaged_skill(skill: Skill, always: Situations, space: StateSpace, report: DiagnosticReport) -> None:
    """Report what is wrong with the readable parts of a skill. always: all situations of the skillset."""
    _checks(skill, always, space, report)
    _invariants(skill, always, space, report)
    for result in skill.results:
        relation = space.guard(result.post)
        if result.post is None or relation is None:
            continue
        after = always.after(space.changes(skill.transitions(result.apply)))
        if not after.empty and after.where(relation).empty:
            report_post(skill.name, result.name, result.post, relation, after, report)
    effects = EffectAnalysis(space, always, report)
    for effect in skill.effects:
        effects.judge_alone(effect, _narrowed(skill, always, space))


def _checks(skill: Skill, always: Situations, space: StateSpace, report: DiagnosticReport) -> None:
    judged = [(check, guard) for check in skill.preconditions.checks if (guard := space.guard(check.expression))]
    wrong = [(check, guard) for check, guard in judged if always.where(guard).empty]
    for check, guard in wrong:
        report_check(skill.name, check, guard, always, report)
    if judged and not wrong and always.where_all(guard for _, guard in judged).empty:
        checks, guards = zip(*judged, strict=True)
        report_checks(skill.name, checks, guards, always, report)


def _invariants(skill: Skill, always: Situations, space: StateSpace, report: DiagnosticReport) -> None:
    judged = [(item, guard) for item in skill.invariants if (guard := space.guard(item.expression))]
    wrong = [(item, guard) for item, guard in judged if always.where(guard).empty]
    for item, guard in wrong:
        report_invariant(skill.name, item, guard, always, report)
    if judged and not wrong and always.where_all(guard for _, guard in judged).empty:
        report_invariants(skill.name, [item for item, _ in judged], report)


def _narrowed(skill: Skill, always: Situations, space: StateSpace) -> Situations:
    """The situations in which the known guards hold; all of them if these contradict one another.

    An effect may name the state that its resource is in, which changes nothing.
    """
    expressions: list[Expression] = [check.expression for check in skill.preconditions.checks]
    expressions += [item.expression for item in skill.invariants]
    narrowed = always.where_all(guard for guard in map(space.guard, expressions) if guard is not None)
    return always if narrowed.empty else narrowed
