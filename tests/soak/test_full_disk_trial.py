"""The trial of full disks itself, with one short outage, and its table. `make full-disk` runs it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from full_disk_figures import MissionOutage, Outage, table
from full_disk_judge import AFTER_RETURN, NOTICED_WITHIN, EndedGoal, Kill, failure_sentences, missing_sentences
from full_disk_mocks import MockedSystem

from skillwing.services.history.recording_state import Gap
from skillwing.services.protocol import Ending
from small_disk import mounted, obstacle


def test_an_outage_in_which_the_resource_manager_is_killed_is_over_with_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if (reason := obstacle()) is not None:
        pytest.skip(reason)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    with mounted(tmp_path / "disk", 64 << 20) as disk, MockedSystem(disk, tmp_path) as system:
        system.work(1.0)
        outage = system.suffer(8.0, "resource_manager", 1.0)
        assert outage.problems == [], outage
        assert min(outage.goals, outage.unrecorded, outage.lost) > 0
        assert system.end() == []


def test_a_broken_promise_stands_out_in_the_table() -> None:
    outage = Outage(seconds=60.0, killed="recorder", goals=500, unrecorded=480, lost=7000, back=0.4)
    flight = MissionOutage(begin=31.0, seconds=60.0, code=0, result="success", missing=["Much."], same=True)
    text = table([outage], flight)
    assert "| recorder | 60 | 500 | 0 | 480 | 7000 | 0.4 s |" in text
    assert "full for 60 s from 31 s on" in text
    assert "Its report says: Much." in text
    assert "**" not in text
    outage.back, outage.problems = None, ["No goal ended."]
    assert "| **never** **No goal ended.** |" in table([outage], None)


MANAGER_KILL = Kill(process="resource_manager", at=100.0, back=110.0)
TAKEN = "`belt_north == FREE` does not hold: belt_north is TAKEN."


def goal(t: float, ending: str = "S", skill: str = "north", **fields: Any) -> EndedGoal:
    return EndedGoal(skill=skill, t=t, success=ending == "S", ending=ending, **fields)


@pytest.mark.parametrize("ending", [Ending.ERROR, Ending.NOT_READY])
def test_goals_may_fail_while_the_resource_manager_is_away_and_shortly_after(ending: str) -> None:
    for t in (100.0, 106.0, 110.0 + AFTER_RETURN):
        assert failure_sentences([goal(t, ending)], MANAGER_KILL) == []
    for t in (99.0, 110.1 + AFTER_RETURN):
        assert failure_sentences([goal(t, ending)], MANAGER_KILL) != []
        assert failure_sentences([goal(106.0, ending)], None) != []


def test_a_killed_skill_loses_its_own_goals_only() -> None:
    kill = Kill(process="skill/north", at=100.0, back=103.0)
    assert failure_sentences([goal(101.0, Ending.LOST)], kill) == []
    assert failure_sentences([goal(101.0, Ending.LOST, "south")], kill) != []
    assert failure_sentences([goal(101.0, Ending.ERROR)], kill) != []
    never_back = Kill(process="skill/north", at=100.0, back=None)
    assert failure_sentences([goal(101.0, Ending.LOST)], never_back) != []


def test_failed_goals_of_one_kind_are_one_sentence() -> None:
    late = [goal(130.0, Ending.NOT_READY, reason=TAKEN), goal(131.0, Ending.NOT_READY, reason=TAKEN)]
    assert failure_sentences(late, MANAGER_KILL) == [f"2 goals of north ended with NR, 30.0 s after the kill: {TAKEN}"]
    assert failure_sentences([goal(3.0, Ending.LOST)], None) == ["A goal of north ended with LOST."]


def test_a_goal_may_be_missing_only_at_the_time_of_a_gap_that_names_enough_lines() -> None:
    gaps = [Gap(begin=100.0, end=160.0, lost={"goals.jsonl": 2, "timeline.jsonl": 900})]
    inside = [goal(100.0 - NOTICED_WITHIN, recorded=False), goal(160.0, recorded=False)]
    assert missing_sentences([*inside, goal(20.0), goal(300.0)], gaps) == []
    [time] = missing_sentences([goal(161.0, recorded=False)], gaps)
    assert time == "1 goals that ended from 161.0 s to 161.0 s are missing, and no gap has that time."
    [lines] = missing_sentences([*inside, goal(120.0, recorded=False)], gaps)
    assert lines == "3 goals are missing, and the gaps name 2 lines of `goals.jsonl`."
    assert len(missing_sentences(inside, [])) == 2
