"""The whole way from source text to a skillset and its diagnostics."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from skillwing.dsl.checking.analysis import analyse
from skillwing.dsl.checking.collector import paused_collector
from skillwing.dsl.checking.damage import Places, remainder
from skillwing.dsl.checking.resolver import resolve
from skillwing.dsl.checking.results import report_unmarked_results
from skillwing.dsl.diagnostics.diagnostic import Diagnostic, has_errors, in_file_order
from skillwing.dsl.diagnostics.report import Report
from skillwing.dsl.model import Skillset
from skillwing.dsl.reading import syntax
from skillwing.dsl.reading.parser import ParsedFile, parse_file

_UNKNOWN_NAMES = frozenset({"SW010", "SW011", "SW012", "SW013", "SW014", "SW015"})
_DECLARED_IN = {
    "data": frozenset({"SW014"}),
    "resource": frozenset({"SW010", "SW011"}),
    "type": frozenset({"SW013", "SW015"}),
    "enum": frozenset({"SW013", "SW015"}),
    "skill": frozenset[str](),
    "event": frozenset[str](),
}
"""What may seem unknown to other elements because a part of such a block could not be read."""
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
    if parsed.diagnostics or has_errors(report.diagnostics):
        return Checked(None, in_file_order(_despite_errors(parsed, parsed.root, skillset, report)))
    report_unmarked_results(parsed.root, skillset, report)
    exact = analyse(skillset, report)
    found = in_file_order(report.diagnostics)
    return Checked(None if has_errors(found) else skillset, found, exact)


def _despite_errors(
    parsed: ParsedFile, root: syntax.SkillsetSyntax, skillset: Skillset, report: Report
) -> Iterator[Diagnostic]:
    """All that can be said of a file with errors: of what may happen in it, only what cannot."""
    places = Places(root)
    yield from parsed.diagnostics
    yield from _reliable(report.diagnostics, parsed, places) if parsed.diagnostics else report.diagnostics
    left = remainder(skillset, places, parsed.diagnostics, report.diagnostics, report.lost)
    meaning = Report()
    analyse(left.skillset, meaning, left.unruly)
    yield from (diagnostic for diagnostic in meaning.diagnostics if diagnostic.severity == "error")


def _reliable(diagnostics: Iterable[Diagnostic], parsed: ParsedFile, places: Places) -> Iterator[Diagnostic]:
    """Keep what does not merely follow from a syntax error.

    An element with a syntax error is not judged further; and if declarations were lost, a name that seems unknown may
    have been among them.
    """
    damaged = [places.at(diagnostic.span) for diagnostic in parsed.diagnostics]
    doubtful = frozenset[str]().union(*(_DECLARED_IN.get(block, _UNKNOWN_NAMES) for block in parsed.lost_in))
    for diagnostic in diagnostics:
        follows = diagnostic.code in _UNRELIABLE_AFTER_SYNTAX_ERRORS or diagnostic.code in doubtful
        if not follows and places.at(diagnostic.span) not in damaged:
            yield diagnostic
