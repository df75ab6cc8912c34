"""Extern resources follow the robot by level."""

from __future__ import annotations

from skillwing.m600.bridge.levels import ExternLevels, Level


def test_a_resource_that_stands_elsewhere_is_a_mismatch_until_it_stands_right() -> None:
    levels = ExternLevels()
    levels.want("zed_status", "FAILED", "health#1")
    assert levels.mismatches({"zed_status": "OK"}) == [Level("zed_status", "FAILED", "health#1")]
    assert levels.mismatches({"zed_status": "OK"}) != []
    assert levels.mismatches({"zed_status": "FAILED"}) == []


def test_nothing_is_asked_for_while_the_state_is_unknown() -> None:
    levels = ExternLevels()
    levels.want("zed_status", "FAILED", None)
    assert levels.mismatches({}) == []


def test_the_latest_level_counts() -> None:
    levels = ExternLevels()
    levels.want("zed_status", "FAILED", "health#1")
    levels.want("zed_status", "OK", "health#2")
    assert levels.wanted("zed_status") == "OK"
    assert levels.wanted("lidar_status") is None
    assert levels.mismatches({"zed_status": "FAILED"}) == [Level("zed_status", "OK", "health#2")]
