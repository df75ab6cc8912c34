"""Analysis of a resolved skillset: guards that never hold, effects that never apply, unreachable states, leaks.

The analysis uses the set of situations that can occur (`reachability/`). If few resources depend on one another, this
set is exact: all steps are explored. Otherwise each resource is followed alone, and the set may contain situations that
never occur.

An error is therefore always right: what the checker calls impossible is impossible. With an exact set no impossible
situation is missed. Otherwise an impossible *combination* of states may be missed, and a warning may be wrong. Data and
inputs are not considered: a predicate on them may be true or false, unless no number satisfies it (`ranges.py`).
"""

from __future__ import annotations

from dataclasses import replace

from skillwing.dsl.checking.damaged_analysis import report_damaged_event, report_damaged_skill
from skillwing.dsl.checking.partial_model import PartialModel
from skillwing.dsl.checking.ranges import report_ranges
from skillwing.dsl.checking.reachability.knowledge import Knowledge
from skillwing.dsl.checking.reachability.parts import PartByPart
from skillwing.dsl.checking.reachability.relations import MOST_COMBINATIONS
from skillwing.dsl.checking.reachability.statespace import Behaviour, StateSpace
from skillwing.dsl.checking.resource_analysis import report_event, report_resources
from skillwing.dsl.checking.skill_analysis import SkillAnalysis, report_leaks
from skillwing.dsl.checking.wording import span_of
from skillwing.dsl.diagnostics.diagnostic import has_errors
from skillwing.dsl.diagnostics.report import DiagnosticReport
from skillwing.dsl.model import Skillset


def analyse(skillset: Skillset, report: DiagnosticReport) -> bool:
    """Report problems in the meaning of a skillset whose names and types are right.

    Returns whether the exploration was complete.
    """
    space = StateSpace(skillset)
    report_ranges(skillset, report)
    knowledge = PartByPart(space)
    report_on(knowledge, space, report)
    return knowledge.exact


def analyse_partly(left: PartialModel, report: DiagnosticReport) -> None:
    """Report problems in the meaning of a file with errors. Warnings are not reliable."""
    space = StateSpace(left.skillset, left.unconstrained)
    read = replace(left.skillset, events=(*left.skillset.events, *left.events))
    report_ranges(replace(read, skills=(*left.skillset.skills, *left.skills)), report)
    knowledge = PartByPart(space)
    report_on(knowledge, space, report)
    for event in left.events:
        report_damaged_event(event, knowledge.always, space, report)
    for skill in left.skills:
        report_damaged_skill(skill, knowledge.always, space, report)


def report_on(knowledge: Knowledge, space: StateSpace, report: DiagnosticReport) -> None:
    """Report the problems that follow from this knowledge."""
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
