"""Odometry by small_gicp, which may be chosen in place of ours: what it says of itself, and what is said without it."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from box_room import HIGH, LOW, STANDING, Room

from skillwing.onboard.mapping.node import make_mapping
from skillwing.onboard.odometry import so3
from skillwing.onboard.odometry.gicp import MissingLibraryError, gicp_matcher
from skillwing.onboard.odometry.odometry import LidarInertialOdometry, Phase
from skillwing.services.options import OptionsError
from skillwing.sim_mujoco.launching import mapping_options
from skillwing.sim_mujoco.scenario.reading import ScenarioError, read_scenario

BOX = {"low": list(LOW), "high": list(HIGH)}


def make_odometry() -> LidarInertialOdometry:
    try:
        return LidarInertialOdometry(LOW, HIGH, make_matcher=gicp_matcher())
    except MissingLibraryError as error:
        pytest.skip(str(error))


def test_it_follows_a_drone_through_a_room() -> None:
    room, odometry = Room(), make_odometry()
    fixes = list(room.fly(odometry, 6.0))
    assert len(fixes) == 39
    assert max(np.linalg.norm(fix.state.position - room.position(fix.t)) for fix in fixes) < 0.05
    assert max(np.linalg.norm(so3.log(fix.state.turn.T @ room.turn(fix.t))) for fix in fixes) < np.radians(0.5)
    assert all(fix.accepted for fix in fixes)
    assert fixes[-1].agreement.share > 0.9
    assert odometry.phase is Phase.TRACKING


def test_the_same_scans_give_the_same_poses_bit_by_bit() -> None:
    runs = [[fix.state.position.tobytes() for fix in Room().fly(make_odometry(), 3.0)] for _ in range(2)]
    assert runs[0] == runs[1]


def test_wrong_ranges_are_noticed_until_a_restart() -> None:
    room, odometry = Room(), make_odometry()
    list(room.fly(odometry, STANDING + 1.0))
    room.lidar_bias = 1.0
    list(room.fly(odometry, 2.0))
    assert odometry.phase is Phase.LOST
    assert "times" in odometry.text
    room.lidar_bias = 0.0
    odometry.restart()
    fixes = list(room.fly(odometry, 3.5))
    assert np.linalg.norm(fixes[-1].state.position - room.position(fixes[-1].t)) < 0.15


def test_the_node_says_whose_poses_it_has() -> None:
    make_odometry()
    assert make_mapping(BOX | {"poses": "small-gicp"}).pose_source == "LiDAR-inertial odometry with small_gicp"
    assert make_mapping(BOX).pose_source == "LiDAR-inertial odometry"


def test_a_scenario_chooses_the_poses_unless_the_options_do(tmp_path: Path) -> None:
    file = tmp_path / "scenario.toml"
    file.write_text('poses = "navigation"\n', encoding="utf-8")
    assert read_scenario(file).poses == "navigation"
    options = BOX | {"scenario": str(file)}
    assert make_mapping(mapping_options(options)).pose_source == "navigation solution"
    assert make_mapping(mapping_options(options | {"poses": "odometry"})).pose_source == "LiDAR-inertial odometry"
    file.write_text('poses = "guessed"\n', encoding="utf-8")
    with pytest.raises(ScenarioError, match=r'`poses` has to be one of .*, not "guessed"'):
        mapping_options(options)


def test_without_the_library_a_sentence_says_what_to_install(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(sys.modules, "small_gicp", None)
    with pytest.raises(OptionsError, match=r"pip install 'skillwing\[comparison\]'"):
        make_mapping(BOX | {"poses": "small-gicp"})
    file = tmp_path / "scenario.toml"
    file.write_text('poses = "small-gicp"\n', encoding="utf-8")
    with pytest.raises(ScenarioError, match=r"pip install 'skillwing\[comparison\]'"):
        read_scenario(file)
    assert make_mapping(BOX).pose_source == "LiDAR-inertial odometry"
