"""Checks on the meaning of a resolved skillset: what can never hold, apply, be reached or be given back.

Everything is judged on the situations that can come about (`reachability/`). Where few resources are tied together
these are found exactly, by playing them through. Where many are, they are followed resource by resource, which may take
situations for possible that are not.

So an error is always right, whatever the size: what the checker calls impossible is impossible. Where all was played
through nothing impossible is passed over, either; elsewhere an impossible *combination* of states of several resources
may be, and a warning of what may happen may speak of one. Data and inputs are not looked at: a predicate on them may be
true or false at any time, unless no number satisfies it (`ranges.py`).
"""

from __future__ import annotations

from collections.abc import Collection

from skillwing.dsl.checking.leaks import report_leaks
from skillwing.dsl.checking.ranges import report_ranges
from skillwing.dsl.checking.reachability.knowledge import Knowledge
from skillwing.dsl.checking.reachability.parts import PartByPart
from skillwing.dsl.checking.reachability.relations import MOST_COMBINATIONS
from skillwing.dsl.checking.reachability.statespace import Behaviour, StateSpace
from skillwing.dsl.checking.resource_analysis import report_event, report_resources
from skillwing.dsl.checking.skill_analysis import SkillAnalysis
from skillwing.dsl.checking.wording import span_of
from skillwing.dsl.diagnostics.diagnostic import has_errors
from skillwing.dsl.diagnostics.report import Report
from skillwing.dsl.model import Skillset


def analyse(skillset: Skillset, report: Report, unconstrained: Collection[str] = ()) -> bool:
    """Report what is wrong with the meaning of a skillset whose names and types are right.

    unconstrained: resources that something unknown may move at any time. Return whether everything was played through.
    """
    space = StateSpace(skillset, unconstrained)
    report_ranges(skillset, report)
    knowledge = PartByPart(space)
    report_on(knowledge, space, report)
    return knowledge.exact


def report_on(knowledge: Knowledge, space: StateSpace, report: Report) -> None:
    """Report what follows from what is known."""
    skillset = space.skillset
    for event in skillset.events:
        report_event(event, knowledge, space, report)
    sound: set[Behaviour] = set()
    for skill in skillset.skills:
        if space.behaviour(skill) in sound:
            continue
        before = len(report.diagnostics)
        analysis = SkillAnalysis(skill, knowledge, space, report)
        analysis.run()
        if not has_errors(report.diagnostics[before:]):  # An effect that never applies need not be called a leak, too.
            report_leaks(skill, analysis.startable, knowledge, space, report)
        if len(report.diagnostics) == before:
            sound.add(space.behaviour(skill))
    report_resources(skillset, knowledge, space, report)
    for expression, combinations in space.relations.too_wide.items():
        message = f"This predicate names resources with {combinations} combinations of states and is not judged."
        if combinations > MOST_COMBINATIONS:
            advice = f"Split it where `and` joins it, into checks with up to {MOST_COMBINATIONS} combinations each."
        else:
            advice = "The predicates of this file have too many in all: let them name fewer resources each."
        report.add("SW088", span_of(expression), message, advice)
