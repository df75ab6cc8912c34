"""docs/results.md: the tables between its markers, from the flights' results. What stands around them is by hand."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from statistics import median
from typing import TypeAlias

from paper_flights import POLICIES, Policy, camera_fails_at

from skillwing.m600.campaign.page import machine
from skillwing.m600.campaign.price import Price
from skillwing.m600.campaign.result import FlightResult
from skillwing.m600.demo.story import INSPECTION, MAPPING

BEGIN, END = "<!-- figures: make paper -->", "<!-- end of figures -->"
NOMINAL = "nominal"
BOTH = "map", "timeline"
Figure: TypeAlias = Callable[[FlightResult], float | None]
Show: TypeAlias = Callable[[float], str]


@dataclass(frozen=True, slots=True)
class Picture:
    """One that a recorded flight of a mission under a policy left."""

    mission: str
    world: str
    label: str
    file: str


PICTURES = (
    *(Picture(MAPPING, "courtyard", label, f"{what}.png") for label in (NOMINAL, "recovery") for what in BOTH),
    Picture(MAPPING, "courtyard", "none", "map.png"),
    *(Picture(INSPECTION, "inspection", "recovery", f"{what}.png") for what in BOTH),
)
SHOWN = frozenset((picture.mission, picture.label) for picture in PICTURES)
"""Missions and policies of which the page has pictures."""


def picture_name(picture: Picture) -> str:
    """Beside the page, where there is one folder for all of them."""
    return f"{picture.mission}-{picture.label}-{picture.file}"


@dataclass(frozen=True, slots=True)
class Column:
    """A figure of each flight, and how it is shown. change: the same for what it differs from the nominal flight of
    its seed, by default not shown. relative: the difference is a share of the nominal figure."""

    heading: str
    figure: Figure
    show: Show
    change: Show | None = None
    relative: bool = False


def _percent(value: float) -> str:
    return f"{value:.0f} %"


def _share(value: float) -> str:
    return _percent(100.0 * value)


def _points(value: float) -> str:
    return f"{100.0 * value:+.0f} points"


def _relative(value: float) -> str:
    return f"{100.0 * value:+.0f} %"


def _seconds(value: float) -> str:
    return f"{value:.0f} s"


def _charge(value: float) -> str:
    return f"{value:.1f} %"


def _metres(value: float) -> str:
    return f"{value:.2f} m"


def _flown_unseen(price: Price) -> float | None:
    """Share of the circle that was flown without live video."""
    return None if price.circled is None or price.circled_live is None else price.circled - price.circled_live


TIME = Column("robot time", lambda each: each.end_time, _seconds, _relative, relative=True)
BATTERY = Column("of the battery", lambda each: each.price.charge, _charge, _relative, relative=True)
COLUMNS = {
    MAPPING: (
        Column("mapped", lambda each: each.coverage, _share, _points),
        TIME,
        BATTERY,
        Column("nearest obstacle", lambda each: each.clearance, _metres),
    ),
    INSPECTION: (
        Column("circle flown", lambda each: each.price.circled, _share, _points),
        Column("flown unseen", lambda each: _flown_unseen(each.price), _share, _points),
        Column("away without video", lambda each: each.price.unseen, _seconds, lambda value: f"{value:+.0f} s"),
        TIME,
        BATTERY,
    ),
}


def write_page(page: Path, results: Sequence[FlightResult], planned: int) -> None:
    """Put the tables into the page, in place of those there. planned: flights that these seeds ask for."""
    old = page.read_text(encoding="utf-8") if page.exists() else f"# Results\n\n{BEGIN}\n{END}\n"
    before, _, rest = old.partition(BEGIN)
    after = rest.partition(END)[2]
    page.write_text(f"{before}{BEGIN}\n{tables(results, planned)}\n{END}{after}", encoding="utf-8")


def tables(results: Sequence[FlightResult], planned: int) -> str:
    """What was flown, and for each scenario the figures, the price and the seeds, as Markdown."""
    seeds = sorted({each.plan.seed for each in results})
    versions = ", ".join(sorted({each.version for each in results if each.version}))
    hours = sum(each.processor_time for each in results) / 3600.0
    parts = [
        f"{len(results)} of {planned} flights, of seed {', '.join(map(str, seeds))}, of version {versions}; "
        f"{hours:.1f} hours of processor time. {machine()}, {datetime.now(tz=UTC):%Y-%m-%d}. Cells of several flights: "
        "median (least to most)."
    ]
    for mission in POLICIES:
        flown = [each for each in results if each.plan.mission == mission]
        if flown:
            parts += [f"### {mission.capitalize()}", _figures(mission, flown), _price(mission, flown)]
            parts += [_by_seed(flown)] if mission == MAPPING else []
    return "\n\n".join(parts)


def _figures(mission: str, results: Sequence[FlightResult]) -> str:
    heads = ["policy", "flights", "succeeded", "collided", "ended", *(column.heading for column in COLUMNS[mission])]
    rows: list[list[str]] = []
    for policy, flown in _by_policy(mission, results):
        ends = Counter("crashed" if each.collisions else str(each.end) for each in flown)
        cells = [_spread(list(map(column.figure, flown)), column.show) for column in COLUMNS[mission]]
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


def _price(mission: str, results: Sequence[FlightResult]) -> str:
    """Each flight against the nominal one of its seed."""
    nominal = {each.plan.seed: each for each in results if each.plan.label == NOMINAL}
    columns = [column for column in COLUMNS[mission] if column.change is not None]
    rows: list[list[str]] = []
    for policy, flown in _by_policy(mission, results):
        pairs = [(each, nominal[each.plan.seed]) for each in flown if each.plan.seed in nominal]
        if policy.label != NOMINAL and pairs:
            cells = [
                _spread([_change(column, *pair) for pair in pairs], column.change or column.show) for column in columns
            ]
            rows.append([policy.words, *cells])
    heads = ["price, against the nominal flight of the same seed", *(column.heading for column in columns)]
    return _table(heads, rows) if rows else "No nominal flight to compare with."


def _change(column: Column, flight: FlightResult, nominal: FlightResult) -> float | None:
    ours, base = column.figure(flight), column.figure(nominal)
    if ours is None or base is None or (column.relative and base == 0.0):
        return None
    return (ours - base) / base if column.relative else ours - base


def _by_seed(results: Sequence[FlightResult]) -> str:
    """How much was mapped, and what was hit, seed by seed."""
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
    mapped = "no map" if flight.coverage is None else _share(flight.coverage)
    return ", ".join([mapped, *flight.broken])


def _by_policy(mission: str, results: Sequence[FlightResult]) -> list[tuple[Policy, list[FlightResult]]]:
    groups = [(policy, [each for each in results if each.plan.label == policy.label]) for policy in POLICIES[mission]]
    return [(policy, flown) for policy, flown in groups if flown]


def _spread(values: Sequence[float | None], show: Show) -> str:
    """Median, least and largest of what is known."""
    known = [value for value in values if value is not None]
    if not known:
        return "-"
    least, most = show(min(known)), show(max(known))
    return least if least == most else f"{show(median(known))} ({least} to {most})"


def _table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)
