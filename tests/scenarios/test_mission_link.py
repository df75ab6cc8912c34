"""A mission on the ground whose own link is away: within its grace it waits, and its goals go on."""

from __future__ import annotations

from typing import cast

import pytest
from flights import AWAY, BACK, Flight
from hypothesis import given
from hypothesis import strategies as st

from faulty_network import FaultyNetwork
from law_settings import examples
from skillwing.bt_missions.running.link_wait import RECOVERY, WITHOUT_GRACE, Link, LinkPatience
from skillwing.bt_missions.running.mission_run import SETTLE_TIMEOUT
from skillwing.services.bus.inprocess import InProcessBus
from skillwing.services.names import MISSION
from skillwing.services.protocol import MissionPhase

GRACE = 20.0
CRUISE = 8.0
"""Time at which the drone flies to its first waypoint [s]."""


class CutFlight:
    """A flight whose mission is cut off at a time, for so many seconds or for good."""

    def __init__(self, grace: float, at: float, seconds: float | None = None, seed: int = 0, **options: float) -> None:
        network = FaultyNetwork(seed)
        self.flight = Flight(owner_grace=grace, network=network, **options)
        mission = cast(InProcessBus, self.flight.buses[MISSION])
        self.flight.at(at, lambda: network.cut(mission))
        if seconds is not None:
            self.flight.at(at + seconds, lambda: network.reconnect(mission))


def test_a_mission_with_grace_succeeds_through_a_cut_that_heals_in_time() -> None:
    cut = CutFlight(GRACE, CRUISE, 10.0)
    status = cut.flight.fly()
    assert status.phase is MissionPhase.SUCCEEDED, status
    assert "IT" not in cut.flight.ends("goto_straight")


def test_a_mission_without_grace_loses_its_goals_to_the_same_cut() -> None:
    cut = CutFlight(0.0, CRUISE, 10.0)
    status = cut.flight.fly()
    assert status.phase is MissionPhase.FAILED
    assert "IT" in cut.flight.ends("goto_straight")


def test_goals_end_when_the_grace_is_over_and_the_mission_says_why() -> None:
    cut = CutFlight(5.0, CRUISE)
    flight = cut.flight
    flight.until(lambda: flight.node.over, 30.0)
    assert flight.node.status.phase is MissionPhase.FAILED
    assert flight.node.status.text == "the link to the robot was away for 5 s"
    flight.network.run_for(15.0)
    assert all(goal.terminal is not None for goal in flight.goals.values())
    [reason] = {goal.terminal.reason for goal in flight.goals.values() if goal.terminal and goal.terminal.label == "IT"}
    assert reason.endswith("is gone, and has not come back within 5 s.")


@pytest.mark.parametrize("aborted", [False, True])
def test_without_a_grace_a_mission_ends_although_its_link_never_returns(aborted: bool) -> None:
    """An abort is not answered either, and cannot be carried out."""
    cut = CutFlight(0.0, CRUISE)
    flight = cut.flight
    if aborted:
        flight.at(CRUISE + 10.0, lambda: flight.node.abort("a test"))
    flight.until(lambda: flight.node.over, CRUISE + WITHOUT_GRACE + 10.0)
    phase = MissionPhase.ABORTED if aborted else MissionPhase.FAILED
    assert flight.node.status.phase is phase
    assert flight.node.status.text.startswith("the link to the robot was away for 60 s")


def test_a_drone_that_the_pilot_gives_back_during_a_cut_is_landed() -> None:
    patience = 5.0
    cut = CutFlight(30.0, CRUISE + patience + 0.5, SETTLE_TIMEOUT + 5.0, pilot_patience=patience)
    flight = cut.flight
    flight.at(CRUISE, lambda: flight.drone.freeze("lidar_mapping"))
    flight.at(CRUISE, lambda: flight.drone.set(*AWAY))
    flight.at(CRUISE + patience + 2.0, lambda: flight.drone.set(*BACK))
    assert flight.fly().phase is MissionPhase.FAILED
    assert flight.on_ground, flight.node.status.text


def test_goals_have_their_time_to_stop_after_a_cut_too() -> None:
    cut = CutFlight(30.0, CRUISE + 1.0, SETTLE_TIMEOUT + 5.0)
    flight = cut.flight
    flight.at(CRUISE, lambda: flight.drone.freeze("lidar_mapping"))
    flight.at(CRUISE + 0.9, lambda: flight.node.abort("a test"))
    status = flight.fly()
    assert status.phase is MissionPhase.ABORTED
    assert "did not stop" not in status.text


@given(at=st.floats(2.0, 30.0), seconds=st.floats(0.1, GRACE - 1.0), seed=st.integers(0, 999))
@examples(5)
def test_no_goal_is_interrupted_within_the_grace(at: float, seconds: float, seed: int) -> None:
    cut = CutFlight(GRACE, at, seconds, seed)
    assert cut.flight.fly().phase is MissionPhase.SUCCEEDED
    assert not [
        goal for goal in cut.flight.goals.values() if "Its owner" in (goal.terminal.reason if goal.terminal else "")
    ]


# --- the judgement of the link ---------------------------------------------------------------------------------------


def test_without_a_grace_a_mission_does_not_wait_and_ends_after_a_minute() -> None:
    patience = LinkPatience(0.0)
    assert [patience.look(connected=False, now=t) for t in (0.0, 59.9)] == [Link.UP, Link.UP]
    assert patience.look(connected=True, now=59.95) is Link.UP
    assert [patience.look(connected=False, now=t) for t in (100.0, 159.9, 160.0)] == [Link.UP, Link.UP, Link.OVER]


def test_a_link_that_is_back_is_up_after_the_recovery() -> None:
    patience = LinkPatience(GRACE)
    assert patience.look(connected=False, now=0.0) is Link.AWAY
    assert patience.look(connected=True, now=5.0) is Link.AWAY
    assert patience.look(connected=True, now=5.0 + RECOVERY) is Link.UP


@given(st.lists(st.tuples(st.booleans(), st.floats(0.05, 2.0)), max_size=60))
def test_a_link_is_over_exactly_after_a_whole_grace_without_it(looks: list[tuple[bool, float]]) -> None:
    """Each absence counts from its own begin, but a return that is shorter than the recovery does not end one."""
    patience, now, lost_at, back_at = LinkPatience(5.0), 0.0, None, None
    for connected, pause in looks:
        now += pause
        state = patience.look(connected=connected, now=now)
        if connected:
            back_at = now if back_at is None else back_at
            if lost_at is not None and now - back_at >= RECOVERY:
                lost_at = None
        else:
            back_at, lost_at = None, now if lost_at is None else lost_at
        assert (state is Link.OVER) == (not connected and lost_at is not None and now - lost_at >= 5.0)
        assert (state is Link.UP) == (lost_at is None)


@pytest.mark.parametrize("seconds", [0.5, 1.5])
def test_a_cut_shorter_than_the_lease_goes_unnoticed(seconds: float) -> None:
    assert CutFlight(0.0, CRUISE, seconds).flight.fly().phase is MissionPhase.SUCCEEDED
