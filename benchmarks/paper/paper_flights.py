"""The flights behind docs/results.md: both scenarios of the paper, nominal, failing, and with other answers to that."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from skillwing.evaluation.demo.story import INSPECTION, MAPPING, tell
from skillwing.evaluation.flights.conditions import Condition
from skillwing.evaluation.flights.plan import FlightPlan, planned_way, way_time

FIRST, LAST = 0.3125, 1.4375
"""Limits of the camera's failure, as shares of the route's time at cruise speed.

Turns, detours, take-off and return are not part of that time."""
GOLDEN = 0.6180339887498949
"""Multiples of it, without their whole part, spread evenly however many there are."""


@dataclass(frozen=True, slots=True)
class Policy:
    """A reaction to the failure. label: of its flights. instead: option of the alternative mission, empty for the
    library's mission. fails: False for the nominal flight. words: in the tables.
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
"""By mission; the nominal one first, for the others are compared with it."""


def paper_plans(seeds: range) -> list[FlightPlan]:
    """Seed by seed, so that one that is cut short has flown all policies alike."""
    return [_plan(mission, seed, policy) for seed in seeds for mission in POLICIES for policy in POLICIES[mission]]


def camera_fails_at(seed: int) -> float:
    """Robot seconds: another moment for each seed, such that a few seeds already have early and late ones."""
    nominal = FlightPlan(mission=MAPPING, world="courtyard", seed=seed, condition=Condition.NONE)
    share = FIRST + (LAST - FIRST) * (GOLDEN * seed % 1.0)
    return round(share * way_time(planned_way(nominal.site(), MAPPING)), 1)


def _plan(mission: str, seed: int, policy: Policy) -> FlightPlan:
    """The camera goes black for good, or the link is critical behind the building, as in the demo."""
    at = camera_fails_at(seed) if mission == MAPPING and policy.fails else None
    story = tell(mission, seed, fault=policy.fails, fault_at=at, scenario=None)
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
