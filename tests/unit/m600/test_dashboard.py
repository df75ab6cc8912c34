"""Recording of a flight: everything that the dashboard promises, from the robot's own data."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rerun.chunk import RrdReader

from skillwing.m600.robot import ROBOT
from skillwing.onboard.topics import flight, mapping, navigation, sensors, video
from skillwing.onboard.topics.guidance import GUIDANCE_STATUS, AxisStatus, GuidanceStatus, MotionState
from skillwing.onboard.topics.link import LINK_STATUS, LinkStatus
from skillwing.onboard.topics.obstacles import OBSTACLE_STATUS, ObstacleSource, ObstacleStatus
from skillwing.services.bus import Bus
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.protocol import Keys, MissionPhase, MissionStatus, Record, RecordKind, encode
from skillwing.services.recording.recorder import RECORDING_FILE, make_recorder

SPEED = 2.0
TABS = 1
"""Rerun's number for a container that shows one of its views at a time."""


class Drone:
    """Flies east; its camera fails at 6 s; it maps one voxel a second and forgets the first at 7 s."""

    name = "sim"
    owns_clock = False

    def attach(self, bus: Bus) -> None:
        self._bus = bus
        self._put = {
            key: bus.advertise(key).put
            for key in (
                navigation.NAVIGATION,
                GUIDANCE_STATUS,
                OBSTACLE_STATUS,
                flight.BATTERY,
                sensors.LIDAR,
                sensors.ZED_DEPTH,
                mapping.MAP,
                video.VIDEO_SHOWN,
                LINK_STATUS,
                video.VIDEO_STATUS,
            )
        }
        bus.every(0.02, self._navigate)
        bus.every(0.1, self._look)
        bus.every(1.0, self._map)
        keys = Keys("m600")
        timeline = bus.advertise(keys.timeline, events=True)
        for number, (t, before, after) in enumerate([(1.0, "NONE", "ZED"), (6.0, "ZED", "LIDAR")], start=1):
            record = Record(
                id=f"m#{number}",
                t=t,
                source="m",
                kind=RecordKind.RESOURCE,
                subject="depthmap_source",
                before=before,
                after=after,
            )
            bus.after(t, lambda record=record: timeline.put(encode(record)))
        health = bus.advertise(sensors.health_key("zed"), events=True)
        failed = sensors.Health(id="h", t=6.0, sensor="zed", status=sensors.SensorStatus.FAILED)
        bus.after(6.0, lambda: health.put(encode(failed)))
        goal = MissionStatus(
            mission="mapping", phase=MissionPhase.RUNNING, t=0.0, text="", waypoints=1, goal=(20.0, 0.0, 4.0)
        )
        bus.advertise(keys.mission_status, events=True).put(encode(goal))

    def detach(self) -> None:
        pass

    def _navigate(self) -> None:
        t = self._bus.now()
        pose = navigation.Navigation(
            t=t,
            position=(SPEED * t, 0.0, 4.0),
            velocity=(SPEED, 0.0, 0.0),
            quaternion=(1.0, 0.0, 0.0, 0.0),
            angular_velocity=(0.0, 0.0, 0.0),
            heading=0.0,
        )
        self._put[navigation.NAVIGATION](encode(pose))

    def _look(self) -> None:
        t = self._bus.now()
        axis = AxisStatus(goal_id="g", state=MotionState.MOVING, remaining=1.0)
        guidance = GuidanceStatus(
            t=t, body=axis, heading=axis, setpoint=(0.0, 0.0, 4.0), target=(20.0, 0.0, 4.0), free_distance=None
        )
        self._put[GUIDANCE_STATUS](encode(guidance))
        obstacles = ObstacleStatus(
            t=t, source=ObstacleSource.ZED, free_distance=None, horizon=20.0, ahead=None, stamp=t
        )
        self._put[OBSTACLE_STATUS](encode(obstacles))
        self._put[flight.BATTERY](encode(flight.Battery(t=t, percent=90.0, voltage=24.0)))
        lidar = sensors.LidarHeader(t0=t - 0.1, t1=t, columns=1024, beams=16, mount=(0.0, 0.0, -0.42))
        self._put[sensors.LIDAR](np.full((1024, 16), 5.0, np.float32).tobytes(), encode(lidar))
        if t < 6.0:
            depth = sensors.DepthHeader(
                t=t, width=320, height=180, fx=176.0, fy=176.0, cx=160.0, cy=90.0, mount=(0.3, 0.0, 0.0)
            )
            self._put[sensors.ZED_DEPTH](np.full((180, 320), 8000, np.uint16).tobytes(), encode(depth))

    def _map(self) -> None:
        t = self._bus.now()
        shown = video.VideoShown(t=t, width=320, height=180)
        self._put[video.VIDEO_SHOWN](b"\xff\xd8\xff" + bytes(8000), encode(shown))
        link = LinkStatus(t=t, bandwidth=2e6, latency=0.03, loss=0.0, queued=0.0, sent=1e6, dropped=0)
        self._put[LINK_STATUS](encode(link))
        seen = video.VideoStatus(t=t, stream="g", fps=15.0, quality=0.9, bitrate=1e6, lost=0.0, latency=0.05)
        self._put[video.VIDEO_STATUS](encode(seen))
        whole = t > 7.5
        voxels = np.array(
            [[0.4 * n + 0.2, 0.2, 0.2] for n in ((range(2, int(t) + 1)) if whole else [int(t)])], np.float32
        )
        header = mapping.MapHeader(t=t, voxel_size=0.4, count=len(voxels), complete=whole)
        self._put[mapping.MAP](voxels.tobytes(), encode(header))


