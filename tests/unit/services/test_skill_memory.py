"""Memory of a skill manager for finished goals."""

from __future__ import annotations

import pytest
from skill_desk import Desk

from skillwing.services.core.bounded_dict import GOALS_REMEMBERED, BoundedDict
from skillwing.services.core.refusal import RefusedError
from skillwing.services.protocol import State


def test_memory_stays_bounded() -> None:
    desk = Desk()
    for number in range(3 * GOALS_REMEMBERED):
        with pytest.raises(RefusedError):
            desk.interrupt(f"unknown{number}")
        desk.start(f"bad{number}", inputs={"speed": 9.0})
        desk.outcome_committed()
    with pytest.raises(RefusedError):
        desk.core.status("bad0")
    desk.core.status(f"bad{3 * GOALS_REMEMBERED - 1}")


def test_what_was_written_last_is_remembered_longest() -> None:
    memory: BoundedDict[str, int] = BoundedDict(3)
    for key in ("a", "b", "c"):
        memory[key] = 1
    assert len(memory) == 3, "as many as there is room for"
    memory["a"] = 2
    assert memory.newest() == 2
    memory["d"] = 3
    assert [memory.get(key) for key in ("a", "b", "c", "d")] == [2, None, 1, 3]
    assert memory.pop("d") == 3
    assert memory.pop("d") is None
    assert "d" not in memory


def test_an_interrupt_that_came_early_ends_one_goal_and_is_forgotten() -> None:
    desk = Desk()
    for _ in range(2):
        with pytest.raises(RefusedError):
            desk.interrupt()
    desk.start()
    desk.outcome_committed()
    for number in range(GOALS_REMEMBERED):
        desk.start(f"bad{number}", inputs={"speed": 9.0})
        desk.outcome_committed()
    with pytest.raises(RefusedError):
        desk.core.status("g")
    desk.start()
    assert desk.state is State.VALIDATING
    assert desk.core.current is not None
