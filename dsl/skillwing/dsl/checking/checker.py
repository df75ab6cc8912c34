"""The whole way from source text to a skillset and its diagnostics."""

from __future__ import annotations

import gc
import re
from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from skillwing.dsl.checking.analysis import analyse
from skillwing.dsl.checking.partial_model import partial_model
from skillwing.dsl.checking.resolver import resolve
from skillwing.dsl.checking.results import report_unmarked_results
from skillwing.dsl.checking.source_locations import SourceLocations
from skillwing.dsl.diagnostics.diagnostic import Diagnostic, has_errors, in_file_order
from skillwing.dsl.diagnostics.report import Report
from skillwing.dsl.model import Skillset
from skillwing.dsl.reading import syntax
from skillwing.dsl.reading.parser import ParsedFile, parse_file

_UNKNOWN_NAMES = frozenset({"SW010", "SW011", "SW012", "SW013", "SW014", "SW015"})
_NAMED_IN = {
    "data": frozenset({"SW014"}),
    "input": frozenset({"SW014"}),
    "resource": frozenset({"SW010"}),
    "effect": frozenset({"SW012"}),
    "type": frozenset({"SW013", "SW015"}),
    "enum": frozenset({"SW013"}),
}
"""What may seem unknown because it got no name in such a block."""
_OF_THE_WHOLE = frozenset({"SW030", "SW043", "SW060", "SW062", "SW081"})
"""What is said of a whole block, and does not hold if a part of it was not read, or not where it belongs."""
_OF_THE_FILE = frozenset({"SW083"})


@dataclass(frozen=True, slots=True)
class Checked:
    """A checked file. skillset: None if there is any error. diagnostics: errors and warnings, in file order.

    exact: whether the analysis could play everything through, so that no combination of states is passed over.
    """

    skillset: Skillset | None
    diagnostics: tuple[Diagnostic, ...]
    exact: bool = True


@contextmanager
def paused_collector() -> Generator[None]:
    """Keep the collector from running meanwhile, in the whole process.

    Nearly everything that is made while a file is checked lives until the end, and nothing of it is a cycle: the
    collector finds nothing, again and again, and takes a third of the time on a large file.
    """
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


@paused_collector()
def check(text: str, file: str) -> Checked:
    """Check a source text; `file` is the name that its diagnostics show. Never raises for what the text contains."""
    parsed = parse_file(text, file)
    if parsed.root is None:
        return Checked(None, in_file_order(parsed.diagnostics))
    report = Report()
    skillset = resolve(parsed.root, report)
    if parsed.diagnostics or has_errors(report.diagnostics):
        return Checked(None, in_file_order(_despite_errors(parsed, parsed.root, skillset, report, text)))
    report_unmarked_results(parsed.root, skillset, report)
    exact = analyse(skillset, report)
    found = in_file_order(report.diagnostics)
    return Checked(None if has_errors(found) else skillset, found, exact)


def _despite_errors(
    parsed: ParsedFile, root: syntax.SkillsetSyntax, skillset: Skillset, report: Report, text: str
) -> Iterator[Diagnostic]:
    """All that can be said of a file with errors: of what may happen in it, only what cannot."""
    locations = SourceLocations(root)
    yield from parsed.diagnostics
    yield from _reliable(report.diagnostics, parsed, locations, text) if parsed.diagnostics else report.diagnostics
    left = partial_model(skillset, locations, parsed.diagnostics, report.diagnostics, report.lost)
    meaning = Report()
    analyse(left.skillset, meaning, left.unconstrained)
    yield from (diagnostic for diagnostic in meaning.diagnostics if diagnostic.severity == "error")


def _reliable(
    diagnostics: Iterable[Diagnostic], parsed: ParsedFile, locations: SourceLocations, text: str
) -> Iterator[Diagnostic]:
    """Keep what does not merely follow from a syntax error.

    A name that seems unknown may stand among the words that were passed over, a statement that was guessed at may mean
    something else, and an element that was not read as a whole may hold what it seems to lack.
    """
    recovery = parsed.recovery
    damaged = [locations.at(diagnostic.span) for diagnostic in parsed.diagnostics]
    guessed = {locations.statement(span) for span in recovery.guessed}
    nameless = frozenset[str]().union(*(_NAMED_IN.get(block, frozenset[str]()) for block in recovery.nameless))
    lines = text.split("\n")
    for diagnostic in diagnostics:
        span = diagnostic.span
        is_lost = diagnostic.code in _UNKNOWN_NAMES and not recovery.skipped_words.isdisjoint(
            re.findall(r"\w+", lines[span.line - 1][span.column - 1 : span.end_column - 1])
        )
        is_of_damaged = diagnostic.code in _OF_THE_WHOLE and locations.at(span) in damaged
        follows = is_lost or is_of_damaged or diagnostic.code in nameless | _OF_THE_FILE
        if not follows and locations.statement(span) not in guessed:
            yield diagnostic
