"""The drone's skillset: what missions and managers rely on."""

from __future__ import annotations

from pathlib import Path

import pytest

from skillwing import m600
from skillwing.dsl import Skillset
from skillwing.dsl.checking.checker import check
from skillwing.dsl.queries import taken_by

FILE = Path(m600.__path__[0]) / "m600.skillset"


@pytest.fixture(scope="module")
def skillset() -> Skillset:
    checked = check(FILE.read_text(), FILE.name)
    assert checked.diagnostics == ()
    assert checked.skillset is not None
    return checked.skillset


def test_every_end_of_every_skill_gives_back_what_it_took(skillset: Skillset) -> None:
    for skill in skillset.skills:
        initial = {name: skillset.resource(name).initial for name in taken_by(skill)}
        ends = [result.apply for result in skill.results]
        ends += [invariant.violation for invariant in skill.invariants]
        for effect in (*ends, skill.interrupt.apply, skill.lost):
            assert dict(skill.transitions(effect)) == initial, (skill.name, effect)


def test_who_takes_what(skillset: Skillset) -> None:
    both = {"axes_authority", "heading_authority"}
    expected: dict[str, set[str]] = {
        "takeoff": both,
        "land": both,
        "hover": both,
        "goto": {"axes_authority"},
        "goto_straight": both,
        "return_home": both,
        "rotate_head": {"heading_authority"},
        "lock_head": {"heading_authority"},
        "zed_depthmap": {"depthmap_source"},
        "lidar_depthmap": {"depthmap_source"},
        "lidar_mapping": {"slam_status"},
        "inspect": both,
        "stream": set(),
    }
    for skill, resources in expected.items():
        assert taken_by(skillset.skill(skill)).keys() == resources, skill


def test_a_movement_needs_authority_and_ends_without_it(skillset: Skillset) -> None:
    for skill in skillset.skills:
        if {"axes_authority", "heading_authority"} & taken_by(skill).keys():
            assert "authority" in [check.name for check in skill.preconditions.checks]
            assert skill.invariants[0].name == "authority"
