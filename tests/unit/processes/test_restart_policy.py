"""Number and delays of restarts."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from skillwing.services.processes.restart_policy import (
    EXITS_IN_A_ROW,
    FIRST_PAUSE,
    LONG_LIFE,
    LONGEST_PAUSE,
    RestartPolicy,
)


def pauses(policy: RestartPolicy, lives: list[float]) -> list[float | None]:
    """Decisions of the policy after each of these lives, until it gives up."""
    found: list[float | None] = []
    now = 0.0
    for life in lives:
        found.append(policy.exited(now + life, now))
        if found[-1] is None:
            break
        now += life + found[-1]
    return found


def test_the_pause_doubles_and_the_fifth_death_in_a_row_is_the_last() -> None:
    policy = RestartPolicy()
    assert pauses(policy, [1.0] * 9) == pytest.approx([0.2, 0.4, 0.8, 1.6, None])
    assert policy.exits == EXITS_IN_A_ROW
    assert policy.span == pytest.approx(4.0 + 0.2 + 0.4 + 0.8 + 1.6)


def test_the_pause_has_an_upper_bound() -> None:
    found = pauses(RestartPolicy(exits_in_a_row=100), [0.0] * 10)
    assert found[-3:] == [LONGEST_PAUSE] * 3
    assert found[4] == pytest.approx(3.2)


def test_a_long_life_starts_a_new_row() -> None:
    assert pauses(RestartPolicy(), [1.0] * 4 + [LONG_LIFE, 1.0]) == pytest.approx([0.2, 0.4, 0.8, 1.6, 0.2, 0.4])


def test_an_end_that_somebody_asked_for_starts_a_new_row() -> None:
    policy = RestartPolicy()
    assert [policy.exited(float(now), now - 1.0, told=True) for now in range(9)] == [FIRST_PAUSE] * 9
    assert RestartPolicy("never").exited(1.0, 0.0, told=True) is None


def test_what_must_not_be_restarted_is_given_up_at_once() -> None:
    assert pauses(RestartPolicy("never"), [100.0]) == [None]


def test_what_says_that_it_would_fail_again_is_given_up_at_once() -> None:
    assert RestartPolicy().exited(1.0, 0.0, hopeless=True) is None


# What is as long as a long life but for the rounding of a sum may count as either.
lives_of_a_process = st.floats(0.0, 100.0).filter(lambda life: abs(life - LONG_LIFE) > 1e-6)


@given(st.lists(lives_of_a_process, max_size=40))
def test_whatever_the_lives_a_row_is_bounded_and_its_pauses_grow(lives: list[float]) -> None:
    found = pauses(RestartPolicy(), lives)
    row = 0
    for life, pause in zip(lives, found, strict=False):
        row = 1 if life >= LONG_LIFE else row + 1
        assert (pause is None) == (row == EXITS_IN_A_ROW)
        assert pause is None or pause == pytest.approx(min(LONGEST_PAUSE, FIRST_PAUSE * 2 ** (row - 1)))
