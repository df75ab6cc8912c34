"""Tables of docs/results.md from the flights' results, written between its markers. The other text is handwritten."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from statistics import median
from typing import TypeAlias

from paper_flights import POLICIES, Policy, camera_fails_at

from skillwing.evaluation.campaign.page import machine
from skillwing.evaluation.demo.story import INSPECTION, MAPPING
from skillwing.evaluation.flights.cost import Cost
from skillwing.evaluation.flights.plan import FlightPlan
from skillwing.evaluation.flights.result import FlightResult
from skillwing.services.terminal.doc_sections import Marks

MARKS = Marks("<!-- figures: make paper -->", "<!-- end of figures -->")
SHOWN_PICTURE = r"\(images/results/([^)]+)\)"
"""Pattern of the page's links to its pictures."""
NOMINAL, RECOVERY = "nominal", "recovery"
BOTH = "map", "timeline"
Figure: TypeAlias = Callable[[FlightResult], float | None]


@dataclass(frozen=True, slots=True)
class Picture:
    """Picture from the recorded flight of a mission under a policy."""

    mission: str
    label: str
    file: str


PICTURES = (
    *(Picture(MAPPING, label, f"{what}.png") for label in (NOMINAL, RECOVERY) for what in BOTH),
    Picture(MAPPING, "none", "map.png"),
    Picture(INSPECTION, RECOVERY, "timeline.png"),
)
SHOWN = frozenset((picture.mission, picture.label) for picture in PICTURES)
"""Missions and policies with pictures on the page."""


def picture_name(picture: Picture) -> str:
    """File name of a picture, unique in the folder beside the page."""
    return f"{picture.mission}-{picture.label}-{picture.file}"


@dataclass(frozen=True, slots=True)
class Unit:
    """Format of a figure: factor to its unit and number format, which never prints `-0`."""

    format: str
    name: str
    factor: float = 1.0

    def bare(self, value: float) -> str:
        """Number without the unit."""
        return f"{self.factor * value:{self.format}}"

    def show(self, value: float) -> str:
        return f"{self.bare(value)} {self.name}"


SHARE, CHARGE = Unit("z.0f", "%", 100.0), Unit("z.1f", "%")
SECONDS, METRES = Unit("z.0f", "s"), Unit("z.2f", "m")
POINTS, RELATIVE, MORE_SECONDS = Unit("+z.0f", "points", 100.0), Unit("+z.0f", "%", 100.0), Unit("+z.0f", "s")


@dataclass(frozen=True, slots=True)
class Column:
    """A figure of each flight. change: unit of its difference from another flight of the seed, None if that is not
    shown. relative: the difference is a share of that flight's figure."""

    heading: str
    figure: Figure
    unit: Unit
    change: Unit | None = None
    relative: bool = False


def _flown_unseen(cost: Cost) -> float | None:
    """Share of the circle that was flown without live video."""
    return None if cost.circled is None or cost.circled_live is None else cost.circled - cost.circled_live


MAPPED = Column("mapped", lambda each: each.coverage, SHARE, POINTS)
TIME = Column("robot time", lambda each: each.end_time, SECONDS, RELATIVE, relative=True)
BATTERY = Column("of the battery", lambda each: each.cost.charge, CHARGE, RELATIVE, relative=True)
CLEARANCE = Column("nearest obstacle", lambda each: each.clearance, METRES)
CIRCLED = Column("circle flown", lambda each: each.cost.circled, SHARE, POINTS)
UNSEEN = Column("flown unseen", lambda each: _flown_unseen(each.cost), SHARE, POINTS)
AWAY = Column("away without video", lambda each: each.cost.unseen, SECONDS, MORE_SECONDS)
COLUMNS = {MAPPING: (MAPPED, TIME, BATTERY, CLEARANCE), INSPECTION: (CIRCLED, TIME, BATTERY, UNSEEN, AWAY)}


def write_page(
    page: Path, results: Sequence[FlightResult], plans: Sequence[FlightPlan], code: str, drawn: Collection[str]
) -> None:
    """Replace the tables of the page. plans: all planned flights. code: digest of the code that flew the results.
    drawn: pictures of these flights; the page's other pictures are older.

    Raises PageError.
    """
    MARKS.check(page)
    older = sorted(set(re.findall(SHOWN_PICTURE, page.read_text(encoding="utf-8"))).difference(drawn))
    MARKS.replace(page, tables(results, plans, code, older))


def tables(results: Sequence[FlightResult], plans: Sequence[FlightPlan], code: str, older: Sequence[str] = ()) -> str:
    """Flown and missing flights, and for each scenario the figures, costs and seeds, as Markdown.

    older: pictures of other flights.
    """
    seeds = sorted({each.plan.seed for each in results})
    hours = sum(each.processor_time for each in results) / 3600.0
    parts = [
        f"{len(results)} of {len(plans)} flights, of {_seeds(seeds)}, all by the same flight code, "
        f"{code}; {hours:.1f} hours of processor time. {machine()}, "
        f"{datetime.now(tz=UTC):%Y-%m-%d}. Cells of several flights: median (least to most)."
    ]
    if missing := _missing(results, plans):
        parts.append(f"**Not in these tables, for it has not been flown by this code: {'; '.join(missing)}.**")
    if older:
        names = ", ".join(f"`{name}`" for name in older)
        parts.append(f"**Pictures on this page that show earlier flights, by other code: {names}.**")
    for mission in POLICIES:
        flown = [each for each in results if each.plan.mission == mission]
        if flown:
            parts += [f"### {mission.capitalize()}", _figures(mission, flown), _cost_table(mission, flown)]
            parts += [_by_seed(flown)] if mission == MAPPING else []
    return "\n\n".join(parts)


