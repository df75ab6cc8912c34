"""The whole way from source text to a skillset and its diagnostics."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from skillwing.dsl.checking.analysis import analyse
from skillwing.dsl.checking.collector import paused_collector
from skillwing.dsl.checking.resolver import resolve
from skillwing.dsl.checking.results import report_unmarked_results
from skillwing.dsl.diagnostics.diagnostic import Diagnostic, has_errors, in_file_order
from skillwing.dsl.diagnostics.report import Report
from skillwing.dsl.model import Skillset
from skillwing.dsl.reading import syntax
from skillwing.dsl.reading.parser import ParsedFile, parse_file
from skillwing.dsl.spans import Span

_UNKNOWN_NAMES = frozenset({"SW010", "SW011", "SW012", "SW013", "SW014", "SW015"})
_UNRELIABLE_AFTER_SYNTAX_ERRORS = frozenset({"SW030", "SW060", "SW081", "SW083"})


@dataclass(frozen=True, slots=True)
class Checked:
    """A checked file. skillset: None if there is any error. diagnostics: errors and warnings, in file order.

    exact: whether the analysis could play everything through, so that no combination of states is passed over.
    """

    skillset: Skillset | None
    diagnostics: tuple[Diagnostic, ...]
    exact: bool = True


@paused_collector()
def check(text: str, file: str) -> Checked:
    """Check a source text; `file` is the name that its diagnostics show. Never raises for what the text contains."""
    parsed = parse_file(text, file)
    if parsed.root is None:
        return Checked(None, in_file_order(parsed.diagnostics))
    report = Report()
    skillset = resolve(parsed.root, report)
    if parsed.diagnostics:
        return Checked(None, in_file_order([*parsed.diagnostics, *_reliable(report.diagnostics, parsed)]))
    if has_errors(report.diagnostics):
        return Checked(None, in_file_order(report.diagnostics))
    report_unmarked_results(parsed.root, skillset, report)
    exact = analyse(skillset, report)
    found = in_file_order(report.diagnostics)
    return Checked(None if has_errors(found) else skillset, found, exact)


def _reliable(diagnostics: Iterable[Diagnostic], parsed: ParsedFile) -> Iterator[Diagnostic]:
    """Keep what does not merely follow from a syntax error.

    An element with a syntax error is not judged further; and if declarations were lost, a name that seems unknown may
    have been among them.
    """
    assert parsed.root is not None
    starts = sorted(_place(word.span) for word in _element_names(parsed.root))
    damaged = {_element_at(_place(diagnostic.span), starts) for diagnostic in parsed.diagnostics}
    for diagnostic in diagnostics:
        follows = diagnostic.code in _UNRELIABLE_AFTER_SYNTAX_ERRORS
        follows |= parsed.elements_lost and diagnostic.code in _UNKNOWN_NAMES
        if not follows and _element_at(_place(diagnostic.span), starts) not in damaged:
            yield diagnostic


def _element_names(root: syntax.SkillsetSyntax) -> Iterator[syntax.Word]:
    for element in root.elements:
        if not isinstance(element, syntax.DataSyntax):
            yield element.name
        elif element.items:
            yield element.items[0].name


def _place(span: Span) -> tuple[int, int]:
    return span.line, span.column


def _element_at(place: tuple[int, int], starts: list[tuple[int, int]]) -> tuple[int, int] | None:
    """The start of the last element that begins before the place."""
    return max((start for start in starts if start <= place), default=None)
