"""The judge makes a report of whatever a run has left."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from matplotlib.image import imread
from recorded_way import BLOCKED, ROUTE, truth

from skillwing.bt_missions.missions.mapping import MappingMissionOptions
from skillwing.evaluation.judge.evaluation import MAP_CLOUD, MAP_PICTURE, evaluate
from skillwing.evaluation.judge.flight_log import FLIGHT_FILE, MAP_FILE
from skillwing.m600.geofence import HOME
from skillwing.m600.robot import ROBOT
from skillwing.onboard.topics.truth import Truth
from skillwing.services.history.files import GOALS_FILE, TIMELINE_FILE, JsonLines
from skillwing.services.history.report import REPORT_FILE, MissionReport
from skillwing.services.protocol import GoalStatus, Record, RecordKind
from skillwing.services.report.mission_report import TIMELINE_PICTURE
from skillwing.sim_mujoco.world.world import make_world

SKILLSET = ROBOT.load_skillset()


def depth_map(number: int, t: float, before: str, after: str) -> Record:
    return Record(
        id=f"resource_manager#{number}",
        t=t,
        source="resource_manager",
        kind=RecordKind.RESOURCE,
        subject="depthmap_source",
        before=before,
        after=after,
    )


RECORDS = [
    depth_map(1, 2.0, "NONE", "ZED"),
    depth_map(2, 5.02, "ZED", "NONE"),
    depth_map(3, 5.04, "NONE", "LIDAR"),
    Record(
        id="mission#1",
        t=10.0,
        source="mission",
        kind=RecordKind.MISSION,
        subject="mapping",
        before="RUNNING",
        after="SUCCEEDED",
    ),
]


def judged(report: MissionReport) -> tuple[float | None, float | None]:
    return report.judged_value("collisions"), report.judged_value("min_clearance_m")


def write_run(run_dir: Path) -> None:
    with JsonLines[Record](run_dir / TIMELINE_FILE) as file:
        for record in RECORDS:
            file.write(record)
    with JsonLines[GoalStatus](run_dir / GOALS_FILE) as file:
        file.write(BLOCKED)
    with JsonLines[Truth](run_dir / FLIGHT_FILE) as file:
        for t in np.arange(0.0, 10.0, 0.5).tolist():
            file.write(truth(t, collisions=int(t > 9.0)))


def test_a_flight_without_a_map_is_judged_by_what_there_is(tmp_path: Path) -> None:
    write_run(tmp_path)
    report = evaluate(tmp_path, SKILLSET, mission="mapping", seed=3, wall_time_s=5.0)
    assert (report.result, *judged(report)) == ("success", 1, 2.05)
    assert report.judged_value("coverage") is None
    assert report.real_time_factor == 2.0
    for picture in (TIMELINE_PICTURE, MAP_PICTURE):
        assert imread(tmp_path / picture).std() > 0.0


def test_a_run_that_left_nothing_has_a_report(tmp_path: Path) -> None:
    report = evaluate(tmp_path, SKILLSET, mission="mapping", seed=3)
    assert (report.result, *judged(report)) == ("unfinished", None, None)
    assert json.loads((tmp_path / REPORT_FILE).read_text())["skills"] == []
    assert not (tmp_path / MAP_PICTURE).exists()


def test_a_flight_whose_end_nobody_saw_is_not_called_free_of_collisions(tmp_path: Path) -> None:
    write_run(tmp_path)
    lines = (tmp_path / FLIGHT_FILE).read_bytes().splitlines(keepends=True)
    (tmp_path / FLIGHT_FILE).write_bytes(b"".join(lines[:10]))
    report = evaluate(tmp_path, SKILLSET, mission="mapping", seed=3)
    assert (report.result, *judged(report)) == ("success", None, None)


def test_a_map_is_judged_against_the_world(tmp_path: Path) -> None:
    write_run(tmp_path)
    ground = np.mgrid[0:25, -12:13, 0:1].reshape(3, -1).T * 0.4 + 0.2
    np.savez(tmp_path / MAP_FILE, centres=ground.astype(np.float32), voxel_size=0.4, pose_source="simulated")
    report = evaluate(tmp_path, SKILLSET, mission="mapping", seed=3, route=ROUTE)
    terrain = report.judged_value("coverage_terrain")
    assert terrain is not None
    assert 0.0 < terrain < 1.0
    assert "simulated" in (tmp_path / "report.md").read_text()
    assert (tmp_path / MAP_CLOUD).read_bytes().endswith(ground.astype("<f4").tobytes())


def test_the_route_that_is_judged_is_the_one_that_the_mission_flies() -> None:
    """Coverage is judged along the world's route, which begins where the take-off ends."""
    options = MappingMissionOptions()
    above_home, *waypoints = make_world(1).route
    assert tuple(waypoints) == options.route
    assert above_home == (*HOME, options.height or options.route[0][2])
