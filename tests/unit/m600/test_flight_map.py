"""The picture of a flight's map is told where what happened, by its history and the true path."""

from __future__ import annotations

import numpy as np
import pytest
from recorded_way import BLOCKED, ROUTE, truth

from skillwing.evaluation.flights.saved_map import SavedMap
from skillwing.evaluation.judge.flight_map import map_scene
from skillwing.evaluation.judge.map_picture import MapScene
from skillwing.m600.robot import ROBOT
from skillwing.services.history.history import History
from skillwing.services.protocol import Record, RecordKind
from skillwing.sim_mujoco.world.world import make_world

WORLD = make_world(3)


def change(
    t: float, subject: str, before: str, after: str, kind: RecordKind = RecordKind.RESOURCE, source: str = "manager"
) -> Record:
    return Record(
        id=f"{source}#{round(100 * t)}", t=t, source=source, kind=kind, subject=subject, before=before, after=after
    )


def scene_of(*records: Record, seconds: float = 10.0) -> MapScene:
    saved = SavedMap(np.zeros((1, 3), np.float32), 0.4, "")
    flight = [truth(t) for t in np.arange(0.0, seconds, 0.1).tolist()]
    return map_scene(WORLD, ROUTE, History.of(records, [BLOCKED], ROBOT.load_skillset()), flight, saved)


HANDED_OVER = (
    change(2.0, "depthmap_source", "NONE", "ZED"),
    change(5.02, "depthmap_source", "ZED", "NONE"),
    change(5.04, "depthmap_source", "NONE", "LIDAR"),
)


def test_the_path_is_cut_where_the_depth_map_changes_hands_and_has_no_gaps() -> None:
    scene = scene_of(*HANDED_OVER, change(9.9, "flight_status", "IN_AIR", "ON_GROUND"))
    stretches = [stretch for stretch in scene.flown if stretch.branch != "none"]
    assert [stretch.branch for stretch in stretches] == ["zed", "lidar"]
    assert np.array_equal(stretches[0].path[-1], stretches[1].path[0])
    assert scene.obstacles_met == [pytest.approx((4.0, 0.0, 4.0), abs=0.11)]
    assert scene.ended == "came down here"
    assert scene.fence == WORLD.geofence


def test_what_failed_and_what_the_mission_did_about_it_have_their_places() -> None:
    scene = scene_of(
        change(1.0, "zed_status", "UNKNOWN", "OK"),
        change(3.0, "zed_status", "OK", "FAILED"),
        change(6.0, "zed_status", "FAILED", "OK"),
        change(7.0, "zed_status", "OK", "FAILED"),
        change(5.0, "navigation", "ZED", "LiDAR", RecordKind.MISSION, "mission"),
    )
    (trouble,), (switch,) = scene.troubles, scene.switches
    assert (trouble.text, switch.text) == ("zed_status FAILED at 3.0 s", "at 5.0 s ZED -> LiDAR")
    assert trouble.place == pytest.approx((3.0, 0.0, 4.0), abs=0.11)
    assert switch.place == pytest.approx((5.0, 0.0, 4.0), abs=0.11)
    assert scene.ended == "end of the flight", "nobody said that it came down"


def test_where_no_truth_was_recorded_nothing_has_a_place() -> None:
    scene = scene_of(change(3.0, "zed_status", "OK", "FAILED"), seconds=0.0)
    assert not scene.flown
    assert not (scene.obstacles_met or scene.troubles or scene.switches)
