"""Campaign results in a Markdown page: one section for each kind of campaign, rewritten by its next run."""

from __future__ import annotations

import os
import platform
import shlex
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from skillwing.evaluation.campaign.outcomes import HEADINGS, Outcomes, worst_of
from skillwing.evaluation.flights.conditions import Condition, conditions_of, met_from
from skillwing.evaluation.flights.plan import FlightNetwork, FlightPlan
from skillwing.evaluation.flights.result import FlightResult
from skillwing.services.terminal.doc_sections import Marks
from skillwing.sim_mujoco.world.kinds import KINDS

NAMED = 3
"""Number of named worst flights, if none broke a promise."""
CONFIDENCE = 0.95
"""Confidence level of the upper bound for the rate of broken promises."""


def title_of(plans: Sequence[FlightPlan], *, repeated: bool = False) -> str:
    """Title of a campaign's section: its settings without the seeds. repeated: a sample of an earlier one."""
    first = plans[0]
    kinds, conditions = {plan.world for plan in plans}, {plan.condition for plan in plans}
    worlds = ", ".join(kind for kind in KINDS if kind in kinds)
    all_of_them = conditions == set(conditions_of(first.mission))
    met = "all conditions" if all_of_them else ", ".join(each for each in Condition if each in conditions)
    parts = [
        f"{first.mission} in {worlds}: {met}",
        "" if first.watched else "without obstacle detection",
        *sorted({plan.label for plan in plans}),
        "over Zenoh" if first.network is FlightNetwork.ZENOH else "",
        "flown again" if repeated else "",
    ]
    return ", ".join(filter(None, parts))


def section(
    title: str,
    words: Sequence[str],
    results: Sequence[FlightResult],
    rows: Sequence[Outcomes],
    code: str,
    more: Sequence[str] = (),
) -> str:
    """Section in Markdown: the settings, the table, and each flight that broke a promise.

    title: begins with a small letter (`title_of`). words: command line of the campaign. code: digest of the code that
    flew. more: lines to append.
    """
    seeds = sorted({result.plan.seed for result in results})
    hours = sum(result.processor_time for result in results) / 3600.0
    pace = sum(result.end_time for result in results) / max(1e-9, 3600.0 * hours)
    broken = [result for result in results if not result.kept]
    lines = [
        f"## {title[0].upper()}{title[1:]}",
        "",
        f"{len(results)} flights of {_ranges(seeds)} by code {code}; {hours:.1f} hours of processor time, "
        f"{pace:.1f} times as fast as real time on one core. {machine()}, {datetime.now(tz=UTC):%Y-%m-%d}.",
        "",
        "| " + " | ".join(HEADINGS) + " |",
        "|---|---|" + "---:|" * (len(HEADINGS) - 2),
        *("| " + " | ".join(row.cells) + " |" for row in rows),
        "",
        *_beginnings(results),
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
            "No flight broke a promise: nothing was hit, the fence was kept, every drone stands or was handed over. "
            f"{_surely(results)}The worst of them, failures first and then by their least clearance: "
            f"{', '.join(f'`{result.plan.name}`' for result in worst_of(results, NAMED))}."
        )
    if more:
        lines += ["", *more]
    return "\n".join([*lines, "", f"`{shlex.join(words)}` flies this again and rewrites this section."])


def _surely(results: Sequence[FlightResult]) -> str:
    """Upper bound for the rate of broken promises if none was seen; empty for too few worlds.

    It is the exact bound of Clopper and Pearson (1934). Worlds are counted and not flights, because flights in one
    world are nearly the same until the fault begins.
    """
    worlds = len({(result.plan.world, result.plan.seed) for result in results})
    one_in = int(1.0 / (1.0 - (1.0 - CONFIDENCE) ** (1.0 / worlds)))
    if one_in < 2:
        return ""
    expected = f"a broken promise is to be expected in fewer than one of {one_in} like them"
    return f"With none in {worlds} worlds, {expected} ({100.0 * CONFIDENCE:.0f} % confidence). "


def write(page: Path, title: str, text: str) -> None:
    """Write a section into a page; it replaces the one with the same title. Raises PageError."""
    _marks(title).replace_or_append(page, text, title="Missions")


def read(page: Path, title: str) -> str:
    """The section of a page with this title. Raises PageError where there is none."""
    return _marks(title).read(page)


def check(page: Path, title: str) -> None:
    """Raises PageError for a page that cannot hold a section with this title."""
    _marks(title).check_place(page)


def _marks(title: str) -> Marks:
    return Marks.of_section(f"campaign: {title}")


def _beginnings(results: Sequence[FlightResult]) -> list[str]:
    """Lines that count the flights in which the condition began; none for campaigns without faults."""
    drawn = [(t, each.met) for each in results if (t := met_from(each.plan.circumstances())) is not None]
    if not drawn:
        return []
    times = sorted(t for t, met in drawn if met)
    when = f", {times[0]:.0f} to {times[-1]:.0f} s after the start" if times else ""
    return [
        f"Met: in {len(times)} of {len(drawn)} flights every planned fault began before the drone was down{when}.",
        "",
    ]


def machine() -> str:
    """Processor and Python version of this machine."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.exists() else []
    names = {line.partition(":")[2].strip() for line in lines if line.startswith("model name")}
    return f"{os.cpu_count()} x {', '.join(sorted(names)) or platform.machine()}, Python {platform.python_version()}"


def _ranges(seeds: Sequence[int]) -> str:
    """Ascending seeds in words, as `seeds 0 to 99, 120`; only their number and limits for many ranges."""
    runs: list[tuple[int, int]] = []
    for seed in seeds:
        if runs and seed == runs[-1][1] + 1:
            runs[-1] = runs[-1][0], seed
        else:
            runs.append((seed, seed))
    if len(runs) > NAMED:
        return f"{len(seeds)} seeds from {seeds[0]} to {seeds[-1]}"
    return "seeds " + ", ".join(str(first) if first == last else f"{first} to {last}" for first, last in runs)
