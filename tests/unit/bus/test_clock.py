"""The clocks, against a wall clock that the test moves."""

from __future__ import annotations

import threading

import pytest
from hypothesis import given
from hypothesis import strategies as st

from skillwing.dsl.model import STALE_AFTER_PERIODS
from skillwing.services.bus.clock import (
    LARGEST_ERROR,
    LONGEST_EXTRAPOLATION,
    LONGEST_SILENCE,
    PATIENCE,
    TICK_PATIENCE,
    TICK_PERIOD,
    FollowedClock,
    LockstepClock,
    PacedClock,
    TickRule,
    WallClock,
)


class Wall:
    def __init__(self) -> None:
        self.time = 1000.0

    def __call__(self) -> float:
        return self.time


@pytest.fixture
def wall() -> Wall:
    return Wall()


def test_wall_time_passes_with_the_wall(wall: Wall) -> None:
    clock = WallClock(wall)
    begun = clock.now()
    wall.time += 2.0
    assert clock.now() - begun == pytest.approx(2.0)
    assert clock.seconds_until(begun + 5.0) == pytest.approx(3.0)


def test_before_the_first_tick_time_stands_at_zero_and_nothing_is_due(wall: Wall) -> None:
    clock = FollowedClock(wall)
    wall.time += 10.0
    assert clock.now() == 0.0
    assert not clock.has_started()
    assert clock.seconds_until(0.0) is None


def test_between_ticks_time_runs_on_at_the_owners_factor_but_not_far(wall: Wall) -> None:
    clock = FollowedClock(wall)
    clock.tick(50.0, 2.0, wall())
    wall.time += 0.02
    assert clock.now() == pytest.approx(50.04)
    assert clock.seconds_until(50.06) == pytest.approx(0.01)
    assert clock.seconds_until(50.2) is None
    wall.time += 60.0
    assert clock.now() == pytest.approx(50.0 + LONGEST_EXTRAPOLATION)


def test_followed_time_never_runs_backwards(wall: Wall) -> None:
    clock = FollowedClock(wall)
    clock.tick(50.0, 1.0, wall())
    wall.time += 0.08
    assert clock.now() == pytest.approx(50.08)
    clock.tick(50.02, 1.0, wall())
    assert clock.now() == pytest.approx(50.08)
    wall.time += 0.09
    assert clock.now() == pytest.approx(50.11)


