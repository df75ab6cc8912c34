"""All that concurrent clients see of the real resource manager process could have happened one after the other.

`make history` does the same for longer, with figures.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest
from history_run import record, record_goals
from linearizability import UndecidedError
from sequential_manager import Told
from step_order import Observed, judge_order

from skillwing.services.protocol import Ending, Granted

pytestmark = pytest.mark.slow
MOST_STEPS = 100_000


@pytest.fixture(autouse=True)
def processes_find_this_folder(monkeypatch: pytest.MonkeyPatch) -> None:
    """The untrustworthy managers are made by modules that lie here."""
    inherited = os.environ.get("PYTHONPATH", "")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, [str(Path(__file__).parent), inherited])))


def test_concurrent_clients_see_one_order(tmp_path: Path) -> None:
    recorded = record(tmp_path, seed=1, operations=120)
    assert granted(recorded.history), "nobody was granted anything"
    verdict = recorded.check()
    assert verdict.linearizable, str(verdict)
    order = recorded.check_order()
    assert (order.problems, order.missing_steps) == ([], 0)


def test_also_when_the_manager_is_killed_and_goes_on_from_its_journal(tmp_path: Path) -> None:
    recorded = record(tmp_path, seed=2, operations=120, kills=2)
    verdict = recorded.check()
    assert verdict.linearizable, str(verdict)
    assert recorded.check_order().problems == []


def is_refuted(folder: Path, seed: int, **how: Any) -> bool:
    """Record until a history is refuted, at most five times.

    A kill while nothing is held leaves nothing to forget. Two clients contradict each other as well as four do, with
    more operations. The refutation of four may take exponential time.
    """
    for attempt in range(5):
        run_dir = folder / str(attempt)
        run_dir.mkdir()
        try:
            recorded = record(run_dir, seed=seed + attempt, clients=2, journal=False, **how)
            if not recorded.check(MOST_STEPS).linearizable:
                return True
        except UndecidedError:
            continue
    return False


def test_a_manager_without_a_journal_is_found_to_have_forgotten(tmp_path: Path) -> None:
    assert is_refuted(tmp_path, 3, operations=240, kills=2)


@pytest.mark.parametrize("lie", ["grants_twice", "replies_old_states", "forgets_ends", "forgets_outcomes"])
def test_a_manager_that_lies_is_found_out(tmp_path: Path, lie: str) -> None:
    assert is_refuted(tmp_path, 4, operations=240, factory=f"untrustworthy:make_{lie}")


@pytest.mark.parametrize(
    ("lie", "problem"),
    [
        ("loses_steps", "nobody was killed"),
        ("rewrites_steps", "with different content"),
        ("swaps_steps", "was published after step"),
        ("names_steps_too_early", "A reply has"),
    ],
)
def test_a_manager_whose_steps_are_out_of_order_is_found_out(tmp_path: Path, lie: str, problem: str) -> None:
    recorded = record(tmp_path, seed=5, operations=60, factory=f"untrustworthy:make_{lie}", journal=False)
    assert problem in " ".join(recorded.check_order().problems)


def test_a_manager_that_leaves_out_numbers_after_a_kill_is_found_out(tmp_path: Path) -> None:
    """A step may be missing only if it was stored."""
    recorded = record(tmp_path, seed=6, operations=60, kills=1, factory="untrustworthy:make_skips_numbers")
    assert "records were stored" in " ".join(recorded.check_order().problems)


@pytest.mark.parametrize("kills", [0, 1])
def test_each_status_of_a_real_goal_names_the_step_that_it_follows_from(tmp_path: Path, kills: int) -> None:
    observed = record_goals(tmp_path, seed=1, goals=20, kills=kills)
    assert judge_order(observed, ()).problems == []
    ends = {status.terminal.ending for status in observed.statuses if status.terminal is not None}
    assert ends >= {Ending.SUCCEEDED, Ending.INTERRUPTED, Ending.INVARIANT_VIOLATED}
    assert follows(observed) > 20


def test_a_skill_manager_that_names_earlier_steps_is_found_out(tmp_path: Path) -> None:
    observed = record_goals(tmp_path, seed=8, goals=10, factory="untrustworthy:make_names_earlier_steps")
    assert "Its cause belongs to step" in " ".join(judge_order(observed, ()).problems)


def follows(observed: Observed) -> int:
    """Number of statuses whose cause is in a published step."""
    records = {record.id for step in observed.steps for record in step.records}
    return sum(status.cause in records for status in observed.statuses)


def granted(history: tuple[Told, ...]) -> int:
    return sum(isinstance(told.answer, Granted) for told in history)
