"""The figures of a campaign in the documentation: rewritten by a command, never by hand."""

from __future__ import annotations

from argparse import ArgumentTypeError
from collections.abc import Sequence
from pathlib import Path

from simulation.ledger import Part, spans
from simulation.planted import BUGS, SEEDS, find

BEGIN, END = "<!-- figures of the simulation: begin -->", "<!-- figures of the simulation: end -->"


def page_with_place(path: str) -> Path:
    """A page of the documentation that can take the figures: to be known before the hours that they take.

    Raises argparse.ArgumentTypeError for another.
    """
    page = Path(path)
    text = page.read_text(encoding="utf-8") if page.exists() else ""
    if text.count(BEGIN) != 1 or text.count(END) != 1 or text.index(BEGIN) > text.index(END):
        raise ArgumentTypeError(f"{page} has no place for the figures: write the lines {BEGIN} and {END} into it")
    return page


def write_section(page: Path, parts: Sequence[Part]) -> None:
    """Put the figures between their marks."""
    head, rest = page.read_text(encoding="utf-8").split(BEGIN)
    page.write_text(f"{head}{BEGIN}\n{_figures(parts)}\n{END}{rest.split(END)[1]}", encoding="utf-8")


def _figures(parts: Sequence[Part]) -> str:
    versions = list(dict.fromkeys(part.code for part in parts))
    lines = [
        *(_figure([part for part in parts if part.code == version]) for version in versions),
        "",
        *(f"- seed {seed}: {text}" for part in parts for seed, text in sorted(part.failures.items())),
        *([""] if any(part.failures for part in parts) else []),
        "| mistake put into the managers | found by run | broken promise |",
        "|---|---|---|",
    ]
    for bug in BUGS:
        found = find(bug)
        told = f"{found[0] + 1} | {found[1]}" if found else f"not within {SEEDS} |"
        lines.append(f"| {bug} | {told} |")
    return "\n".join(lines)


def _figure(parts: Sequence[Part]) -> str:
    """One sentence on what one version of the code has been through."""
    runs = sum(part.end - part.first for part in parts)
    messages = sum(part.messages for part in parts)
    minutes = sum(part.seconds for part in parts) / 60
    seeds = " and ".join(f"{first:,} to {last:,}" for first, last in spans(parts))
    failures = sum(len(part.failures) for part in parts) or "none"
    dates = sorted({part.date for part in parts})
    return (
        f"{runs:,} runs (seeds {seeds}) with {messages:,} messages took {minutes:.0f} minutes of one processor; "
        f"{failures} of them found a broken promise. Code {parts[0].code}, {parts[0].machine}, "
        f"{' to '.join(dict.fromkeys((dates[0], dates[-1])))}."
    )
