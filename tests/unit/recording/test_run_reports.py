"""Flown missions, and a history cut to one of them."""

from __future__ import annotations

import math

import pytest
from synthetic_mission import MISSION, SKILLSET, tell

from skillwing.services.history.history import History
from skillwing.services.history.mission_intervals import MissionInterval, mission_intervals
from skillwing.services.history.report import make_report
from skillwing.services.protocol import MissionPhase, Record, RecordKind


def phase(t: float, mission: str, before: str, after: str, writer: str = "") -> Record:
    text = f"{writer or mission}#{t}"
    return Record(id=text, t=t, source="mission", kind=RecordKind.MISSION, subject=mission, before=before, after=after)


def test_missions_come_one_after_the_other() -> None:
    records = [
        phase(1.0, "mapping", "IDLE", "RUNNING"),
        phase(2.0, "branch", "ZED", "LiDAR"),
        phase(3.0, "mapping", "RUNNING", "HELD"),
        phase(4.0, "mapping", "HELD", "RUNNING"),
        phase(9.0, "mapping", "RUNNING", "SUCCEEDED"),
        phase(12.0, "mapping", "IDLE", "RUNNING"),
        phase(15.0, "mapping", "RUNNING", "ABORTED"),
        phase(20.0, "patrol", "IDLE", "RUNNING"),
    ]
    assert mission_intervals(records) == (
        MissionInterval(1, "mapping", 1.0, 9.0, MissionPhase.SUCCEEDED),
        MissionInterval(2, "mapping", 12.0, 15.0, MissionPhase.ABORTED),
        MissionInterval(3, "patrol", 20.0, None),
    )


@pytest.mark.parametrize("second", ["mapping", "patrol"])
def test_a_mission_that_was_killed_is_over_just_before_the_next_one_begins(second: str) -> None:
    records = [phase(1.0, "mapping", "IDLE", "RUNNING"), phase(5.0, second, "IDLE", "RUNNING")]
    first, following = mission_intervals(records)
    assert first == MissionInterval(1, "mapping", 1.0, math.nextafter(5.0, 0.0))
    assert following == MissionInterval(2, second, 5.0, None)


def test_a_mission_that_never_began_has_an_end() -> None:
    never_begun = MissionInterval(1, "mapping", 30.0, 30.0, MissionPhase.FAILED)
    assert mission_intervals([phase(30.0, "mapping", "IDLE", "FAILED")]) == (never_begun,)


@pytest.mark.parametrize("second", ["lefty", "righty"])
def test_missions_at_a_shared_robot_run_beside_each_other(second: str) -> None:
    records = [
        phase(1.0, "lefty", "IDLE", "RUNNING", "cli-1~a"),
        phase(2.0, second, "IDLE", "RUNNING", "cli-2~b"),
        phase(3.0, "lefty", "RUNNING", "PAUSED", "cli-1~a"),
        phase(8.0, "lefty", "RUNNING", "SUCCEEDED", "cli-1~a"),
        phase(9.0, second, "RUNNING", "FAILED", "cli-2~b"),
    ]
    assert mission_intervals(records) == (
        MissionInterval(1, "lefty", 1.0, 8.0, MissionPhase.SUCCEEDED),
        MissionInterval(2, second, 2.0, 9.0, MissionPhase.FAILED),
    )


def test_a_mission_that_is_killed_after_the_next_began_is_over_before_the_one_after_that() -> None:
    records = [
        phase(1.0, "lefty", "IDLE", "RUNNING", "cli-1~a"),
        phase(2.0, "righty", "IDLE", "RUNNING", "cli-2~b"),
        phase(3.0, "lefty", "RUNNING", "PAUSED", "cli-1~a"),
        phase(5.0, "righty", "RUNNING", "SUCCEEDED", "cli-2~b"),
        phase(6.0, "lefty", "IDLE", "RUNNING", "cli-3~c"),
        phase(7.0, "lefty", "RUNNING", "FAILED", "cli-3~c"),
    ]
    assert mission_intervals(records) == (
        MissionInterval(1, "lefty", 1.0, math.nextafter(6.0, 0.0)),
        MissionInterval(2, "righty", 2.0, 5.0, MissionPhase.SUCCEEDED),
        MissionInterval(3, "lefty", 6.0, 7.0, MissionPhase.FAILED),
    )


def test_a_report_has_the_end_of_its_own_mission_also_beside_one_of_the_same_name() -> None:
    records = [
        phase(1.0, "lefty", "IDLE", "RUNNING", "cli-1~a"),
        phase(2.0, "lefty", "IDLE", "RUNNING", "cli-2~b"),
        phase(5.0, "lefty", "RUNNING", "FAILED", "cli-1~a"),
        phase(9.0, "lefty", "RUNNING", "SUCCEEDED", "cli-2~b"),
    ]
    history = History.of(records, [], SKILLSET)
    reports = [
        make_report(history.part(each.begin, each.end or math.inf), mission=each.mission, phases=each.records)
        for each in mission_intervals(records)
    ]
    assert [(each.result, each.sim_time_s) for each in reports] == [("failure", 4.0), ("success", 7.0)]


def test_a_part_of_a_history_counts_from_its_beginning_and_knows_older_causes() -> None:
    story = tell()
    whole = History.of(story.records, story.statuses, SKILLSET)
    part = whole.part(20.0)
    assert part.end == pytest.approx(whole.end - 20.0)
    assert {bar.goal_id for bar in part.bars} == {
        bar.goal_id for bar in whole.bars if bar.t_end is None or bar.t_end >= 20.0
    }
    for name, spans in part.lanes.items():
        now = next(span for span in whole.lanes[name] if span.t_end is None or span.t_end > 20.0)
        assert spans[0].state == now.state
        assert spans[0].t_start == 0.0
    late = whole.part(20.52)
    (switch,) = late.switches
    assert [record.id for record in switch.chain] == [record.id for record in whole.switches[0].chain]
    assert switch.chain[0].t < 0.0 < switch.t


def test_a_report_is_of_its_part_alone() -> None:
    story = tell()
    whole = History.of(story.records, story.statuses, SKILLSET)
    assert make_report(whole.part(0.0), mission=MISSION) == make_report(whole, mission=MISSION)
    early = make_report(whole.part(0.0, 10.0), mission=MISSION)
    assert early.result == "unfinished"
    assert early.sim_time_s <= 10.0
