"""A sample of a campaign speaks for all of it, and what does not end as before is told."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from skillwing.evaluation.campaign.command import campaign
from skillwing.evaluation.campaign.flight_code import FlightCode, claim
from skillwing.evaluation.campaign.ledger import CampaignLedger
from skillwing.evaluation.campaign.output import flight_line
from skillwing.evaluation.campaign.rerun import FlightSample, choose, comparison, end_alike, take_sample, verdict
from skillwing.evaluation.flights.conditions import Condition
from skillwing.evaluation.flights.plan import FlightNetwork, FlightPlan
from skillwing.evaluation.flights.result import End, FlightResult
from skillwing.services.errors import InvalidOptionError

CODE = FlightCode({"flight.py": "1"})


def flown(seed: int, condition: Condition = Condition.NONE) -> FlightResult:
    plan = FlightPlan(mission="mapping", world="courtyard", seed=seed, condition=condition)
    return FlightResult(plan=plan, end=End.HOME, phase="SUCCEEDED", clearance=2.0, digest=f"{seed} {condition}")


def over_zenoh(flight: FlightResult) -> FlightResult:
    return replace(flight, plan=replace(flight.plan, network=FlightNetwork.ZENOH), digest="another")


def campaign_in(folder: Path, flights: list[FlightResult]) -> Path:
    ledger = CampaignLedger(folder, resume=False)
    for flight in flights:
        ledger.add(flight)
    ledger.close()
    claim(folder, CODE)
    return folder


@given(st.dictionaries(st.sampled_from(Condition), st.integers(1, 30), min_size=1), st.data())
def test_a_sample_has_each_flight_once_and_each_condition_as_often_as_it_can(
    groups: dict[Condition, int], data: st.DataObject
) -> None:
    flights = [flown(seed, condition) for condition, count in groups.items() for seed in range(count)]
    count = data.draw(st.integers(1, len(flights)))
    chosen = choose(flights, count)
    assert len({flight.plan.name for flight in chosen}) == len(chosen) == count
    shares = {condition: sum(flight.plan.condition == condition for flight in chosen) for condition in groups}
    most = max(shares.values())
    assert all(share >= min(most - 1, groups[condition]) for condition, share in shares.items())


def test_the_seeds_of_a_sample_are_spread_and_differ_between_conditions() -> None:
    flights = [flown(seed, condition) for seed in range(100) for condition in (Condition.NONE, Condition.PILOT)]
    assert [flight.plan.seed for flight in choose(flights, 4)] == [12, 62, 37, 87]


@pytest.mark.parametrize(
    ("change", "alike"),
    [
        ({}, True),
        ({"end_time": 3.0, "clearance": 1.0, "text": "otherwise"}, True),
        ({"end": End.ELSEWHERE}, False),
        ({"phase": "FAILED"}, False),
        ({"collisions": 1}, False),
        ({"breaches": 1}, False),
        ({"deaths": ("hover was killed by SIGSEGV.",)}, False),
    ],
)
def test_flights_end_alike_where_drone_mission_and_promises_do(change: dict[str, object], alike: bool) -> None:
    assert end_alike(flown(1), replace(over_zenoh(flown(1)), **change)) is alike


def test_the_comparison_tells_each_flight_that_ended_otherwise_and_how() -> None:
    sample = FlightSample(Path("runs/first"), [flown(1), flown(2)], CODE)
    results = [over_zenoh(flown(1)), replace(over_zenoh(flown(2)), end=End.ELSEWHERE, phase="FAILED")]
    assert verdict(sample, results) == "1 of 2 flights end as they did in first."
    first, second = comparison(sample, results)[-2:]
    assert first.startswith("| courtyard 1, none | landed at home, succeeded | the same | 2.00 m |")
    assert second.startswith("| courtyard 2, none | landed at home, succeeded | **landed elsewhere, failed** |")


def test_a_process_exit_on_a_repeated_flight_is_reported() -> None:
    again = replace(over_zenoh(flown(1)), deaths=("hover was killed by SIGSEGV.",))
    told = comparison(FlightSample(Path("runs/first"), [flown(1)], CODE), [again])
    assert "**landed at home, succeeded, hover was killed by SIGSEGV**" in told[-1]
    assert "hover was killed by SIGSEGV." in flight_line(again, "1/1", 0.0).plain


def test_equal_flights_are_reported_as_equal_bit_by_bit() -> None:
    sample = FlightSample(Path("runs/first"), [flown(1), flown(2)], CODE)
    assert verdict(sample, [flown(1), flown(2)]).endswith("; 2 are the same flight bit by bit.")


def test_only_flights_that_differ_are_listed_one_by_one() -> None:
    sample = FlightSample(Path("runs/first"), [flown(1), flown(2)], CODE)
    assert len(comparison(sample, [flown(1), flown(2)])) == 1
    rows = comparison(sample, [flown(1), replace(flown(2), digest="another")])[4:]
    assert [row.split(" | ")[:3] for row in rows] == [["| courtyard 2, none", "landed at home, succeeded", "the same"]]


def test_a_sample_of_a_campaign_is_planned_for_another_network(tmp_path: Path) -> None:
    folder = campaign_in(tmp_path / "first", [flown(seed) for seed in range(5)])
    plans = take_sample(folder, "mapping", 2).plans(FlightNetwork.ZENOH)
    assert [(plan.seed, plan.network) for plan in plans] == [(1, "zenoh"), (3, "zenoh")]


def test_a_missing_sample_is_reported_before_anything_flies(tmp_path: Path) -> None:
    folder, again = campaign_in(tmp_path / "first", [flown(1)]), tmp_path / "again"
    with pytest.raises(InvalidOptionError, match="No campaign is in"):
        campaign("mapping", sample_of=tmp_path, output=again)
    with pytest.raises(InvalidOptionError, match="holds 1 flights of `mapping`, and 2 were asked for"):
        campaign("mapping", sample_of=folder, sample=2, output=again)
    with pytest.raises(InvalidOptionError, match="holds 0 flights of `inspection`"):
        campaign("inspection", sample_of=folder, sample=1, output=again)
    with pytest.raises(InvalidOptionError, match="follows from the campaign"):
        campaign("mapping", sample_of=folder, seeds="3", output=again)
    assert not again.exists()
