"""Terminal output of a campaign: a line for each flight, and the outcomes as a table or as JSON."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass, field

import msgspec
from rich.console import Console
from rich.text import Text

from skillwing.evaluation.campaign.outcomes import outcome_table, outcomes
from skillwing.evaluation.campaign.rerun import FlightSample, end_alike, verdict
from skillwing.evaluation.campaign.worker_pool import LostFlight
from skillwing.evaluation.flights.result import FlightResult
from skillwing.services.terminal.output import print_json


@dataclass
class CampaignState:
    """Results of a campaign so far.

    lost: flights without a result. differing: names of flights whose recorded repetition was another flight.
    unrecorded: flights whose process was lost during the recording. earlier: the sampled campaign, if this is a sample.
    """

    results: list[FlightResult]
    earlier: FlightSample | None
    lost: list[LostFlight] = field(default_factory=list[LostFlight])
    differing: list[str] = field(default_factory=list[str])
    unrecorded: list[LostFlight] = field(default_factory=list[LostFlight])

    @property
    def as_promised(self) -> bool:
        """Every flight has a result, kept the promises, and was the same again where it was recorded."""
        kept = all(result.kept for result in self.results)
        alike = self.earlier is None or all(end_alike(*pair) for pair in self.earlier.pairs(self.results))
        return kept and alike and not (self.lost or self.differing or self.unrecorded)


class Summary(msgspec.Struct, frozen=True, kw_only=True):
    """The JSON of `--json`.

    broken: flights that broke a promise, each with the command that repeats and records it. lost, differing and
    unrecorded: as in `CampaignState`. sampled, alike: number of repeated flights, and of those with the same end; null
    if the campaign is no sample.
    """

    folder: str
    planned: int
    flown: int
    outcomes: list[dict[str, object]]
    broken: list[dict[str, object]]
    lost: list[dict[str, str]]
    differing: list[str]
    unrecorded: list[dict[str, str]]
    sampled: int | None = None
    alike: int | None = None


def flight_line(result: FlightResult | LostFlight, count: str, left: float) -> Text:
    """One flight, and about how long the others will take [s]."""
    plan = result.plan
    text = Text(f"{count:>7} {plan.world} {plan.condition} {plan.seed}".ljust(33) + " ")
    if isinstance(result, LostFlight):
        return text.append(f"lost: {result.why} Fly it again by --resume.", "red")
    clearance = "" if result.clearance is None else f"{result.clearance:.2f} m"
    mapped = "" if result.coverage is None else f"{100 * result.coverage:.0f} %"
    text.append(f"{result.end:17}", "" if result.kept else "red")
    text.append("done   " if result.succeeded else "failed ", "green" if result.succeeded else "yellow")
    text.append(f"{clearance:>7}{mapped:>5}{result.end_time:6.0f} s", "dim")
    text.append(f"  {_duration(left)} left", "dim")
    if result.deaths:
        text.append(f"\n        {' '.join(result.deaths)}", "yellow")
    if not result.kept:
        text.append(f"\n        {', '.join(result.broken)}\n        {plan.command}", "red")
    return text


def _duration(seconds: float) -> str:
    minutes = round(seconds / 60.0)
    return f"{minutes // 60} h {minutes % 60:02} min" if minutes >= 60 else f"{minutes} min"


def show_summary(state: CampaignState, console: Console) -> None:
    """The table, and what else there is to say."""
    if state.results:
        console.print()
        console.print(outcome_table(outcomes(state.results)))
    if state.earlier:
        console.print(verdict(state.earlier, state.results), soft_wrap=True)
    if state.lost:
        console.print(f"{lost_flights(state.lost)} Fly what is missing by --resume.", style="red", soft_wrap=True)


def lost_flights(lost: Sequence[LostFlight]) -> str:
    """Sentence that counts the flights without a result and gives the reason of the first."""
    first, *others = lost
    more = f" and of {len(others)} more" if others else ""
    return f"There is no result of {first.plan.name}{more}. {first.why}"


def print_summary(folder: str, planned: int, state: CampaignState) -> None:
    """The same as JSON. planned: so many flights were to be flown."""
    pairs = state.earlier.pairs(state.results) if state.earlier else ()
    print_json(
        Summary(
            folder=folder,
            planned=planned,
            flown=len(state.results),
            outcomes=[msgspec.to_builtins(row) for row in outcomes(state.results)],
            broken=[
                {**msgspec.to_builtins(result), "broken": result.broken, "command": result.plan.command}
                for result in state.results
                if not result.kept
            ],
            lost=_names_and_reasons(state.lost),
            differing=state.differing,
            unrecorded=_names_and_reasons(state.unrecorded),
            sampled=len(pairs) if state.earlier else None,
            alike=sum(end_alike(*pair) for pair in pairs) if state.earlier else None,
        )
    )


def _names_and_reasons(lost: Sequence[LostFlight]) -> list[dict[str, str]]:
    return [{"flight": each.plan.name, "why": each.why} for each in lost]


def command_words() -> list[str]:
    """The command that was given, as it is to be given again: into a new folder."""
    given, kept = iter(sys.argv[1:]), ["skillwing"]
    for word in given:
        if word in ("-o", "--output"):
            next(given, None)
        elif word != "--resume" and not word.startswith("--output="):
            kept.append(word)
    return kept