Rows = list[tuple[float, Any]]


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    run_dir = tmp_path_factory.mktemp("run")
    recorder = make_recorder(
        {
            "run_dir": str(run_dir),
            "skillset": str(ROBOT.skillset),
            "scene": "skillwing.evaluation.dashboard.scene:make_scene",
        }
    )
    network = InProcessNetwork()
    network.attach(recorder)
    network.attach(Drone())
    network.run_for(10.0)
    recorder.detach()
    return run_dir / RECORDING_FILE


def rows(recording: Path, entity: str, component: str) -> Rows:
    found: Rows = []
    for chunk in RrdReader(str(recording)).stream().filter(content=entity).to_chunks():
        batch = chunk.to_record_batch()
        column = next((name for name in batch.schema.names if name.endswith(component)), None)
        if column is not None and "mission_time" in batch.schema.names:
            times = batch.column("mission_time")
            found += [(times[row].value / 1e9, batch.column(column)[row].as_py()) for row in range(batch.num_rows)]
    return sorted(found, key=lambda row: row[0])


def test_the_drone_moves(recording: Path) -> None:
    poses = rows(recording, "/world/drone", "Transform3D:translation")
    assert 90 <= len(poses) <= 101
    assert all(math.isclose(xyz[0][0], SPEED * t, abs_tol=0.05) for t, xyz in poses)


def test_the_path_has_the_colour_of_the_sensor_that_looked_ahead(recording: Path) -> None:
    colours = {entry[0] for _, entry in rows(recording, "/world/path/**", "LineStrips3D:colors")}
    assert len(colours) == 3  # before the depth map, by camera, by LiDAR


def test_scans_are_thinned(recording: Path) -> None:
    scans = rows(recording, "/world/scan", "Points3D:positions")
    assert 36 <= len(scans) <= 41
    assert all(1000 < len(points) <= 4000 for _, points in scans)


def test_what_the_ground_sees_is_shown(recording: Path) -> None:
    pictures = rows(recording, "/video/ground", "EncodedImage:blob")
    assert len(pictures) >= 9
    assert {row[1][0] for row in rows(recording, "/plots/link/bandwidth", "Scalars:scalars")} == {2.0}
    assert {row[1][0] for row in rows(recording, "/plots/video/fps", "Scalars:scalars")} == {15.0}
    assert {row[1][0] for row in rows(recording, "/plots/video/SSIM_tenths", "Scalars:scalars")} == {9.0}


