"""Marks of results: misspelt `success` and `failure`, and results that cannot be told apart."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

from skillwing.dsl.diagnostics.report import DiagnosticReport
from skillwing.dsl.model import Skill, Skillset
from skillwing.dsl.reading import syntax
from skillwing.dsl.suggest import STRONG, closest, listed

_MARKS = ("success", "failure")


def marked_as_meant(results: Iterable[syntax.ResultSyntax], report: DiagnosticReport) -> list[syntax.ResultSyntax]:
    """Interpret a misspelt mark as the mark of the next result. The grammar can only read it as a result of its own."""
    meant: list[syntax.ResultSyntax] = []
    for result in results:
        mark = _misspelt_mark(meant[-1], result) if meant else None
        if mark is None:
            meant.append(result)
            continue
        word = meant.pop().name
        report.add("SW003", word.span, f"`{word.text}` is no word of the language.", f"Did you mean `{mark}`?")
        meant.append(replace(result, partition=mark))
    return meant


def _misspelt_mark(result: syntax.ResultSyntax, behind: syntax.ResultSyntax) -> str | None:
    """The mark that the name of a result resembles, if it stands in the place of a mark.

    Results called `FAILURE` are usual: a word in capitals, or on a line of its own, is a name.
    """
    word, named = result.name, behind.name
    is_bare = result.partition is result.apply is result.post is None
    if not is_bare or behind.partition is not None or word.text.isupper() or word.span.line != named.span.line:
        return None
    return closest(word.text, _MARKS, STRONG)


def report_unmarked_results(root: syntax.SkillsetSyntax, skillset: Skillset, report: DiagnosticReport) -> None:
    """Warn of skills that leave their results unmarked in a file that marks others.

    The warning applies only if the first result has the effect and the postcondition of another one. A file without any
    marks, as in the paper's listings, relies on the order.
    """
    declared = [element for element in root.elements if isinstance(element, syntax.SkillSyntax)]
    if not any(item.partition for skill in declared for item in _results(skill)):
        return
    for declaration, skill in zip(declared, skillset.skills, strict=True):
        equal = _equal_results(skill)
        if equal and not any(item.partition for item in _results(declaration)):
            first = skill.results[0]
            message = (
                f"Nothing but its place says that `{first.name}` is the success of `{skill.name}`: "
                f"{listed(equal)} {'has' if len(equal) == 1 else 'have'} the same effect and postcondition."
            )
            advice = f"Write `success {first.name}` and `failure {equal[0]}`, as elsewhere in this file."
            report.add("SW087", first.span, message, advice)


def _results(skill: syntax.SkillSyntax) -> Iterator[syntax.ResultSyntax]:
    for section in skill.sections:
        if isinstance(section, syntax.ResultSection):
            yield from section.results


def _equal_results(skill: Skill) -> list[str]:
    """The results that differ from the first one only in their names."""
    if len(skill.results) < 2:
        return []
    first, *others = skill.results
    changes = set(skill.transitions(first.apply))
    return [item.name for item in others if set(skill.transitions(item.apply)) == changes and item.post == first.post]
