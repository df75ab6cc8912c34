"""Command authority: fresh, stale and revoked tokens, and a bounded memory of revocations."""

from __future__ import annotations

import pytest

from skillwing.onboard.commands.authority import REMEMBERED, CommandAuthority
from skillwing.onboard.commands.service import CommandRefusedError


def test_a_revoked_goal_is_refused_and_others_are_not() -> None:
    axis = CommandAuthority("body axes")
    axis.take("a", 10)
    assert axis.revoke("a", 10)
    axis.require_fresh("b", 10)
    with pytest.raises(CommandRefusedError, match="revoked"):
        axis.require_fresh("a", 10)


def test_what_a_newer_token_makes_stale_is_forgotten_and_still_refused() -> None:
    axis = CommandAuthority("body axes")
    for token in range(50):
        axis.take(f"goal-{token}", token)
        axis.revoke(f"goal-{token}", token)
    assert len(axis._revoked) <= 1
    for token in range(50):
        with pytest.raises(CommandRefusedError):
            axis.require_fresh(f"goal-{token}", token)


def test_revocations_of_goals_that_never_took_it_do_not_pile_up() -> None:
    axis = CommandAuthority("body axes")
    for token in range(10 * REMEMBERED):
        axis.revoke(f"goal-{token}", token)
    assert len(axis._revoked) == REMEMBERED
    with pytest.raises(CommandRefusedError):
        axis.require_fresh(f"goal-{10 * REMEMBERED - 1}", 10 * REMEMBERED - 1)
