"""Outcomes of a campaign, counted by world and condition."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from statistics import median

import msgspec
from rich.table import Table

from skillwing.evaluation.flights.conditions import Condition
from skillwing.evaluation.flights.result import SAFE_ENDS, End, FlightResult

HEADINGS = (
    "world",
    "condition",
    "flights",
    "met",
    "succeeded",
    "failed, safe",
    "at home",
    "elsewhere",
    "handed over",
    "not landed",
    "collided",
    "left fence",
    "least clearance",
    "mapped",
    "time",
)
SHORT_HEADINGS = (
    *("world", "condition", "flew", "met", "done", "safe", "home", "else", "pilot", "up", "hit", "out"),
    *("near", "map", "time"),
)
"""Short forms of `HEADINGS` for a terminal."""
LEGEND = (
    "met: each fault began before the landing; done: the mission succeeded; safe: it failed and kept every promise. "
    "Landed at home or elsewhere, handed to the pilot, still up, hit something, out of the fence."
)
ALL = "all"


class Outcomes(msgspec.Struct, frozen=True, kw_only=True):
    """Numbers of flights; least clearance [m], medians of coverage (a share) and time [robot s].

    met: flights in which every planned fault began before the drone landed. failed_safe: flights without success that
    kept every promise.
    """

    world: str
    condition: str
    flights: int
    met: int
    succeeded: int
    failed_safe: int
    at_home: int
    elsewhere: int
    handed_over: int
    not_landed: int
    collided: int
    left_fence: int
    clearance: float | None
    coverage: float | None
    time: float

    @property
    def cells(self) -> tuple[str, ...]:
        """The outcomes under `HEADINGS`."""
        return (
            self.world,
            self.condition,
            *map(
                str,
                (
                    self.flights,
                    self.met,
                    self.succeeded,
                    self.failed_safe,
                    self.at_home,
                    self.elsewhere,
                    self.handed_over,
                    self.not_landed,
                    self.collided,
                    self.left_fence,
                ),
            ),
            metres(self.clearance),
            share(self.coverage),
            f"{self.time:.0f} s",
        )


def worst_of(results: Iterable[FlightResult], count: int) -> list[FlightResult]:
    """The `count` worst flights, the worst first."""
    return sorted(results, key=lambda result: result.badness, reverse=True)[:count]


def outcomes(results: Iterable[FlightResult]) -> list[Outcomes]:
    """Outcomes of each flown world and condition, and of all flights together."""
    found = list(results)
    groups: dict[tuple[str, Condition], list[FlightResult]] = {}
    for world in dict.fromkeys(result.plan.world for result in found):
        for condition in Condition:
            group = [each for each in found if (each.plan.world, each.plan.condition) == (world, condition)]
            if group:
                groups[world, condition] = group
    rows = [_outcomes(world, condition, group) for (world, condition), group in groups.items()]
    return [*rows, _outcomes(ALL, ALL, found)] if len(rows) > 1 else rows


def metres(distance: float | None) -> str:
    """Cell of a table for a distance [m]."""
    return "-" if distance is None else f"{distance:.2f} m"


def share(coverage: float | None) -> str:
    """Cell of a table for a coverage, in percent."""
    return "-" if coverage is None else f"{100 * coverage:.0f} %"


def outcome_table(rows: Sequence[Outcomes]) -> Table:
    """Table of outcomes for a terminal. 80 columns are enough for one world."""
    several_worlds = len({row.world for row in rows} - {ALL}) > 1
    table = Table(box=None, pad_edge=False, header_style="bold", padding=(0, 1, 0, 0), caption=LEGEND)
    table.caption_justify = "left"
    for name, heading in zip(HEADINGS, SHORT_HEADINGS, strict=True):
        if name != "world" or several_worlds:
            table.add_column(heading, justify="left" if name in ("world", "condition") else "right", no_wrap=True)
    for row in rows:
        broken = row.collided or row.left_fence or row.not_landed
        table.add_row(*(row.cells if several_worlds else row.cells[1:]), style="red" if broken else None)
    return table


def _outcomes(world: str, condition: str, results: Sequence[FlightResult]) -> Outcomes:
    clearances = [each.clearance for each in results if each.clearance is not None]
    coverages = [each.coverage for each in results if each.coverage is not None]
    ends = [each.end for each in results]
    return Outcomes(
        world=world,
        condition=condition,
        flights=len(results),
        met=sum(each.met for each in results),
        succeeded=sum(each.succeeded for each in results),
        failed_safe=sum(each.kept and not each.succeeded for each in results),
        at_home=ends.count(End.HOME),
        elsewhere=ends.count(End.ELSEWHERE),
        handed_over=ends.count(End.HANDED_OVER),
        not_landed=sum(end not in SAFE_ENDS for end in ends),
        collided=sum(each.collisions > 0 for each in results),
        left_fence=sum(each.breaches > 0 for each in results),
        clearance=min(clearances, default=None),
        coverage=median(coverages) if coverages else None,
        time=median(each.end_time for each in results) if results else 0.0,
    )
