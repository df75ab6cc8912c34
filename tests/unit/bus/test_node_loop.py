"""The loop of a node: messages before timers, a clock for each robot or one for all, and silence after the end."""

from __future__ import annotations

import time

import pytest

from skillwing.services.bus.clock import FollowedClock, PacedClock, WallClock
from skillwing.services.bus.node_loop import NodeLoop, NodeTime


def looped(*times: NodeTime) -> NodeLoop:
    loop = NodeLoop()
    for each in times:
        loop.add(each)
    return loop


def test_messages_run_in_their_order_and_before_timers() -> None:
    node_time = NodeTime(PacedClock(0.0))
    loop, seen = looped(node_time), []
    node_time.robot_agenda.add(0.0, lambda: seen.append("timer"))
    for number in (1, 2):
        loop.post(lambda number=number: seen.append(number))
    assert loop.run_until(lambda: len(seen) == 3)
    assert seen == [1, 2, "timer"]


def test_each_time_has_its_own_timers() -> None:
    """The first robot's time stands still, which does not stop the second robot's."""
    standing, running = NodeTime(FollowedClock()), NodeTime(PacedClock(0.0))
    loop, seen = looped(standing, running), []
    standing.robot_agenda.add(1.0, lambda: seen.append("standing"))
    for due in (1.0, 2.0):
        running.robot_agenda.add(due, lambda due=due: seen.append(due))
    assert loop.run_until(lambda: len(seen) == 2)
    assert seen == [1.0, 2.0]


def test_a_removed_time_runs_no_timer_even_in_the_same_turn() -> None:
    first, second = NodeTime(PacedClock(0.0)), NodeTime(PacedClock(0.0))
    loop, seen = looped(first, second), []
    first.robot_agenda.add(0.0, lambda: loop.remove(second))
    second.robot_agenda.add(0.0, lambda: seen.append("second"))
    first.robot_agenda.add(1.0, lambda: seen.append("first"))
    assert loop.run_until(lambda: bool(seen))
    assert seen == ["first"]


def test_a_closed_loop_leaves_what_waits() -> None:
    node_time = NodeTime(PacedClock(0.0))
    loop, seen = looped(node_time), []
    node_time.robot_agenda.add(0.0, lambda: seen.append("timer"))
    loop.post(loop.close)
    loop.post(lambda: seen.append("message"))
    assert not loop.run_until(lambda: False)
    assert not seen


def test_the_acknowledgement_follows_the_timers_and_is_given_once() -> None:
    node_time = NodeTime(PacedClock(0.0))
    loop, seen = looped(node_time), []
    node_time.acknowledge = lambda: seen.append("done")
    for due in (1.0, 2.0):
        node_time.robot_agenda.add(due, lambda due=due: seen.append(due))
    assert loop.run_until(lambda: len(seen) == 3)
    assert seen == [1.0, 2.0, "done"]
    node_time.wall_agenda.add(time.monotonic(), lambda: seen.append("later"))
    assert loop.run_until(lambda: len(seen) == 4)
    assert seen[-1] == "later"


def test_a_node_wakes_for_a_tick_only_if_it_waits_for_that_time() -> None:
    clock = FollowedClock()
    node_time = NodeTime(clock)
    assert not node_time.wakes_for(clock)
    node_time.robot_agenda.add(5.0, lambda: None)
    assert node_time.patience() is None
    clock.tick(1.0, 1.0, time.monotonic())
    assert not node_time.wakes_for(clock)
    clock.tick(5.0, 1.0, time.monotonic())
    assert node_time.wakes_for(clock)


def test_a_callback_cannot_wait() -> None:
    loop = looped(NodeTime(WallClock()))

    def wait() -> None:
        loop.run_until(lambda: True)

    loop.post(wait)
    with pytest.raises(RuntimeError, match="must not wait"):
        loop.run_until(lambda: False)
