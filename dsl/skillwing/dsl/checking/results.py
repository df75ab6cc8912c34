"""Results that nothing tells apart: without `success` and `failure` the first is the success, whatever was meant."""

from __future__ import annotations

from collections.abc import Iterator

from skillwing.dsl.diagnostics.report import Report
from skillwing.dsl.model import Skill, Skillset
from skillwing.dsl.reading import syntax
from skillwing.dsl.suggest import listed


def report_unmarked_results(root: syntax.SkillsetSyntax, skillset: Skillset, report: Report) -> None:
    """Warn of skills that leave their results unmarked in a file that marks others.

    Only where the first result has the effect and the postcondition of another one. A file that marks none, as the
    paper's listings do, relies on the order.
    """
    declared = [element for element in root.elements if isinstance(element, syntax.SkillSyntax)]
    if not any(item.partition for skill in declared for item in _results(skill)):
        return
    for declaration, skill in zip(declared, skillset.skills, strict=True):
        twins = _twins(skill)
        if twins and not any(item.partition for item in _results(declaration)):
            first = skill.results[0]
            message = (
                f"Nothing but its place says that `{first.name}` is the success of `{skill.name}`: "
                f"{listed(twins)} {'has' if len(twins) == 1 else 'have'} the same effect and postcondition."
            )
            advice = f"Write `success {first.name}` and `failure {twins[0]}`, as elsewhere in this file."
            report.add("SW087", first.span, message, advice)


def _results(skill: syntax.SkillSyntax) -> Iterator[syntax.ResultSyntax]:
    for section in skill.sections:
        if isinstance(section, syntax.ResultSection):
            yield from section.results


def _twins(skill: Skill) -> list[str]:
    """The results that differ from the first in their names only."""
    if len(skill.results) < 2:
        return []
    first, *others = skill.results
    changes = set(skill.transitions(first.apply))
    return [item.name for item in others if set(skill.transitions(item.apply)) == changes and item.post == first.post]
