"""Flights for docs/results.md: both scenarios of the paper, without the failure and with several reactions to it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from skillwing.evaluation.demo.story import INSPECTION, MAPPING, make_story
from skillwing.evaluation.flights.conditions import Condition
from skillwing.evaluation.flights.plan import FlightPlan, planned_way, way_time

FIRST, LAST = 0.3125, 1.4375
"""Limits of the time of the camera's failure, as shares of the route's time at cruise speed.

Turns, detours, takeoff and return are not part of the route's time."""
GOLDEN = 0.6180339887498949
"""Golden section: the fractional parts of its multiples are spread evenly for any number of seeds."""


@dataclass(frozen=True, slots=True)
class Policy:
    """A reaction to the failure. label: name of its flights. words: name in tables. fails: False for the nominal
    flight. instead: option of the alternative mission, empty for the library's mission.
    """

    label: str
    words: str
    fails: bool = True
    instead: str = ""


POLICIES = {
    MAPPING: (
        Policy("nominal", "nominal", fails=False),
        Policy("recovery", "recovery: on by LiDAR"),
        Policy("abort", "abort: land at once", instead="land"),
        Policy("home", "home at once", instead="home"),
        Policy("none", "none: on, blind", instead="blind"),
    ),
    INSPECTION: (
        Policy("nominal", "nominal", fails=False),
        Policy("recovery", "recovery: hover, land there"),
        Policy("abort", "abort: land at once", instead="land"),
        Policy("home", "home at once", instead="home"),
        Policy("none", "none: on, unseen", instead="unwatched"),
    ),
}
"""Policies by mission. The nominal policy comes first: the others are compared with it."""


def paper_plans(seeds: range) -> list[FlightPlan]:
    """Plans in the order of seeds, so that an interrupted run has flown all policies equally often."""
    return [_plan(mission, seed, policy) for seed in seeds for mission in POLICIES for policy in POLICIES[mission]]


def camera_fails_at(seed: int) -> float:
    """Robot time of the camera's failure [s]. It differs by seed: a few seeds have early and late failures."""
    nominal = FlightPlan(mission=MAPPING, world="courtyard", seed=seed, condition=Condition.NONE)
    share = FIRST + (LAST - FIRST) * (GOLDEN * seed % 1.0)
    return round(share * way_time(planned_way(nominal.site(), MAPPING)), 1)


def _plan(mission: str, seed: int, policy: Policy) -> FlightPlan:
    """Plan of one flight: the camera fails for good, or the link is critical behind the building, as in the demo."""
    at = camera_fails_at(seed) if mission == MAPPING and policy.fails else None
    story = make_story(mission, seed, fault=policy.fails, fault_at=at, scenario=None)
    happens: dict[str, Any] = {name: value for name, value in story.robot.items() if name in ("faults", "link")}
    return FlightPlan(
        mission=mission,
        world=story.world,
        seed=seed,
        condition=Condition.NONE,
        happens=happens,
        alternative=bool(policy.instead),
        options={"instead": policy.instead} if policy.instead else {},
        label=policy.label,
    )
