"""Many flights at once, each in a process that may crash, hang, or be called off."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from skillwing.evaluation.campaign.command import make_plans
from skillwing.evaluation.campaign.worker_pool import LostFlight, WorkerPool
from skillwing.evaluation.flights.plan import FlightPlan
from skillwing.evaluation.flights.result import End, FlightResult

LANDS = """
import json, sys
plan = json.loads(sys.argv[1])
print(json.dumps({"plan": plan, "end": "landed at home", "text": " ".join(sys.argv[2:])}))
"""
HANGS = "import sys; sys.stdin.read()"


def nowhere(plan: FlightPlan) -> None:
    return None


def plans(count: int) -> list[FlightPlan]:
    return make_plans("mapping", f"0:{count}", "none", "courtyard", watched=True)


def test_each_plan_is_flown_once(tmp_path: Path) -> None:
    with WorkerPool(3, (sys.executable, "-c", LANDS)) as pool:
        results = list(pool.fly(plans(5), lambda plan: tmp_path / plan.name))
    flown = [result for result in results if isinstance(result, FlightResult)]
    assert sorted(result.plan.seed for result in flown) == [0, 1, 2, 3, 4]
    assert all(result.end is End.HOME for result in flown)
    assert {result.text for result in flown} == {str(tmp_path / plan.name) for plan in plans(5)}


@pytest.mark.parametrize(
    ("work", "why"),
    [
        (
            "import sys; sys.exit('No memory.')",
            "Its process ended with code 1. No memory.",
        ),
        ("import os; os.kill(os.getpid(), 9)", "Its process was killed by signal 9."),
    ],
)
def test_a_flight_whose_process_dies_is_lost_and_says_why(work: str, why: str) -> None:
    with WorkerPool(2, (sys.executable, "-c", work)) as pool:
        assert list(pool.fly(plans(1), nowhere)) == [LostFlight(plans(1)[0], why)]


def test_calling_a_campaign_off_ends_the_flights_that_are_under_way() -> None:
    looks = iter(range(3))

    def look() -> None:
        if next(looks, None) is None:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), WorkerPool(2, (sys.executable, "-c", HANGS)) as pool:
        list(pool.fly(plans(4), nowhere, look))


def test_the_real_worker_says_what_it_cannot_fly() -> None:
    unknown = FlightPlan(mission="picnic", world="courtyard", seed=1, condition=plans(1)[0].condition)
    with WorkerPool(1) as pool:
        (result,) = pool.fly([unknown], nowhere)
    assert isinstance(result, FlightResult)
    assert result.end is End.BROKE_OFF
    assert "picnic" in result.error
