"""Repetition of flights of an earlier campaign, on another network or with other code, to compare the ends."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from msgspec.structs import replace

from skillwing.evaluation.campaign.flight_code import FlightCode, read_code
from skillwing.evaluation.campaign.ledger import LEDGER_FILE, read_results
from skillwing.evaluation.campaign.outcomes import metres, share
from skillwing.evaluation.flights.plan import FlightNetwork, FlightPlan
from skillwing.evaluation.flights.result import FlightResult
from skillwing.services.errors import InvalidOptionError

HEADINGS = ("flight", "ended", "again", "nearest", "again", "mapped", "again", "time", "again")


@dataclass(frozen=True)
class FlightSample:
    """Flights of an earlier campaign, to be repeated. code: digest of the code that flew them."""

    folder: Path
    flights: Sequence[FlightResult]
    code: FlightCode

    def plans(self, network: FlightNetwork) -> list[FlightPlan]:
        """Plans of the same flights for a network."""
        return [replace(flight.plan, network=network) for flight in self.flights]

    def pairs(self, results: Sequence[FlightResult]) -> list[tuple[FlightResult, FlightResult]]:
        """Pairs of a flight and its repetition."""
        repeat = {_name(result.plan): result for result in results}
        return [(flight, repeat[name]) for flight in self.flights if (name := _name(flight.plan)) in repeat]


def take_sample(folder: Path, mission: str, count: int) -> FlightSample:
    """Choose `count` flights of a mission from a campaign's folder.

    Raises InvalidOptionError if the folder has no campaign, or too few flights.
    """
    path = folder / LEDGER_FILE
    if not path.exists():
        raise InvalidOptionError("sample_of", f"No campaign is in {folder}. Give the folder of one, as runs/NAME.")
    flights = [result for result in read_results(path) if result.plan.mission == mission]
    if not 1 <= count <= len(flights):
        sentence = f"{folder} holds {len(flights)} flights of `{mission}`, and {count} were asked for."
        raise InvalidOptionError("sample", f"{sentence} Ask for one at least, and for no more than there are.")
    return FlightSample(folder, choose(flights, count), read_code(folder))


def choose(flights: Sequence[FlightResult], count: int) -> list[FlightResult]:
    """Choose `count` flights: equally many of each group of plans that differ only in their seed, evenly spread."""
    groups: dict[str, list[FlightResult]] = {}
    for flight in sorted(flights, key=lambda each: each.plan.seed):
        groups.setdefault(replace(flight.plan, seed=0).name, []).append(flight)
    shares = dict.fromkeys(groups, 0)
    while sum(shares.values()) < count:
        key = min((key for key in groups if shares[key] < len(groups[key])), key=lambda key: shares[key])
        shares[key] += 1
    chosen: list[FlightResult] = []
    for place, (key, group) in enumerate(groups.items()):
        offset = (place + 0.5) / len(groups)
        chosen += [group[int((turn + offset) * len(group) / shares[key])] for turn in range(shares[key])]
    return chosen


def end_alike(flight: FlightResult, repeat: FlightResult) -> bool:
    """True if both flights ended in the same way and kept the same promises, and no process died in the second one."""
    return (flight.end, flight.phase, flight.kept) == (repeat.end, repeat.phase, repeat.kept) and not repeat.deaths


def same_flight(flight: FlightResult, repeat: FlightResult) -> bool:
    """True for flights that are equal bit by bit. Over Zenoh they cannot be; equal ends suffice there."""
    if repeat.plan.network is FlightNetwork.ZENOH:
        return end_alike(flight, repeat)
    return flight.digest == repeat.digest


def verdict(sample: FlightSample, results: Sequence[FlightResult]) -> str:
    """Sentence that counts the flights with the same end as before."""
    pairs = sample.pairs(results)
    alike = sum(end_alike(*pair) for pair in pairs)
    same = sum(flight.digest == repeat.digest for flight, repeat in pairs)
    bitwise = f"; {same} are the same flight bit by bit" if same else ""
    return f"{alike} of {len(pairs)} flights end as they did in {sample.folder.name}{bitwise}."


def comparison(sample: FlightSample, results: Sequence[FlightResult]) -> list[str]:
    """Lines of Markdown: the verdict, and each flight that is not equal bit by bit, with its earlier result."""
    other = [(flight, repeat) for flight, repeat in sample.pairs(results) if flight.digest != repeat.digest]
    then = f"{verdict(sample, results)} Code {sample.code.digest} flew them then. Its conditions in turn, seeds spread"
    if not other:
        return [f"{then}."]
    return [
        f"{then}:",
        "",
        "| " + " | ".join(HEADINGS) + " |",
        "|---|---|---|" + "---:|" * (len(HEADINGS) - 3),
        *("| " + " | ".join(_cells(flight, repeat)) + " |" for flight, repeat in other),
    ]


def _cells(flight: FlightResult, repeat: FlightResult) -> tuple[str, ...]:
    plan = flight.plan
    ended = "the same" if end_alike(flight, repeat) else f"**{_ended(repeat)}**"
    return (
        f"{plan.world} {plan.seed}, {plan.condition}",
        _ended(flight),
        ended,
        *(metres(each.clearance) for each in (flight, repeat)),
        *(share(each.coverage) for each in (flight, repeat)),
        *(f"{each.end_time:.0f} s" for each in (flight, repeat)),
    )


def _ended(result: FlightResult) -> str:
    deaths = (each.removesuffix(".") for each in result.deaths)
    return ", ".join(filter(None, (result.end, result.phase.lower(), *result.broken, *deaths)))


def _name(plan: FlightPlan) -> str:
    """Name of a flight, the same for its repetition."""
    return replace(plan, network=FlightNetwork.IN_PROCESS).name