def test_after_a_long_silence_time_is_known_when_ticks_are_up_to_date(
    wall: Wall, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A process that was stopped wakes up. Ticks of before come in a burst; later ones come when it is connected."""
    clock = FollowedClock(wall)
    clock.tick(50.0, 1.0, wall())
    wall.time += 6.0
    monkeypatch.setattr("skillwing.services.bus.clock.TICK_PATIENCE", 60.0)

    def receive() -> None:
        for t, pause in ((50.15, 0.0), (50.3, 0.0), (56.5, 0.5), (56.65, 0.15)):
            wall.time += pause
            clock.tick(t, 1.0, wall())

    threading.Timer(0.01, receive).start()
    clock.catch_up()
    assert clock.now() == pytest.approx(56.65)


@pytest.fixture
def waits(monkeypatch: pytest.MonkeyPatch) -> list[float | None]:
    """Limits of all waiting for ticks, which is in vain."""
    found: list[float | None] = []

    class Silence(threading.Event):
        def wait(self, timeout: float | None = None) -> bool:
            found.append(timeout)
            return False

    monkeypatch.setattr("skillwing.services.bus.clock.Event", Silence)
    return found


def test_nobody_waits_for_ticks_that_come_nor_twice_for_an_owner_that_stands(
    wall: Wall, waits: list[float | None]
) -> None:
    clock = FollowedClock(wall)
    clock.catch_up()
    clock.tick(50.0, 1.0, wall())
    wall.time += LONGEST_SILENCE
    clock.catch_up()
    assert waits == []
    for t in (50.1, 50.5, 50.51):  # an owner on a busy machine
        clock.tick(t, 1.0, wall())
        clock.catch_up()
    assert waits == []
    wall.time += LONGEST_SILENCE + 0.1
    clock.catch_up()
    clock.catch_up()
    assert waits == [TICK_PATIENCE]


@pytest.mark.parametrize("factor", [0.0, 0.1], ids=["as fast as possible", "slower than the wall"])
def test_a_pause_between_ticks_that_belongs_to_the_pace_is_no_silence(
    factor: float, wall: Wall, waits: list[float | None]
) -> None:
    """The owner of a time as fast as possible waits for this very follower."""
    clock = FollowedClock(wall)
    for number in range(4):
        clock.tick(50.0 + number * TICK_PERIOD, factor, wall())
        clock.catch_up()
        wall.time += TICK_PERIOD / (factor or 0.1)
        clock.catch_up()
    assert waits == []


def test_as_fast_as_possible_is_followed_tick_by_tick(wall: Wall) -> None:
    clock = FollowedClock(wall)
    clock.tick(50.0, 0.0, wall())
    wall.time += 1.0
    assert clock.now() == 50.0
    assert clock.seconds_until(50.01) is None
    assert clock.seconds_until(50.0) == 0.0


@pytest.mark.parametrize("factor", [0.0, 1.0])
def test_a_tick_that_comes_while_a_clock_is_asked_changes_nothing_halfway(factor: float) -> None:
    # Ticks arrive on Zenoh's thread at any moment. Here each look at the wall clock brings one.
    def wall() -> float:
        clock.tick(51.0, factor, 0.0)
        return 0.0

    clock = FollowedClock(wall)
    clock.tick(50.0, factor, 0.0)
    assert clock.seconds_until(50.5) is None
    assert clock.seconds_until(50.5) == 0.0


def test_the_owners_time_moves_with_its_timers_only(wall: Wall) -> None:
    clock = PacedClock(2.0, wall)
    assert clock.seconds_until(0.02) == pytest.approx(0.01)
    wall.time += 0.01
    assert clock.seconds_until(0.02) == pytest.approx(0.0)
    assert clock.now() == 0.0
    clock.reach(0.02)
    assert clock.now() == 0.02
    assert clock.seconds_until(0.04) == pytest.approx(0.01)


def test_a_small_lag_is_made_up(wall: Wall) -> None:
    clock = PacedClock(1.0, wall)
    clock.seconds_until(0.02)
    wall.time += 0.05
    clock.reach(0.02)
    assert clock.seconds_until(0.04) == pytest.approx(-0.01)


def test_a_large_lag_is_given_up_rather_than_made_up_in_a_burst(wall: Wall) -> None:
    clock = PacedClock(1.0, wall)
    clock.seconds_until(0.02)
    wall.time += 1.0
    clock.reach(0.02)
    assert clock.seconds_until(0.04) == pytest.approx(0.02)


def test_as_fast_as_possible_never_waits(wall: Wall) -> None:
    clock = PacedClock(0.0, wall)
    for number in range(1, 100):
        assert clock.seconds_until(number * 0.02) == 0.0
        clock.reach(number * 0.02)
        assert clock.now() == number * 0.02


STEP = 0.02


def test_an_owner_that_keeps_its_pace_ticks_once_in_eight_steps(wall: Wall) -> None:
    rule = TickRule(2.0)
    told = [rule.due(number * STEP, wall() + number * STEP / 2.0) for number in range(100)]
    assert told == [number % 8 == 0 for number in range(100)]


def test_the_pace_that_is_kept_lets_followers_run_on_and_a_pause_lets_no_datum_turn_stale() -> None:
    fastest = 0.1
    assert TICK_PERIOD + STEP < LONGEST_EXTRAPOLATION < (STALE_AFTER_PERIODS - 1) * fastest


def test_as_fast_as_possible_every_step_is_due(wall: Wall) -> None:
    rule = TickRule(0.0)
    assert all(rule.due(number * STEP, wall()) for number in range(10))


@given(st.sampled_from([0.5, 1.0, 4.0]), st.lists(st.floats(0.0, 0.5), max_size=60))
def test_whatever_becomes_of_the_pace_followers_are_never_wrong_by_more(factor: float, pauses: list[float]) -> None:
    wall = Wall()
    rule, follower = TickRule(factor), FollowedClock(wall)
    for number, pause in enumerate(pauses):
        wall.time += pause
        before, t = follower.now(), number * STEP
        if rule.due(t, wall()):
            follower.tick(t, factor, wall())
        # What a follower has seen it does not take back: it stands until the owner has caught up.
        assert t - LARGEST_ERROR - 1e-9 <= follower.now() <= max(before, t + LARGEST_ERROR) + 1e-9


STEP = 0.02


def test_in_lockstep_time_waits_until_every_follower_is_done(wall: Wall) -> None:
    clock = LockstepClock(wall)
    assert clock.seconds_until(STEP) == 0.0, "nobody follows yet"
    for follower in ("guidance", "obstacles"):
        clock.done(follower, 0.0, 0.0)
    clock.reach(STEP)
    assert clock.seconds_until(2 * STEP) == PATIENCE
    clock.done("guidance", STEP, 0.0)
    assert clock.seconds_until(2 * STEP) == PATIENCE
    clock.done("obstacles", STEP, 0.0)
    assert clock.seconds_until(2 * STEP) == 0.0


def test_in_lockstep_a_follower_may_lag_by_what_it_says(wall: Wall) -> None:
    clock = LockstepClock(wall)
    clock.done("manager", 0.0, 0.1)
    for step in range(1, 6):
        assert clock.seconds_until(step * STEP) == 0.0
        clock.reach(step * STEP)
    assert clock.seconds_until(6 * STEP) == 0.0
    clock.reach(6 * STEP)
    assert clock.seconds_until(7 * STEP) > 0.0


def test_in_lockstep_a_hung_follower_is_left_behind_until_it_is_heard_of_again(wall: Wall) -> None:
    clock = LockstepClock(wall)
    clock.done("hung", 0.0, 0.0)
    clock.reach(STEP)
    wall.time += PATIENCE / 2
    assert clock.seconds_until(2 * STEP) == pytest.approx(PATIENCE / 2)
    wall.time += PATIENCE / 2
    assert clock.seconds_until(2 * STEP) == 0.0
    clock.reach(2 * STEP)
    assert clock.seconds_until(3 * STEP) == 0.0, "patience is lost once"
    clock.done("hung", STEP, 0.0)
    assert clock.seconds_until(3 * STEP) == PATIENCE


def test_in_lockstep_repetitions_do_not_hold_time(wall: Wall) -> None:
    """A process that sends the same time at 100 Hz costs time its patience once, as a silent one does."""
    clock = LockstepClock(wall)
    clock.done("repeater", 0.0, 0.0)
    step = 0
    end = wall.time + 2 * PATIENCE
    while wall.time < end:
        while step < 1000 and clock.seconds_until((step + 1) * STEP) == 0.0:
            step += 1
            clock.reach(step * STEP)
        wall.time += 0.01
        clock.done("repeater", 0.0, 0.0)
    assert step == 1000


def test_in_lockstep_nobody_waits_for_who_has_gone(wall: Wall) -> None:
    clock = LockstepClock(wall)
    clock.done("mortal", 0.0, 0.0)
    clock.reach(STEP)
    clock.gone("mortal")
    assert clock.seconds_until(2 * STEP) == 0.0
    clock.gone("stranger")


@given(
    st.lists(st.tuples(st.sampled_from("abc"), st.sampled_from([0.0, 0.05, 0.1])), min_size=1, max_size=60),
)
def test_in_lockstep_time_never_runs_ahead_of_anybody(events: list[tuple[str, float]]) -> None:
    wall = Wall()
    clock = LockstepClock(wall)
    done: dict[str, tuple[float, float]] = {}
    step = 0
    for follower, lag in events:
        done[follower] = clock.now(), lag
        clock.done(follower, *done[follower])
        while step < 1000 and clock.seconds_until((step + 1) * STEP) == 0.0:
            step += 1
            clock.reach(step * STEP)
        assert all(clock.now() <= t + allowed + STEP + 1e-6 for t, allowed in done.values())
