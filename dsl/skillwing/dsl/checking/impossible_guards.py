"""Reports of guards that no possible situation satisfies, in a sound skill as well as in a damaged one."""

from __future__ import annotations

from collections.abc import Collection

from skillwing.dsl.checking.reachability.relations import Relation
from skillwing.dsl.checking.reachability.situations import Situations
from skillwing.dsl.checking.wording import ask_for_possible, possible_together, span_of
from skillwing.dsl.diagnostics.report import DiagnosticReport
from skillwing.dsl.expressions import Expression
from skillwing.dsl.model import Event, Invariant, Predicate
from skillwing.dsl.suggest import listed


def report_guard(event: Event, relation: Relation, situations: Situations, report: DiagnosticReport) -> None:
    """Report the guard of an event."""
    message = f"The guard of `{event.name}` can never hold."
    span = event.span if event.guard is None else span_of(event.guard)
    report.add("SW055", span, message, ask_for_possible(relation.names, situations))


def report_check(
    skill: str, check: Predicate, relation: Relation, situations: Situations, report: DiagnosticReport
) -> None:
    """Report a precondition. situations: those in which it is evaluated."""
    message = f"The precondition `{check.name}` of `{skill}` can never hold."
    advice = ask_for_possible(relation.names, situations, " when it is judged")
    report.add("SW050", span_of(check.expression) or check.span, message, advice)


def report_checks(
    skill: str,
    checks: Collection[Predicate],
    relations: Collection[Relation],
    situations: Situations,
    report: DiagnosticReport,
) -> None:
    """Report preconditions that contradict one another."""
    culprits = listed(check.name for check in checks)
    message = f"The preconditions {culprits} of `{skill}` can never hold together."
    names = {name for relation in relations for name in relation.names}
    advice = f"Drop or change one of them: {possible_together(names, situations)}."
    report.add("SW054", next(iter(checks)).span, message, advice)


def report_invariant(
    skill: str, invariant: Invariant, relation: Relation, situations: Situations, report: DiagnosticReport
) -> None:
    """Report an invariant that holds in no situation at all."""
    message = f"The invariant `{invariant.name}` of `{skill}` can never hold."
    span = span_of(invariant.expression) or invariant.span
    report.add("SW051", span, message, ask_for_possible(relation.names, situations))


def report_invariants(skill: str, invariants: Collection[Invariant], report: DiagnosticReport) -> None:
    """Report invariants that contradict one another."""
    message = f"Whenever `{skill}` starts, one of its invariants {listed(item.name for item in invariants)} is false."
    report.add("SW053", next(iter(invariants)).span, message, "Change them so that they can hold together.")


def report_post(
    skill: str, result: str, post: Expression, relation: Relation, situations: Situations, report: DiagnosticReport
) -> None:
    """Report a postcondition. situations: all those after its effect."""
    message = f"The postcondition of `{result}` can never hold when `{skill}` ends so."
    advice = f"After its effect, {possible_together(relation.names, situations)}: ask for that."
    report.add("SW052", span_of(post), message, advice)