def test_the_first_picture_on_the_ground_brings_the_video_forward_once(recording: Path) -> None:
    reader = RrdReader(str(recording))
    views: dict[str, str] = {}
    sent: list[set[tuple[str, ...]]] = []
    for blueprint in reader.blueprints():
        pairs: set[tuple[str, ...]] = set()
        for chunk in reader.stream(store=blueprint).to_chunks():
            batch = chunk.to_record_batch()
            told = {name.rpartition(":")[2]: batch.column(name)[0] for name in batch.schema.names if ":" in name}
            if "display_name" in told:
                views[chunk.entity_path.removeprefix("/")] = told["display_name"].as_py()[0]
            if "container_kind" in told and told["container_kind"].as_py() == [TABS]:
                pairs.add(tuple(told["contents"].as_py()))
        sent.append(pairs)
    arrangements = {frozenset(tuple(views[view] for view in pair) for pair in pairs) for pairs in sent}
    before = {("Depth camera", "Video on the ground"), ("Mapped [m²]", "Link [Mbit/s]"), ("Battery [%]", "Video")}
    assert arrangements == {frozenset(before), frozenset(pair[::-1] for pair in before)}


def test_a_failed_camera_shows_nothing(recording: Path) -> None:
    pictures = rows(recording, "/world/drone/camera/depth", "EncodedDepthImage:blob")
    assert all(picture for t, picture in pictures if t < 5.9)
    assert not pictures[-1][1]
    assert pictures[-1][0] == pytest.approx(6.0)


def test_the_map_forgets_what_turned_out_to_be_free(recording: Path) -> None:
    pieces = dict(rows(recording, "/world/map/000", "Points3D:positions"))
    eastings = sorted(round(x, 1) for x, _, _ in pieces[max(pieces)])
    assert eastings[0] == 1.0
    assert len(eastings) == int(max(pieces)) - 1


def test_until_somebody_maps_the_world_is_what_was_seen(recording: Path) -> None:
    seen = rows(recording, "/world/seen/000", "Points3D:positions")
    assert all(points for t, points in seen if t < 0.9)
    (cleared,) = rows(recording, "/world/seen", "Clear:is_recursive")
    assert cleared == (pytest.approx(1.0), [True])
    assert max(t for t, _ in seen) <= cleared[0]


def test_what_was_mapped_is_counted_one_face_a_voxel(recording: Path) -> None:
    surface = rows(recording, "/plots/mapped/surface", "Scalars:scalars")
    voxels = {t: len(points) for t, points in rows(recording, "/world/map/000", "Points3D:positions")}
    assert {t: value[0] for t, value in surface if t in voxels} == pytest.approx(
        {t: count * 0.4**2 for t, count in voxels.items()}
    )


def test_scalars_have_a_gap_where_nothing_is_known(recording: Path) -> None:
    assert {row[1][0] for row in rows(recording, "/plots/battery/battery", "Scalars:scalars")} == {90.0}
    assert all(math.isnan(row[1][0]) for row in rows(recording, "/plots/motion/free_distance", "Scalars:scalars"))
    assert rows(recording, "/plots/motion/speed", "Scalars:scalars")[0][1] == [pytest.approx(SPEED)]


def test_five_minutes_of_the_streams_stay_below_40_megabytes(recording: Path) -> None:
    """Every return of these scans is a hit, and their depth images last as long as the camera."""
    assert recording.stat().st_size / 10.0 * 300.0 < 40e6


def test_another_drone_of_the_same_world_is_shown_with_its_way_and_its_map(tmp_path: Path) -> None:
    network = InProcessNetwork()
    for robot in ("left", "right"):
        network.attach(Drone(), robot)
    options = {
        "run_dir": str(tmp_path),
        "skillset": str(ROBOT.skillset),
        **ROBOT.recorder({"robots": {"left": {}, "right": {}}}),
    }
    recorder = make_recorder(options)
    network.attach(recorder, "left")
    network.run_for(3.0)
    recorder.detach()
    assert rows(tmp_path / RECORDING_FILE, "/world/right/drone", "Transform3D:translation")
    assert rows(tmp_path / RECORDING_FILE, "/world/right/map/000", "Points3D:positions")
    assert rows(tmp_path / RECORDING_FILE, "/world/right/path/000", "LineStrips3D:strips")
