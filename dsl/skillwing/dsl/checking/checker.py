"""The complete check, from source text to a skillset and its diagnostics."""

from __future__ import annotations

import gc
import re
from collections.abc import Generator, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass

from skillwing.dsl.checking.analysis import analyse, analyse_partly
from skillwing.dsl.checking.connections import report_misspelt_states
from skillwing.dsl.checking.partial_model import partial_model
from skillwing.dsl.checking.resolver import resolve
from skillwing.dsl.checking.results import report_unmarked_results
from skillwing.dsl.checking.source_locations import SourceLocations
from skillwing.dsl.diagnostics.diagnostic import Diagnostic, has_errors, in_file_order
from skillwing.dsl.diagnostics.report import DiagnosticReport
from skillwing.dsl.model import Skillset
from skillwing.dsl.reading import syntax
from skillwing.dsl.reading.parser import ParsedFile, ReadText, included_text, parse_file

_UNKNOWN_NAMES = frozenset({"SW010", "SW011", "SW012", "SW013", "SW014", "SW015"})
_NAMED_IN = {
    "data": frozenset({"SW014"}),
    "input": frozenset({"SW014"}),
    "resource": frozenset({"SW010"}),
    "effect": frozenset({"SW012"}),
    "type": frozenset({"SW013", "SW015"}),
    "enum": frozenset({"SW013"}),
}
"""Codes for unknown names, by the kind of block in which the declaration may have lost its name."""
_OF_THE_WHOLE = frozenset({"SW030", "SW031", "SW043", "SW060", "SW062", "SW081"})
"""Codes that concern a whole block. They are unreliable if a part of the block was not read."""
_OF_THE_FILE = frozenset({"SW083"})
_DECLARED_ANYWHERE = frozenset({"SW010", "SW013", "SW014"})
"""Codes for unknown names whose declarations may be in the missing part of a file that ends in the middle."""
_DECLARED_IN: Mapping[type, frozenset[str]] = {
    syntax.ResourceSyntax: frozenset({"SW011"}),
    syntax.StructSyntax: frozenset({"SW015"}),
    syntax.EnumSyntax: frozenset({"SW015", "SW023"}),
    syntax.SkillSyntax: frozenset({"SW012"}),
}
"""Codes for names whose declarations may be in the missing part of the last element of such a file."""


@dataclass(frozen=True, slots=True)
class Checked:
    """Result of a check. skillset: None if there is any error. diagnostics: errors and warnings, in file order.

    exact: whether the exploration was complete, so that no impossible combination of states is missed.
    """

    skillset: Skillset | None
    diagnostics: tuple[Diagnostic, ...]
    exact: bool = True


@contextmanager
def paused_collector() -> Generator[None]:
    """Pause the cyclic garbage collector of the process.

    Nearly all objects of a check live until its end, and they form no cycles. On a large file the collector would take
    a third of the time.
    """
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


@paused_collector()
def check(text: str, file: str, read: ReadText = included_text) -> Checked:
    """Check a source text. Raises nothing, whatever the text contains.

    file: its name in diagnostics. read: for the files that it includes, relative to its folder.
    """
    parsed = parse_file(text, file, read)
    if parsed.root is None:
        return Checked(None, in_file_order(parsed.diagnostics))
    report = DiagnosticReport()
    skillset = resolve(parsed.root, report)
    locations = SourceLocations(parsed.root)
    report_misspelt_states(parsed.root, skillset, _damaged_resources(parsed, locations, report), report)
    if parsed.diagnostics or has_errors(report.diagnostics):
        return Checked(None, in_file_order(_despite_errors(parsed, locations, skillset, report, text)))
    report_unmarked_results(parsed.root, skillset, report)
    exact = analyse(skillset, report)
    found = in_file_order(report.diagnostics)
    return Checked(None if has_errors(found) else skillset, found, exact)


def _damaged_resources(parsed: ParsedFile, locations: SourceLocations, report: DiagnosticReport) -> frozenset[str]:
    wrong = [item.span for item in (*parsed.diagnostics, *report.diagnostics) if item.severity == "error"]
    elements = (locations.at(span) for span in wrong)
    return frozenset(element.name.text for element in elements if isinstance(element, syntax.ResourceSyntax))


def _despite_errors(
    parsed: ParsedFile, locations: SourceLocations, skillset: Skillset, report: DiagnosticReport, text: str
) -> Iterator[Diagnostic]:
    """All diagnostics of a file with errors. The analysis contributes only its errors, not its warnings."""
    yield from parsed.diagnostics
    yield from _reliable(report.diagnostics, parsed, locations, text) if parsed.diagnostics else report.diagnostics
    left = partial_model(skillset, locations, parsed.diagnostics, report.diagnostics, report.lost)
    meaning = DiagnosticReport()
    analyse_partly(left, meaning)
    yield from (diagnostic for diagnostic in meaning.diagnostics if diagnostic.severity == "error")


def _reliable(
    diagnostics: Iterable[Diagnostic], parsed: ParsedFile, locations: SourceLocations, text: str
) -> Iterator[Diagnostic]:
    """Remove the diagnostics that merely follow from a syntax error.

    A name that seems unknown may be declared in skipped text. A guessed statement may have another meaning. An element
    that was read in part may contain what seems to be missing.
    """
    recovery = parsed.recovery
    damaged = [locations.at(diagnostic.span) for diagnostic in parsed.diagnostics]
    guessed = {locations.statement(span) for span in recovery.guessed}
    nameless = frozenset[str]().union(*(_NAMED_IN.get(block, frozenset[str]()) for block in recovery.nameless))
    lines = text.split("\n")
    last = locations.last if recovery.is_cut else None
    missing = _DECLARED_ANYWHERE | _DECLARED_IN.get(type(last), frozenset[str]()) if last else frozenset[str]()
    for diagnostic in diagnostics:
        span = diagnostic.span
        is_lost = diagnostic.code in _UNKNOWN_NAMES and not recovery.skipped_words.isdisjoint(
            re.findall(r"\w+", lines[span.line - 1][span.column - 1 : span.end_column - 1])
        )
        is_of_damaged = diagnostic.code in _OF_THE_WHOLE and locations.at(span) in damaged
        follows = is_lost or is_of_damaged or diagnostic.code in nameless | missing | _OF_THE_FILE
        if not follows and locations.statement(span) not in guessed:
            yield diagnostic
