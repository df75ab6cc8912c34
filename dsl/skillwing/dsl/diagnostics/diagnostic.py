"""Diagnostics: a problem in a source file, its span, and advice."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from skillwing.dsl.diagnostics.codes import CODES, Severity
from skillwing.dsl.spans import Span

_TAB_WIDTH = 4


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """One problem. code: key of `codes.CODES`; related: another span that belongs to it, with a few words."""

    code: str
    span: Span
    message: str
    help: str | None = None
    related: tuple[Span, str] | None = None

    @property
    def severity(self) -> Severity:
        return CODES[self.code].severity

    @property
    def title(self) -> str:
        return CODES[self.code].title


class SkillsetError(Exception):
    """A source file is not a valid skillset. diagnostics: all problems, warnings included, in file order.

    `str()` renders all of them for the user.
    """

    def __init__(self, diagnostics: Iterable[Diagnostic], source: str) -> None:
        self.diagnostics = in_file_order(diagnostics)
        self.source = source
        super().__init__(render_all(self.diagnostics, source))


def in_file_order(diagnostics: Iterable[Diagnostic]) -> tuple[Diagnostic, ...]:
    """Sort by position, then code; drop exact repetitions."""
    unique = dict.fromkeys(diagnostics)
    return tuple(sorted(unique, key=lambda item: (item.span.line, item.span.column, item.code)))


def has_errors(diagnostics: Iterable[Diagnostic]) -> bool:
    return any(diagnostic.severity == "error" for diagnostic in diagnostics)


def render(diagnostic: Diagnostic, source: str) -> str:
    """Draw one diagnostic: code and sentence, position, source line with carets, help."""
    span = diagnostic.span
    lines = [f"{diagnostic.severity}[{diagnostic.code}]: {diagnostic.message}", f"  --> {span}"]
    lines += excerpt(span, source, "^")
    if diagnostic.related is not None:
        place, words = diagnostic.related
        lines += [f"note: {words} ({place})", *excerpt(place, source, "-")]
    if diagnostic.help is not None:
        lines.append(f"help: {diagnostic.help}")
    return "\n".join(lines)


def render_all(diagnostics: Iterable[Diagnostic], source: str) -> str:
    """Draw several diagnostics, with a closing line that counts them."""
    listed = tuple(diagnostics)
    return "\n\n".join([*(render(diagnostic, source) for diagnostic in listed), summary(listed)])


def summary(diagnostics: Iterable[Diagnostic]) -> str:
    """Count errors and warnings in words."""
    severities = [diagnostic.severity for diagnostic in diagnostics]
    counts = [
        f"{count} {kind}{'' if count == 1 else 's'}"
        for kind in ("error", "warning")
        if (count := severities.count(kind))
    ]
    return " and ".join(counts) or "no problem"


def excerpt(span: Span, source: str, mark: str = "^") -> list[str]:
    """The source line of the span with marks under it. A span over several lines is marked to the line's end."""
    lines = source.split("\n")
    if not 1 <= span.line <= len(lines):
        return []
    # A terminal would obey what cannot be seen.
    line = "".join(
        mark if mark.isprintable() or mark == "\t" else "\ufffd" for mark in lines[span.line - 1].rstrip("\r")
    )
    start = span.column - 1
    end = span.end_column - 1 if span.end_line == span.line else len(line)
    before, marked = line[:start].expandtabs(_TAB_WIDTH), line[start:end].expandtabs(_TAB_WIDTH)
    number = str(span.line)
    gutter = " " * len(number)
    return [
        f" {gutter} |",
        f" {number} | {line.expandtabs(_TAB_WIDTH)}",
        f" {gutter} | {' ' * len(before)}{mark * max(1, len(marked))}",
    ]
