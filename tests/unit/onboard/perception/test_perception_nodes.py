"""The obstacle and the mapping node on a bus: who may command them, and what they publish."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
import pytest

from skillwing.onboard.frames.extent import Box
from skillwing.onboard.mapping.node import MAP_DIVERGED, make_mapping
from skillwing.onboard.obstacles.landing_memory import READINGS, SURE
from skillwing.onboard.obstacles.node import make_obstacles
from skillwing.onboard.sensor_data.directions import RANGE_MOUNT, lidar_directions
from skillwing.onboard.sensor_data.names import IMU, LIDAR, RANGE
from skillwing.onboard.topics import common, guidance, navigation, sensors
from skillwing.onboard.topics.mapping import (
    MAP,
    MAP_SNAPSHOT,
    MAPPING_COMMAND,
    MAPPING_STATUS,
    ControlMapping,
    MapHeader,
    MappingStatus,
)
from skillwing.onboard.topics.obstacles import (
    LANDING_PLACE,
    OBSTACLE_COMMAND,
    OBSTACLE_STATUS,
    LandingPlace,
    ObstacleSource,
    ObstacleStatus,
    SelectObstacleSource,
)
from skillwing.services.bus import Answered, Node, Refused
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.options import OptionsError
from skillwing.services.protocol import ErrorCode, Message, decode, encode
from skillwing.sim_mujoco.sensors.instruments import RANGE_PERIOD

M = TypeVar("M", bound=Message)
ZERO = (0.0, 0.0, 0.0)
HOVER = (0.0, 0.0, 4.0)
UNKNOWN_GROUND = "nothing is known of the ground below"
GROUND_BELOW = "nothing is known to stand below"
AT_REST = guidance.AxisStatus(goal_id=None, state=guidance.MotionState.IDLE, remaining=0.0)


class Bench:
    """A node on a bus, and a hovering drone around it whose sensors see a wall 6 m ahead and 6 m to its left."""

    def __init__(self, node: Node) -> None:
        self.network = InProcessNetwork()
        self.network.attach(node)
        self.bus = self.network.bus("bench")
        self.target: common.Vector3 | None = None
        self.wall = 6.0
        self.blind = False
        self.valid = True
        self.sigma = 0.0
        self.received: dict[str, list[tuple[bytes, bytes]]] = {}
        self._out = {
            key: self.bus.advertise(key)
            for key in (navigation.NAVIGATION, sensors.LIDAR, sensors.ZED_DEPTH, guidance.GUIDANCE_STATUS)
        }
        self._revocations = self.bus.advertise(guidance.AUTHORITY, events=True)
        self._every(0.02, self._navigate)
        self._every(0.05, self._guide)
        self._every(0.1, self._scan)
        self._every(0.1, self._picture)

    def run(self, seconds: float) -> None:
        self.network.run_for(seconds)

    def follow(self, key: str) -> None:
        into = self.received.setdefault(key, [])
        self.bus.subscribe(key, lambda sample: into.append((sample.payload, sample.attachment)))

    def latest(self, key: str, kind: type[M]) -> M:
        return decode(self.received[key][-1][0], kind)

    def ask(self, key: str, message: Message) -> Answered | Refused:
        answers: list[Any] = []
        self.bus.ask(key, encode(message), answers.append)
        assert self.network.run_until(lambda: bool(answers), 1.0)
        return answers[0]

    def revoke(self, goal: str, token: int) -> None:
        self._revocations.put(encode(guidance.Revoked(goal_id=goal, token=token)))

    def send_rubbish(self, key: str) -> None:
        self.bus.advertise(key).put(b"rubbish", b"\xff")

    def _every(self, period: float, act: Callable[[], None]) -> None:
        self.bus.every(period, act)

    def _navigate(self) -> None:
        pose = navigation.Navigation(
            t=self.bus.now(),
            position=HOVER,
            velocity=ZERO,
            quaternion=(1.0, 0.0, 0.0, 0.0),
            angular_velocity=ZERO,
            heading=0.0,
            valid=self.valid,
            sigma=self.sigma,
        )
        self._out[navigation.NAVIGATION].put(encode(pose))

    def _guide(self) -> None:
        status = guidance.GuidanceStatus(
            t=self.bus.now(), body=AT_REST, heading=AT_REST, setpoint=HOVER, target=self.target, free_distance=None
        )
        self._out[guidance.GUIDANCE_STATUS].put(encode(status))

    def _scan(self) -> None:
        if self.blind:
            return
        directions = lidar_directions(256, 16)
        towards = np.maximum(directions[..., 1], 1e-6)
        ranges = np.where(towards > 0.7, self.wall / towards, 0.0).astype(np.float32)
        now = self.bus.now()
        header = sensors.LidarHeader(t0=now - 0.1, t1=now, columns=256, beams=16, mount=ZERO)
        self._out[sensors.LIDAR].put(ranges.tobytes(), encode(header))

    def _picture(self) -> None:
        if self.blind:
            return
        depth = np.full((36, 64), round(1000 * self.wall), dtype=np.uint16)
        header = sensors.DepthHeader(
            t=self.bus.now(), width=64, height=36, fx=35.0, fy=35.0, cx=32.0, cy=18.0, mount=ZERO
        )
        self._out[sensors.ZED_DEPTH].put(depth.tobytes(), encode(header))


def select(goal: str, token: int, source: ObstacleSource) -> SelectObstacleSource:
    return SelectObstacleSource(goal_id=goal, token=token, source=source)


def control(goal: str, token: int, run: bool) -> ControlMapping:
    return ControlMapping(goal_id=goal, token=token, run=run)


def code(answer: Answered | Refused) -> ErrorCode | None:
    return answer.error.code if isinstance(answer, Refused) else None


# --- obstacles -----------------------------------------------------------------------------------------------


@pytest.fixture
def obstacles() -> Bench:
    bench = Bench(make_obstacles({}))
    bench.follow(OBSTACLE_STATUS)
    bench.run(0.5)
    return bench


def report(bench: Bench) -> ObstacleStatus:
    return bench.latest(OBSTACLE_STATUS, ObstacleStatus)


def test_without_a_source_it_reports_ten_times_a_second_that_it_knows_nothing(obstacles: Bench) -> None:
    obstacles.target = (10.0, 0.0, 4.0)
    before = len(obstacles.received[OBSTACLE_STATUS])
    obstacles.run(1.0)
    assert len(obstacles.received[OBSTACLE_STATUS]) - before == 10
    assert (report(obstacles).source, report(obstacles).free_distance) == (ObstacleSource.NONE, None)


@pytest.mark.parametrize(
    ("source", "seen", "unseen"),
    [
        (ObstacleSource.ZED, (10.0, 0.0, 4.0), (0.0, 10.0, 4.0)),
        (ObstacleSource.LIDAR, (0.0, 10.0, 4.0), (10.0, 0.0, 4.0)),
    ],
)
def test_each_source_reports_the_way_that_it_looks_along(obstacles: Bench, source, seen, unseen) -> None:
    obstacles.target = seen
    assert isinstance(obstacles.ask(OBSTACLE_COMMAND, select("g", 1, source)), Answered)
    obstacles.run(0.5)
    status = report(obstacles)
    assert status.source is source
    assert status.free_distance == pytest.approx(6.0, abs=0.05)
    assert status.stamp is not None
    assert 0.0 <= status.t - status.stamp <= 0.2
    obstacles.target = unseen
    obstacles.run(0.5)
    assert report(obstacles).free_distance is None


def test_a_sensor_that_falls_silent_shows_in_the_stamp_and_then_in_silence_about_the_way(obstacles: Bench) -> None:
    obstacles.target = (10.0, 0.0, 4.0)
    obstacles.ask(OBSTACLE_COMMAND, select("g", 1, ObstacleSource.ZED))
    obstacles.run(0.5)
    obstacles.blind = True
    last = obstacles.bus.now()
    obstacles.run(0.35)
    assert report(obstacles).free_distance == pytest.approx(6.0, abs=0.05)
    obstacles.run(0.5)
    status = report(obstacles)
    assert status.free_distance is None
    assert status.stamp is not None
    assert status.stamp <= last
    assert status.t - status.stamp > 0.5


def test_the_newer_token_wins_and_late_words_of_the_older_one_are_refused(obstacles: Bench) -> None:
    obstacles.ask(OBSTACLE_COMMAND, select("old", 4, ObstacleSource.ZED))
    obstacles.ask(OBSTACLE_COMMAND, select("new", 7, ObstacleSource.LIDAR))
    assert code(obstacles.ask(OBSTACLE_COMMAND, select("old", 4, ObstacleSource.NONE))) is ErrorCode.STALE_TOKEN
    assert code(obstacles.ask(OBSTACLE_COMMAND, select("old", 4, ObstacleSource.ZED))) is ErrorCode.STALE_TOKEN
    obstacles.run(0.2)
    assert report(obstacles).source is ObstacleSource.LIDAR


def test_only_the_holder_releases(obstacles: Bench) -> None:
    obstacles.ask(OBSTACLE_COMMAND, select("g", 4, ObstacleSource.ZED))
    assert isinstance(obstacles.ask(OBSTACLE_COMMAND, select("other", 5, ObstacleSource.NONE)), Answered)
    obstacles.run(0.2)
    assert report(obstacles).source is ObstacleSource.ZED
    assert isinstance(obstacles.ask(OBSTACLE_COMMAND, select("g", 4, ObstacleSource.NONE)), Answered)
    obstacles.run(0.2)
    assert report(obstacles).source is ObstacleSource.NONE


def test_a_revoked_holder_loses_the_source(obstacles: Bench) -> None:
    obstacles.ask(OBSTACLE_COMMAND, select("g", 4, ObstacleSource.ZED))
    obstacles.revoke("someone else", 9)
    obstacles.run(0.2)
    assert report(obstacles).source is ObstacleSource.ZED
    obstacles.revoke("g", 4)
    obstacles.run(0.2)
    assert report(obstacles).source is ObstacleSource.NONE
    assert code(obstacles.ask(OBSTACLE_COMMAND, select("g", 4, ObstacleSource.ZED))) is ErrorCode.STALE_TOKEN


def test_rubbish_is_refused_or_dropped_and_the_node_lives(obstacles: Bench) -> None:
    answers: list[Any] = []
    obstacles.bus.ask(OBSTACLE_COMMAND, b"rubbish", answers.append)
    obstacles.ask(OBSTACLE_COMMAND, select("g", 1, ObstacleSource.ZED))
    for key in (navigation.NAVIGATION, sensors.ZED_DEPTH, guidance.GUIDANCE_STATUS, guidance.AUTHORITY):
        obstacles.send_rubbish(key)
    obstacles.target = (10.0, 0.0, 4.0)
    obstacles.run(0.5)
    assert code(answers[0]) is ErrorCode.BAD_REQUEST
    assert report(obstacles).free_distance == pytest.approx(6.0, abs=0.05)


def landing_place(bench: Bench) -> LandingPlace:
    answer = bench.ask(LANDING_PLACE, common.Empty())
    assert isinstance(answer, Answered)
    return decode(answer.payload, LandingPlace)


def landing_text(bench: Bench) -> str:
    return landing_place(bench).text


def show_ground(bench: Bench, pillar: bool) -> None:
    """Let the LiDAR see plain ground 4 m below the drone and nothing else, but for a pillar that may stand there."""
    bench.blind = True
    directions = lidar_directions(256, 16)
    down = np.maximum(-directions[..., 2], 1e-6)
    top = 2.0 / down
    on_top = np.linalg.norm(top[..., None] * directions[..., :2], axis=-1) < 1.0
    ranges = np.where(pillar & on_top, top, HOVER[2] / down)
    scan = np.where(down > 0.3, ranges, 0.0).astype(np.float32)
    lidar = bench.bus.advertise(sensors.LIDAR)

    def show() -> None:
        now = bench.bus.now()
        lidar.put(scan.tobytes(), encode(sensors.LidarHeader(t0=now - 0.1, t1=now, columns=256, beams=16, mount=ZERO)))

    bench.bus.every(0.1, show)
    bench.run(2.0)


@pytest.mark.parametrize("pillar", [False, True])
def test_the_answer_says_whether_the_place_below_is_taken(pillar: bool) -> None:
    bench = Bench(make_obstacles({}))
    show_ground(bench, pillar)
    answer = landing_place(bench)
    assert answer.taken is pillar, answer
    assert answer.text.startswith("something stands below" if pillar else "the ground below is free")


def tell_fence(bench: Bench, south: float, north: float) -> Box:
    """Let guidance tell where targets may lie: between lines so far to the south and north of the drone."""
    fence = guidance.Geofence(low=(-20.0, -south, 1.0), high=(20.0, north, 30.0))
    bench.bus.advertise(guidance.GEOFENCE, events=True).put(encode(fence))
    return Box(fence.low, fence.high)


@pytest.mark.parametrize(("south", "north"), [(1.0, 20.0), (20.0, 1.0)])
@pytest.mark.parametrize("told_first", [False, True])
def test_beside_the_fence_the_place_lies_inside(south: float, north: float, told_first: bool) -> None:
    bench = Bench(make_obstacles({}))
    targets = tell_fence(bench, south, north) if told_first else None
    show_ground(bench, pillar=True)
    if targets is None:
        targets = tell_fence(bench, south, north)
        bench.run(0.1)
    answer = landing_place(bench)
    assert answer.taken
    assert answer.place is not None
    assert targets.contains(answer.place), answer


def test_between_narrow_fences_no_place_is_left_and_the_one_below_is_taken() -> None:
    bench = Bench(make_obstacles({}))
    tell_fence(bench, south=1.0, north=1.0)
    show_ground(bench, pillar=True)
    answer = landing_place(bench)
    assert answer.taken
    assert answer.place is None


def test_without_a_fence_the_nearest_place_is_offered() -> None:
    unfenced, fenced = Bench(make_obstacles({})), Bench(make_obstacles({}))
    tell_fence(fenced, south=20.0, north=20.0)
    for bench in (unfenced, fenced):
        show_ground(bench, pillar=True)
    assert landing_place(unfenced).place is not None
    assert landing_place(unfenced) == landing_place(fenced)


def test_a_question_for_a_place_that_is_none_is_refused(obstacles: Bench) -> None:
    answers: list[Any] = []
    obstacles.bus.ask(LANDING_PLACE, b"rubbish", answers.append)
    obstacles.run(0.1)
    assert code(answers[0]) is ErrorCode.BAD_REQUEST


def report_health(bench: Bench, sensor: str, status: sensors.SensorStatus) -> None:
    health = sensors.Health(id=f"{sensor} {status}", t=bench.bus.now(), sensor=sensor, status=status)
    bench.bus.advertise(sensors.health_key(sensor), events=True).put(encode(health))


def test_for_landings_the_lidar_is_followed_whatever_makes_the_depth_map(obstacles: Bench) -> None:
    assert landing_text(obstacles) != UNKNOWN_GROUND


def test_nobody_lands_by_a_sensor_that_has_failed() -> None:
    bench = Bench(make_obstacles({}))
    report_health(bench, LIDAR, sensors.SensorStatus.FAILED)
    bench.run(2.0)
    assert landing_text(bench) == UNKNOWN_GROUND
    report_health(bench, LIDAR, sensors.SensorStatus.OK)
    bench.run(1.0)
    assert landing_text(bench) != UNKNOWN_GROUND


def measure_range(bench: Bench, readings: int, late: float = 0.0) -> None:
    """Let the range-finder, and nothing else, see the ground 4 m below the drone; readings come so late [s]."""
    bench.blind = True
    finder = bench.bus.advertise(sensors.RANGE)
    for _ in range(readings):
        bench.run(RANGE_PERIOD)
        finder.put(encode(sensors.Range(t=bench.bus.now() - late, distance=HOVER[2] + RANGE_MOUNT[2])))
    bench.run(RANGE_PERIOD)


@pytest.mark.parametrize(("status", "text"), [("OK", GROUND_BELOW), ("FAILED", UNKNOWN_GROUND)])
def test_the_range_finder_tells_of_the_ground_where_nothing_else_does(status: str, text: str) -> None:
    bench = Bench(make_obstacles({}))
    report_health(bench, RANGE, sensors.SensorStatus(status))
    measure_range(bench, 2 * READINGS)
    assert landing_text(bench) == text


def test_readings_from_before_the_range_finder_failed_are_not_waited_with() -> None:
    """A sensor that detects its failure has sent wrong distances for a while."""
    bench = Bench(make_obstacles({}))
    measure_range(bench, READINGS - 1)
    report_health(bench, RANGE, sensors.SensorStatus.FAILED)
    report_health(bench, RANGE, sensors.SensorStatus.OK)
    measure_range(bench, READINGS - 1)
    assert landing_text(bench) == UNKNOWN_GROUND
    measure_range(bench, 1)
    assert landing_text(bench) == GROUND_BELOW


def test_the_failure_of_another_sensor_does_not_break_the_line_of_the_range_finder() -> None:
    bench = Bench(make_obstacles({}))
    measure_range(bench, READINGS - 1)
    report_health(bench, LIDAR, sensors.SensorStatus.FAILED)
    measure_range(bench, 1)
    assert landing_text(bench) == GROUND_BELOW


@pytest.mark.parametrize(("late", "text"), [(0.05, GROUND_BELOW), (0.5, UNKNOWN_GROUND), (-0.5, UNKNOWN_GROUND)])
def test_a_reading_counts_where_the_drone_was_when_it_was_taken(late: float, text: str) -> None:
    bench = Bench(make_obstacles({}))
    measure_range(bench, 2 * READINGS, late)
    assert landing_text(bench) == text


@pytest.mark.parametrize(("valid", "text"), [(True, GROUND_BELOW), (False, UNKNOWN_GROUND)])
def test_readings_of_a_drone_that_did_not_know_its_place_are_nowhere(valid: bool, text: str) -> None:
    bench = Bench(make_obstacles({}))
    bench.sigma, bench.valid = 2.0 * SURE, valid
    measure_range(bench, 2 * READINGS)
    bench.valid = True
    bench.run(0.1)
    assert landing_text(bench) == text


# --- mapping -------------------------------------------------------------------------------------------------


@pytest.fixture
def mapping() -> Bench:
    bench = Bench(make_mapping({"low": [-15.0, -15.0, -5.0], "high": [15.0, 15.0, 15.0], "poses": "navigation"}))
    bench.follow(MAPPING_STATUS)
    bench.follow(MAP)
    bench.run(1.05)
    return bench


def status(bench: Bench) -> MappingStatus:
    return bench.latest(MAPPING_STATUS, MappingStatus)


def snapshot(bench: Bench) -> tuple[MapHeader, np.ndarray]:
    answer = bench.ask(MAP_SNAPSHOT, common.Empty())
    assert isinstance(answer, Answered)
    return decode(answer.attachment, MapHeader), np.frombuffer(answer.payload, np.float32).reshape(-1, 3)


def test_it_maps_only_while_it_runs_and_keeps_the_map(mapping: Bench) -> None:
    assert (status(mapping).running, status(mapping).scans, status(mapping).voxels) == (False, 0, 0)
    assert status(mapping).pose_source == "navigation solution"
    mapping.ask(MAPPING_COMMAND, control("g", 1, True))
    mapping.run(2.0)
    assert status(mapping).running
    assert status(mapping).scans >= 15
    assert not status(mapping).diverged
    mapping.ask(MAPPING_COMMAND, control("g", 1, False))
    mapping.run(1.0)
    stopped = status(mapping)
    mapping.run(1.0)
    assert not stopped.running
    assert (status(mapping).scans, status(mapping).voxels) == (stopped.scans, stopped.voxels)
    mapping.ask(MAPPING_COMMAND, control("h", 2, True))
    mapping.run(1.0)
    assert status(mapping).scans > stopped.scans
    assert status(mapping).voxels >= stopped.voxels


def test_the_map_holds_the_wall_and_its_parts_add_up_to_the_snapshot(mapping: Bench) -> None:
    mapping.ask(MAPPING_COMMAND, control("g", 1, True))
    mapping.run(3.0)
    header, centres = snapshot(mapping)
    assert header.complete
    assert header.count == len(centres) > 50
    assert np.abs(centres[:, 1] - 6.0).max() <= 0.4
    parts: list[np.ndarray] = []
    for payload, attachment in mapping.received[MAP]:
        part = decode(attachment, MapHeader)
        points = np.frombuffer(payload, np.float32).reshape(-1, 3)
        assert part.count == len(points)
        parts = [points] if part.complete else [*parts, points]
    everything = np.concatenate(parts)
    assert len(everything) == len(np.unique(everything, axis=0))
    assert {tuple(p) for p in everything.tolist()} == {tuple(p) for p in centres.tolist()}


def test_it_says_when_the_world_no_longer_fits_the_map(mapping: Bench) -> None:
    mapping.ask(MAPPING_COMMAND, control("g", 1, True))
    mapping.run(3.0)
    before = snapshot(mapping)[1]
    mapping.wall = 3.0
    mapping.run(2.0)
    assert status(mapping).diverged
    assert status(mapping).text == MAP_DIVERGED
    assert np.array_equal(snapshot(mapping)[1], before)


def test_a_new_goal_after_a_divergence_begins_a_new_map_and_a_repeated_command_does_not(mapping: Bench) -> None:
    mapping.ask(MAPPING_COMMAND, control("g", 1, True))
    mapping.run(3.0)
    mapping.wall = 3.0
    mapping.run(2.0)
    mapping.ask(MAPPING_COMMAND, control("g", 1, True))
    mapping.run(1.0)
    assert status(mapping).diverged
    mapping.ask(MAPPING_COMMAND, control("h", 2, True))
    mapping.run(2.0)
    assert not status(mapping).diverged
    centres = snapshot(mapping)[1]
    assert len(centres) > 20
    assert np.abs(centres[:, 1] - 3.0).max() <= 0.4


def test_mapping_obeys_only_the_newest_token(mapping: Bench) -> None:
    mapping.ask(MAPPING_COMMAND, control("new", 5, True))
    assert code(mapping.ask(MAPPING_COMMAND, control("old", 3, False))) is ErrorCode.STALE_TOKEN
    assert isinstance(mapping.ask(MAPPING_COMMAND, control("other", 6, False)), Answered)
    mapping.run(1.0)
    assert status(mapping).running
    mapping.revoke("new", 5)
    mapping.run(1.0)
    assert not status(mapping).running


def test_a_scan_without_poses_is_not_mapped(mapping: Bench) -> None:
    mapping.ask(MAPPING_COMMAND, control("g", 1, True))
    stray = sensors.LidarHeader(t0=100.0, t1=100.1, columns=4, beams=4, mount=ZERO)
    mapping.blind = True
    mapping.run(1.0)
    scans = status(mapping).scans
    mapping.bus.advertise(sensors.LIDAR).put(np.full(16, 5.0, np.float32).tobytes(), encode(stray))
    mapping.run(1.0)
    assert status(mapping).scans == scans


@pytest.mark.parametrize("sensor", [IMU, LIDAR])
def test_by_navigation_the_map_needs_the_lidar_only(mapping: Bench, sensor: str) -> None:
    mapping.ask(MAPPING_COMMAND, control("g", 1, True))
    mapping.run(1.0)
    report_health(mapping, sensor, sensors.SensorStatus.FAILED)
    mapping.run(0.5)
    scans = status(mapping).scans
    mapping.run(1.0)
    needed = sensor == LIDAR
    assert (status(mapping).scans == scans) is needed
    assert status(mapping).text == ("lidar is FAILED: it does not say why" if needed else "")
    report_health(mapping, sensor, sensors.SensorStatus.OK)
    mapping.run(1.0)
    assert status(mapping).scans > scans
    assert status(mapping).text == ""


# --- options -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "options",
    [
        {"voxel_size": 0.0},
        {"voxel_size": "small"},
        {"low": [0.0, 0.0, 0.0], "high": [0.0, 1.0, 1.0]},
        {"voxel_size": 0.001},
        {"colour": "red"},
        {"poses": "guessed"},
    ],
)
def test_options_that_do_not_fit_are_refused_in_words(options: dict[str, Any]) -> None:
    with pytest.raises(OptionsError):
        make_mapping(options)


def test_the_obstacle_node_takes_no_options() -> None:
    with pytest.raises(OptionsError, match="colour"):
        make_obstacles({"colour": "red"})
