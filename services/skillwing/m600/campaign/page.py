"""The page of what campaigns found: one section for each kind of campaign, written anew by the next one."""

from __future__ import annotations

import os
import platform
import shlex
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from skillwing.m600.campaign.outcomes import HEADINGS, Outcomes
from skillwing.m600.campaign.result import FlightResult
from skillwing.services.marked_page import Marks


def section(
    title: str, words: Sequence[str], results: Sequence[FlightResult], rows: Sequence[Outcomes], code: str
) -> str:
    """A section in Markdown: what was flown, the table, and each flight that broke a promise.

    words: of the command that flew the campaign. code: digest of the code that flew.
    """
    seeds = sorted({result.plan.seed for result in results})
    hours = sum(result.processor_time for result in results) / 3600.0
    pace = sum(result.end_time for result in results) / max(1e-9, 3600.0 * hours)
    broken = [result for result in results if not result.kept]
    lines = [
        f"## {title}",
        "",
        f"{len(results)} flights, seeds {_ranges(seeds)}, by code {code}; {hours:.1f} hours of processor time, "
        f"{pace:.1f} times as fast as real time on one core. {machine()}, {datetime.now(tz=UTC):%Y-%m-%d}.",
        "",
        "| " + " | ".join(HEADINGS) + " |",
        "|---|---|" + "---:|" * (len(HEADINGS) - 2),
        *("| " + " | ".join(row.cells) + " |" for row in rows),
        "",
    ]
    if broken:
        lines += [
            f"{len(broken)} flights broke a promise:",
            "",
            "| flight | what | the mission's end | again |",
            "|---|---|---|---|",
        ]
        lines += [
            f"| {result.plan.name} | {', '.join(result.broken)} | {result.phase} {result.text} | "
            f"`{result.plan.command}` |"
            for result in broken
        ]
    else:
        lines.append(
            "No flight broke a promise: nothing was hit, the fence was kept, every drone stands or was handed over."
        )
    return "\n".join([*lines, "", f"`{shlex.join(words)}` flies this again and rewrites this section."])


def write(page: Path, title: str, text: str) -> None:
    """Put a section into a page, in place of the one with the same title. Raises PageError."""
    _marks(title).replace_or_append(page, text, title="Missions")


def check(page: Path, title: str) -> None:
    """Raises PageError for a page that cannot take a section with this title."""
    _marks(title).check_place(page)


def _marks(title: str) -> Marks:
    return Marks.of_section(f"campaign: {title}")


def machine() -> str:
    """What was flown on."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.exists() else []
    names = {line.partition(":")[2].strip() for line in lines if line.startswith("model name")}
    return f"{os.cpu_count()} x {', '.join(sorted(names)) or platform.machine()}, Python {platform.python_version()}"


def _ranges(numbers: Sequence[int]) -> str:
    """Ascending numbers in words: `0 to 99, 120`."""
    runs: list[tuple[int, int]] = []
    for number in numbers:
        if runs and number == runs[-1][1] + 1:
            runs[-1] = runs[-1][0], number
        else:
            runs.append((number, number))
    return ", ".join(str(first) if first == last else f"{first} to {last}" for first, last in runs)