def _missing(results: Sequence[FlightResult], plans: Sequence[FlightPlan]) -> list[str]:
    """Planned flights without a result, in words: for each mission the policies and seeds."""
    flown = [each.plan for each in results]
    told: list[str] = []
    for mission, policies in POLICIES.items():
        lacking: dict[tuple[int, ...], list[str]] = {}
        for policy in policies:
            own = [plan for plan in plans if (plan.mission, plan.label) == (mission, policy.label)]
            seeds = tuple(plan.seed for plan in own if plan not in flown)
            lacking.setdefault(seeds, []).append(policy.label)
        for seeds, labels in lacking.items():
            if seeds:
                which = "every policy" if len(labels) == len(policies) else ", ".join(labels)
                told.append(f"{mission}, {which}, {_seeds(seeds)}")
    return told


def _seeds(seeds: Sequence[int]) -> str:
    return f"seed{'s' if len(seeds) > 1 else ''} {', '.join(map(str, seeds))}"


def _figures(mission: str, results: Sequence[FlightResult]) -> str:
    heads = ["policy", "flights", "succeeded", "collided", "ended", *(column.heading for column in COLUMNS[mission])]
    rows: list[list[str]] = []
    for policy, flown in _by_policy(mission, results):
        ends = Counter("crashed" if each.collisions else str(each.end) for each in flown)
        cells = [_spread(list(map(column.figure, flown)), column.unit) for column in COLUMNS[mission]]
        rows.append(
            [
                policy.words,
                str(len(flown)),
                str(sum(each.succeeded for each in flown)),
                str(sum(each.collisions > 0 for each in flown)),
                ", ".join(f"{count} {end}" for end, count in ends.items()),
                *cells,
            ]
        )
    return _table(heads, rows)


def _cost_table(mission: str, results: Sequence[FlightResult]) -> str:
    """Table of the cost of recovery: its flights against those of the same seed under the other policies."""
    recovered = {each.plan.seed: each for each in results if each.plan.label == RECOVERY}
    columns = [(column, column.change) for column in COLUMNS[mission] if column.change is not None]
    rows: list[list[str]] = []
    for policy, flown in _by_policy(mission, results):
        pairs = [(recovered[each.plan.seed], each) for each in flown if each.plan.seed in recovered]
        if policy.label != RECOVERY and pairs:
            cells = [_spread([_change(column, *pair) for pair in pairs], unit) for column, unit in columns]
            crashed = sum(other.collisions > 0 for _, other in pairs)
            rows.append([policy.words + (f" ({crashed} of {len(pairs)} crashed)" if crashed else ""), *cells])
    heads = ["recovery, against the flight of the same seed", *(column.heading for column, _ in columns)]
    return _table(heads, rows) if rows else "Nothing to compare recovery with."


def _change(column: Column, flight: FlightResult, other: FlightResult) -> float | None:
    ours, base = column.figure(flight), column.figure(other)
    if ours is None or base is None or (column.relative and base == 0.0):
        return None
    return (ours - base) / base if column.relative else ours - base


def _by_seed(results: Sequence[FlightResult]) -> str:
    """Coverage and collisions by seed."""
    flights = {(each.plan.seed, each.plan.label): each for each in results}
    policies = POLICIES[MAPPING]
    rows: list[list[str]] = []
    for seed in sorted({seed for seed, _ in flights}):
        cells = [_outcome(flights.get((seed, policy.label))) for policy in policies]
        rows.append([str(seed), f"{camera_fails_at(seed):g} s", *cells])
    return _table(["seed", "camera fails at", *(policy.words for policy in policies)], rows)


def _outcome(flight: FlightResult | None) -> str:
    if flight is None:
        return "not flown"
    mapped = "no map" if flight.coverage is None else SHARE.show(flight.coverage)
    return ", ".join([mapped, *flight.broken])


def _by_policy(mission: str, results: Sequence[FlightResult]) -> list[tuple[Policy, list[FlightResult]]]:
    groups = [(policy, [each for each in results if each.plan.label == policy.label]) for policy in POLICIES[mission]]
    return [(policy, flown) for policy, flown in groups if flown]


def _spread(values: Sequence[float | None], unit: Unit) -> str:
    """Median, minimum and maximum of the known values, with their number if some are unknown."""
    known = [value for value in values if value is not None]
    if not known:
        return "-"
    least, most = unit.bare(min(known)), unit.bare(max(known))
    told = unit.show(known[0]) if least == most else f"{unit.show(median(known))} ({least} to {most})"
    return told if len(known) == len(values) else f"{told}, {len(known)} of {len(values)} known"


def _table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)
