"""The manager of `land`."""

from __future__ import annotations

from typing import Any

import pytest
from drone import Drone

from skillwing.m600.skills.land import ASIDES, PATIENCE, STALLED_AFTER, SUBJECT, LandManager
from skillwing.onboard.topics.guidance import FlyTo
from skillwing.services.testing import GoalUnderTest


@pytest.fixture
def drone() -> Drone:
    return Drone(LandManager, height=5.0)


def test_has_landed_when_the_rotors_are_off(drone: Drone) -> None:
    drone.layer.rotors_run_on = True
    goal = drone.start(speed=1.0)
    drone.run(6.0)
    assert drone.layer.on_ground
    goal.assert_running()
    drone.layer.rotors_run_on = False
    goal.assert_ended("S_LANDED", within=1.0)
    drone.assert_states(flight_status="ON_GROUND")


def test_is_blocked_when_it_does_not_come_down(drone: Drone) -> None:
    goal = drone.start(speed=1.0)
    drone.run(2.0)
    drone.layer.stuck = True
    goal.assert_ended("S_BLOCKED", within=STALLED_AFTER + 1.0, reason="the drone has not descended for 10 s")
    assert drone.layer.motions[-1] == "Stop"


def test_waits_for_an_autopilot_that_is_slow_to_notice_that_the_drone_stands(drone: Drone) -> None:
    goal = drone.start(speed=1.0)
    drone.run(2.0)
    drone.layer.stuck = True
    drone.run(8.0)
    goal.assert_running()
    drone.layer.stuck = False
    goal.assert_ended("S_LANDED")


def test_fails_with_guidances_words_when_guidance_gives_up(drone: Drone) -> None:
    drone.layer.aborts = True
    drone.start().assert_ended("ERROR", reason="gave up")


def test_a_second_landing_has_its_own_patience(drone: Drone) -> None:
    goal = drone.start(speed=0.5)
    drone.run(2.0)
    goal.interrupt().assert_ended("IT")
    drone.run(10.0)
    drone.start(speed=0.5).assert_ended("S_LANDED")


def test_on_the_ground_it_is_not_ready() -> None:
    Drone(LandManager).start().assert_ended("NR", failing=["flying"])


# --- where to ---------------------------------------------------------------------------------------------------------

LANDS_ALL_THE_SAME = "TAKEN", "taken, but the drone goes aside no more"


def facts_about_the_place(drone: Drone) -> list[tuple[str, str]]:
    return [(record.after, record.text) for record in drone.history.records if record.subject == SUBJECT]


def start_towards_what_is_blocked(drone: Drone) -> GoalUnderTest[Any, Any]:
    """The place to land is 3 m away, and the way there ends after one."""
    drone.layer.landing_place = (3.0, 0.0, 5.0)
    drone.layer.blocked_at = 1.0
    return drone.start(speed=2.0)


def test_lands_where_it_is_if_nobody_knows_better(drone: Drone) -> None:
    drone.start(speed=2.0).assert_ended("S_LANDED")
    assert drone.layer.motions == ["Land", "Stop"]
    assert drone.layer.position[:2] == (0.0, 0.0)
    assert facts_about_the_place(drone) == []


def test_lands_on_what_stands_below_if_no_better_place_is_known_and_says_so(drone: Drone) -> None:
    drone.layer.taken = True
    drone.start(speed=2.0).assert_ended("S_LANDED")
    assert drone.layer.motions == ["Land", "Stop"]
    assert facts_about_the_place(drone) == [("TAKEN", "taken")]


def test_lands_beside_what_stands_below(drone: Drone) -> None:
    drone.layer.landing_place = (3.0, 1.0, 5.0)
    drone.start(speed=2.0).assert_ended("S_LANDED")
    assert drone.layer.motions == ["FlyTo", "Land", "Stop"]
    assert drone.layer.position[:2] == (3.0, 1.0)
    assert facts_about_the_place(drone) == [("TAKEN", "taken")]


def test_asks_again_where_it_is_blocked_on_the_way(drone: Drone) -> None:
    goal = start_towards_what_is_blocked(drone)
    drone.run(1.0)
    drone.layer.landing_place = (0.0, 2.0, 5.0)
    drone.layer.blocked_at = None
    goal.assert_ended("S_LANDED")
    assert drone.layer.motions == ["FlyTo", "FlyTo", "Land", "Stop"]
    assert drone.layer.position[:2] == (0.0, 2.0)


def test_asks_no_further_than_a_few_times(drone: Drone) -> None:
    goal = start_towards_what_is_blocked(drone)
    drone.run(3.0)
    drone.layer.blocked_at = None
    goal.assert_ended("S_LANDED")
    assert drone.layer.motions == [*["FlyTo"] * ASIDES, "Land", "Stop"]
    assert facts_about_the_place(drone) == [("TAKEN", "taken")] * ASIDES + [LANDS_ALL_THE_SAME]


def test_stopped_over_free_ground_it_reports_nothing_below(drone: Drone) -> None:
    goal = start_towards_what_is_blocked(drone)
    drone.run(1.0)
    drone.layer.landing_place = (0.0, 2.0, 5.0)
    drone.run(2.0)
    drone.layer.landing_place = None
    drone.run(2.0)
    drone.layer.blocked_at = None
    goal.assert_ended("S_LANDED")
    assert drone.layer.motions == [*["FlyTo"] * ASIDES, "Land", "Stop"]
    assert facts_about_the_place(drone) == [("TAKEN", "taken")] * ASIDES


def test_lands_where_it_is_if_guidance_does_not_fly_to_the_place(drone: Drone) -> None:
    drone.layer.landing_place = (3.0, 0.0, 5.0)
    drone.layer.refuses = FlyTo
    drone.start(speed=2.0).assert_ended("S_LANDED")
    assert drone.layer.motions == ["FlyTo", "Land", "Stop"]
    assert drone.layer.position[:2] == (0.0, 0.0)
    assert facts_about_the_place(drone) == [("TAKEN", "taken"), LANDS_ALL_THE_SAME]


def test_lands_where_it_is_if_nobody_answers(drone: Drone) -> None:
    drone.layer.landing_place = (3.0, 0.0, 5.0)
    drone.layer.deaf = 1
    drone.start(speed=2.0).assert_ended("S_LANDED", within=PATIENCE + 5.0)
    assert drone.layer.motions == ["Land", "Stop"]


@pytest.mark.parametrize("after", [0.0, 0.5, 3.0])
def test_an_interrupted_landing_goes_no_further(drone: Drone, after: float) -> None:
    drone.layer.landing_place = (2.0, 0.0, 5.0)
    goal = drone.start(speed=0.5)
    drone.run(after)
    goal.interrupt().assert_ended("IT")
    motions = list(drone.layer.motions)
    drone.run(3.0)
    assert drone.layer.motions == motions
    assert not drone.layer.on_ground
