"""Sentences about a command's link: one when it is lost, one when it is back, and none in between."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from skillwing.m600.robot import ROBOT
from skillwing.services.client.connection import Target
from skillwing.services.terminal.link_monitor import LinkMonitor, unattended_text

ENDPOINT = "tcp/10.0.0.1:7447"


def test_a_lost_link_is_reported_once_with_its_time_and_what_the_robot_does() -> None:
    monitor = LinkMonitor(ENDPOINT, "The drone holds its position.")
    assert monitor.update(connected=True, now=0.0, clock="14:03:00") == ""
    lost = monitor.update(connected=False, now=9.0, clock="14:03:09")
    assert lost == f"{ENDPOINT} has not answered since 14:03:09. The drone holds its position."
    assert monitor.update(connected=False, now=10.0, clock="14:03:10") == ""
    assert monitor.warning == lost


def test_a_link_that_is_back_is_reported_with_the_length() -> None:
    monitor = LinkMonitor(ENDPOINT)
    monitor.update(connected=False, now=9.0, clock="14:03:09")
    assert monitor.update(connected=True, now=21.2, clock="14:03:21") == (
        f"{ENDPOINT} answers again at 14:03:21, after 12 s."
    )
    assert monitor.warning == ""


def test_a_link_that_was_never_there_is_lost_at_the_first_look() -> None:
    assert LinkMonitor(ENDPOINT).update(connected=False, now=0.0, clock="14:03:00") != ""


@given(st.lists(st.booleans(), max_size=50))
def test_each_change_has_one_sentence_and_the_warning_stands_while_the_link_is_away(looks: list[bool]) -> None:
    monitor, before = LinkMonitor(ENDPOINT), True
    for second, connected in enumerate(looks):
        said = monitor.update(connected=connected, now=float(second), clock=f"{second}")
        assert bool(said) == (connected != before)
        assert bool(monitor.warning) == (not connected)
        before = connected


def test_the_m600_says_what_it_does_without_goals() -> None:
    target = Target("m600", ENDPOINT, ROBOT.skillset, ROBOT.clock, without_goals=ROBOT.without_goals)
    assert unattended_text(target) == (
        "A mission on board goes on. A drone that no goal commands holds its position for 30 s, then it lands."
    )
