"""The figures of a campaign in the documentation: rewritten by a command, never by hand."""

from __future__ import annotations

from pathlib import Path

from simulation.campaign import Campaign
from simulation.planted import BUGS, SEEDS, find

BEGIN, END = "<!-- figures of the simulation: begin -->", "<!-- figures of the simulation: end -->"


def write_section(page: Path, campaign: Campaign) -> None:
    """Put the figures between their marks. Raises ValueError for a page without them."""
    text = page.read_text()
    if BEGIN not in text or END not in text:
        raise ValueError(f"{page} has no place for the figures: write the lines {BEGIN} and {END} into it")
    head, tail = text.split(BEGIN)[0], text.split(END)[1]
    page.write_text(f"{head}{BEGIN}\n{_figures(campaign)}\n{END}{tail}")


def _figures(campaign: Campaign) -> str:
    lines = [
        f"{campaign.runs:,} runs with {campaign.messages:,} messages took {campaign.seconds / 60:.0f} minutes on two "
        f"cores; {len(campaign.failures) or 'none'} of them found a broken promise.",
        "",
        *(f"- seed {seed}: {text}" for seed, text in sorted(campaign.failures.items())),
        *([""] if campaign.failures else []),
        "| mistake put into the managers | found by run | broken promise |",
        "|---|---|---|",
    ]
    for bug in BUGS:
        found = find(bug)
        told = f"{found[0] + 1} | {found[1]}" if found else f"not within {SEEDS} |"
        lines.append(f"| {bug} | {told} |")
    return "\n".join(lines)
