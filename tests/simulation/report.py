"""The figures of a campaign in the documentation: rewritten by a command, never by hand."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from simulation.ledger import Part, spans
from simulation.planted import BUGS, SEEDS, find
from skillwing.services.terminal.doc_sections import Marks

MARKS = Marks.named("figures of the simulation")


def write_section(page: Path, parts: Sequence[Part]) -> None:
    """Put the figures between their marks; raises PageError for a page without these."""
    MARKS.replace(page, _figures(parts))


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
