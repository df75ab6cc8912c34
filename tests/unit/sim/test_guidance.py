"""Guidance: accepted and refused commands, and changes during a motion."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from flight_rig import WORLD, Rig, airborne

from skillwing.onboard.commands.authority import REVOKED, TAKEN_OVER
from skillwing.onboard.commands.service import CommandRefusedError
from skillwing.onboard.frames.vectors import heading_of, wrap
from skillwing.onboard.guidance import core as solitude
from skillwing.onboard.guidance.body_motion import TOUCHDOWN_SPEED
from skillwing.onboard.guidance.core import LAND_AFTER, GuidanceCore
from skillwing.onboard.guidance.path_monitor import fastest
from skillwing.onboard.topics.guidance import (
    FlyTo,
    GuidanceStatus,
    HoldPosition,
    Land,
    Motion,
    MotionState,
    Orbit,
    Revoked,
    Stop,
    TakeOff,
    Turn,
    YawMode,
)
from skillwing.onboard.topics.obstacles import ObstacleSource, ObstacleStatus
from skillwing.onboard.topics.sensors import Health, SensorStatus
from skillwing.services.protocol import ErrorCode
from skillwing.sim_mujoco.autopilot.autopilot import Mode

EAST = FlyTo(target=(12.0, 0.0, 4.0), speed=2.0, nose=YawMode.ALONG_TRACK)


def refused(rig: Rig, goal: str, motion: Motion, token: int | None = None) -> ErrorCode:
    with pytest.raises(CommandRefusedError) as caught:
        rig.command(goal, motion, token)
    assert caught.value.reply.message
    assert caught.value.reply.help
    return caught.value.reply.code


def test_on_the_ground_only_take_off_is_possible() -> None:
    rig = Rig()
    assert refused(rig, "early", TakeOff(height=4.0, speed=1.0)) is ErrorCode.UNAVAILABLE
    rig.fly(1.1)
    for motion in (EAST, Land(speed=1.0), HoldPosition(), Turn(heading=1.0, lock=False)):
        assert refused(rig, "grounded", motion) is ErrorCode.NOT_ALLOWED
    assert refused(rig, "too high", TakeOff(height=300.0, speed=1.0)) is ErrorCode.NOT_ALLOWED
    rig.sim.autopilot.authority = False
    rig.fly(0.1)
    assert refused(rig, "no authority", TakeOff(height=4.0, speed=1.0)) is ErrorCode.NOT_ALLOWED


@pytest.mark.parametrize("target", [(100.0, 0.0, 4.0), (0.0, 0.0, 0.2), (0.0, 0.0, 31.0), (0.0, -20.0, 4.0)])
def test_targets_outside_the_fence_are_refused(target: tuple[float, float, float]) -> None:
    rig = airborne()
    assert refused(rig, "out", FlyTo(target=target, speed=1.0, nose=YawMode.FREE)) is ErrorCode.NOT_ALLOWED
    assert rig.status.body.goal_id == "takeoff"


def test_stale_tokens_are_refused_for_each_axis_by_itself() -> None:
    rig = airborne()
    rig.command("a", FlyTo(target=(3.0, 0.0, 4.0), speed=1.0, nose=YawMode.FREE), token=10)
    assert refused(rig, "old", HoldPosition(), token=9) is ErrorCode.STALE_TOKEN
    rig.command("b", Turn(heading=1.0, lock=False), token=5)
    assert refused(rig, "old", Turn(heading=0.0, lock=False), token=4) is ErrorCode.STALE_TOKEN
    assert rig.status.body.goal_id == "a"
    assert rig.status.heading.goal_id == "b"


def test_the_same_command_again_changes_nothing() -> None:
    rig = airborne()
    rig.command("a", EAST, token=10)
    rig.fly(2.5)
    before = rig.status
    rig.command("a", EAST, token=10)
    assert rig.status == before


def test_the_nose_turns_along_the_track_before_the_drone_moves() -> None:
    rig = airborne()
    rig.command("north", FlyTo(target=(0.0, 8.0, 4.0), speed=2.0, nose=YawMode.ALONG_TRACK))
    rig.fly_until(MotionState.TURNING, seconds=1.0)
    rig.track.clear()
    rig.fly_until(MotionState.MOVING, seconds=6.0)
    assert max(math.dist(p, (0.0, 0.0, 4.0)) for _, p in rig.track) < 0.3
    assert rig.status.target == (0.0, 8.0, 4.0)
    rig.fly_until(MotionState.DONE)
    assert rig.status.target is None


def test_a_stop_brakes_and_reports_at_rest() -> None:
    rig = airborne()
    rig.command("a", EAST, token=10)
    rig.fly(4.0)
    assert refused(rig, "stranger", Stop(), token=11) is ErrorCode.UNKNOWN_GOAL
    rig.command("a", Stop(), token=10)
    assert rig.status.body.state is MotionState.STOPPING
    rig.fly_until(MotionState.STOPPED, seconds=5.0)
    where = rig.sim.motion.position
    rig.fly(2.0)
    assert math.dist(where, rig.sim.motion.position) < 0.3
    assert where[0] < 10.0


def test_stopping_a_take_off_before_it_leaves_the_ground_ends_on_the_ground() -> None:
    rig = Rig()
    rig.fly(1.1)
    rig.command("up", TakeOff(height=4.0, speed=1.0), token=1)
    rig.command("up", Stop(), token=1)
    rig.fly_until(MotionState.STOPPED, seconds=1.0)
    rig.fly(1.0)
    assert rig.sim.autopilot.on_ground


def test_a_new_holder_takes_over_after_the_old_motion_has_come_to_rest() -> None:
    rig = airborne()
    rig.command("a", EAST)
    rig.fly(4.0)
    rig.command("b", FlyTo(target=(0.0, 0.0, 4.0), speed=2.0, nose=YawMode.FREE))
    assert rig.status.body.state is MotionState.STOPPING
    rig.fly_until(MotionState.DONE)
    assert rig.status.body.goal_id == "b"
    assert math.dist(rig.sim.motion.position, (0.0, 0.0, 4.0)) < 0.3


def test_a_revoked_goal_stops_flying_and_cannot_come_back() -> None:
    rig = airborne()
    rig.command("a", EAST, token=10)
    rig.fly(4.0)
    rig.core.revoke(Revoked(goal_id="a", token=10), rig.sim.t)
    assert rig.status.body.state is MotionState.STOPPING
    rig.fly_until(MotionState.ABORTED, seconds=5.0)
    rig.fly(1.0)
    where = rig.sim.motion.position
    rig.fly(1.0)
    assert math.dist(where, rig.sim.motion.position) < 0.2
    assert refused(rig, "a", EAST, token=10) is ErrorCode.STALE_TOKEN
    rig.command("b", EAST, token=11)
    assert rig.status.body.goal_id == "b"


def test_a_goal_revoked_before_its_motion_began_never_flies() -> None:
    rig = airborne()
    rig.command("a", EAST, token=10)
    rig.fly(4.0)
    rig.command("b", FlyTo(target=(0.0, 0.0, 4.0), speed=2.0, nose=YawMode.FREE), token=11)
    rig.core.revoke(Revoked(goal_id="b", token=11), rig.sim.t)
    rig.fly_until(MotionState.ABORTED, seconds=5.0)
    rig.fly(3.0)
    assert rig.sim.motion.position[0] > 2.0


def test_a_drone_that_nobody_commands_any_more_holds_its_position_and_then_lands() -> None:
    rig = airborne()
    rig.command("takeoff", Stop(), token=1)
    assert not rig.fly(LAND_AFTER - 0.5, lambda: rig.sim.autopilot.mode is not Mode.FOLLOW)
    assert rig.fly(2.0, lambda: rig.sim.autopilot.mode is Mode.HOVER)
    assert "nobody has commanded" in rig.status.body.text
    assert rig.fly(20.0, lambda: rig.sim.autopilot.mode is Mode.OFF)
    assert rig.sim.collisions == 0
    assert not rig.fly(5.0, lambda: rig.sim.autopilot.mode is not Mode.OFF)
    rig.command("again", TakeOff(height=3.0, speed=1.5))
    rig.fly_until(MotionState.DONE)


@pytest.fixture
def patience(monkeypatch: pytest.MonkeyPatch) -> float:
    """Shortened wait of an uncommanded drone [s], for tests of what counts as a commander."""
    monkeypatch.setattr(solitude, "LAND_AFTER", 4.0)
    return 4.0


@pytest.mark.parametrize("phase", [Mode.HOVER, Mode.LAND])
def test_taking_over_a_landing_drone_holds_it_in_place(phase: Mode, patience: float) -> None:
    rig = airborne()
    rig.command("takeoff", Stop(), token=1)
    assert rig.fly(patience + 8.0, lambda: rig.sim.autopilot.mode is phase)
    rig.fly(1.0)
    height = rig.sim.motion.position[2]
    rig.command("a", FlyTo(target=(3.0, 0.0, 4.0), speed=1.0, nose=YawMode.FREE))
    assert rig.fly(0.1, lambda: rig.sim.autopilot.mode is Mode.FOLLOW)
    assert abs(rig.sim.motion.position[2] - height) < 0.2
    rig.fly_until(MotionState.DONE)


def test_a_goal_that_holds_the_position_is_a_commander(patience: float) -> None:
    rig = airborne()
    rig.command("hover", HoldPosition())
    assert not rig.fly(patience + 5.0, lambda: rig.sim.autopilot.mode is not Mode.FOLLOW)


def test_a_goal_that_was_revoked_at_rest_is_none_any_more(patience: float) -> None:
    rig = airborne()
    rig.command("hover", HoldPosition(), token=10)
    rig.core.revoke(Revoked(goal_id="hover", token=10), rig.sim.t)
    assert rig.fly(patience + 2.0, lambda: rig.sim.autopilot.mode is Mode.HOVER)


def test_the_safety_pilot_is_a_commander(patience: float) -> None:
    rig = airborne()
    rig.command("takeoff", Stop(), token=1)
    rig.sim.autopilot.authority = False
    rig.fly(patience + 5.0)
    rig.sim.autopilot.authority = True
    assert not rig.fly(patience - 1.0, lambda: rig.sim.autopilot.mode is Mode.LAND)


def wall_at(x: float, *, blind_after: float = math.inf, blind_for: float = math.inf):
    """An obstacle node that sees a wall across the track at `x`, and goes blind for a while."""

    def report(t: float, status: GuidanceStatus) -> ObstacleStatus | None:
        blind = blind_after <= t < blind_after + blind_for
        along = None if status.target is None else max(x - status.setpoint[0], 0.0)
        stamp = blind_after if blind else t - 0.1
        return ObstacleStatus(
            t=t, source=ObstacleSource.ZED, free_distance=along, horizon=20.0, ahead=along, stamp=stamp
        )

    return report


def test_an_obstacle_on_the_way_ends_the_motion_at_a_distance() -> None:
    rig = airborne()
    rig.obstacles = wall_at(8.0)
    rig.command("a", EAST)
    rig.fly_until(MotionState.BLOCKED)
    assert 1.5 < 8.0 - rig.sim.motion.position[0] < 3.5
    assert "obstacle" in rig.status.body.text
    assert not rig.status.body.no_view
    free = rig.status.free_distance
    assert free is not None
    assert 1.5 < free < 3.5


def test_an_obstacle_behind_the_target_does_not_matter() -> None:
    rig = airborne()
    rig.obstacles = wall_at(13.3)
    rig.command("a", EAST)
    rig.fly_until(MotionState.DONE)


def test_a_view_that_does_not_come_back_blocks_the_motion() -> None:
    rig = airborne()
    rig.obstacles = wall_at(50.0, blind_after=rig.sim.t + 4.0, blind_for=60.0)
    rig.command("a", EAST)
    rig.fly_until(MotionState.WAITING, seconds=8.0)
    rig.fly_until(MotionState.BLOCKED, seconds=20.0)
    assert "no view" in rig.status.body.text
    assert rig.status.body.no_view


def test_without_a_fresh_view_it_waits_and_then_goes_on() -> None:
    rig = airborne()
    rig.obstacles = wall_at(50.0, blind_after=rig.sim.t + 4.0, blind_for=4.0)
    rig.command("a", EAST)
    rig.fly_until(MotionState.WAITING, seconds=8.0)
    where = rig.sim.motion.position
    rig.fly(0.5)
    assert rig.status.body.state is MotionState.WAITING
    assert math.dist(where, rig.sim.motion.position) < 0.3
    rig.fly_until(MotionState.DONE)
    assert math.dist(rig.sim.motion.position, (12.0, 0.0, 4.0)) < 0.3


def range_finder(rig: Rig, status: SensorStatus) -> None:
    rig.core.health(Health(id="health", t=rig.sim.t, sensor="range", status=status), rig.sim.t)


@pytest.mark.parametrize("found_out_after", [-1.0, 2.0])
def test_a_range_finder_that_says_it_has_failed_does_not_bring_the_drone_down_fast(found_out_after: float) -> None:
    """The range finder shows the ground 20 m too low, and reports its failure before or during the landing."""
    rig = airborne(9.0)
    rig.lowers_ground_by = 20.0
    rig.fly(0.1)
    if found_out_after < 0.0:
        range_finder(rig, SensorStatus.FAILED)
    rig.command("down", Land(speed=2.0))
    rig.fly(max(0.0, found_out_after))
    range_finder(rig, SensorStatus.FAILED)
    rig.fly(2.5)
    assert rig.sim.motion.position[2] > 2.0
    assert rig.sim.motion.velocity[2] > -TOUCHDOWN_SPEED - 0.2


def test_a_range_finder_that_is_well_again_is_believed() -> None:
    rig = airborne(9.0)
    range_finder(rig, SensorStatus.FAILED)
    rig.fly(1.0)
    range_finder(rig, SensorStatus.OK)
    rig.fly(0.1)
    rig.command("down", Land(speed=2.0))
    assert rig.fly(3.0, lambda: rig.sim.motion.velocity[2] < -1.0)


def sees(*, across: bool = False, along: float | None = 30.0):
    """An obstacle node that looks along the nose, or to both sides, and finds each way free for `along` metres."""
    source = ObstacleSource.LIDAR if across else ObstacleSource.ZED
    return lambda t, status: ObstacleStatus(
        t=t, source=source, free_distance=along, horizon=14.0, ahead=None, stamp=t - 0.1, across=across
    )


UP, DOWN = (10.0, 0.0, 14.0), (10.0, 0.0, 4.0)


@pytest.mark.parametrize(
    ("height", "motion", "what_first"),
    [
        (4.0, FlyTo(target=UP, speed=2.0, nose=YawMode.ALONG_TRACK), "climb to 14.0 m first"),
        (4.0, FlyTo(target=UP, speed=2.0, nose=YawMode.IN_VIEW), "climb to 14.0 m first"),
        (9.0, FlyTo(target=DOWN, speed=2.0, nose=YawMode.ALONG_TRACK), "descend to 4.0 m first"),
        (4.0, Orbit(center=(9.0, 0.0, 0.0), radius=3.0, height=9.0, laps=1.0, speed=1.0), "climb to 9.0 m first"),
    ],
)
def test_a_way_too_steep_for_the_camera_is_refused(height: float, motion: Motion, what_first: str) -> None:
    rig = airborne(height)
    rig.obstacles = sees()
    rig.fly(0.1)
    with pytest.raises(CommandRefusedError, match=r"the way is \d\d degrees steep, and .* 20 at most") as caught:
        rig.command("steep", motion)
    assert caught.value.reply.code is ErrorCode.NOT_ALLOWED
    assert caught.value.reply.help is not None
    assert what_first in caught.value.reply.help
    rig.obstacles = sees(across=True)
    rig.fly(0.1)
    assert rig.command("by the ring", motion) == "under way"


@pytest.mark.parametrize(
    "motion",
    [
        FlyTo(target=(0.2, 0.0, 14.0), speed=2.0, nose=YawMode.ALONG_TRACK),
        FlyTo(target=(10.0, 0.0, 7.5), speed=2.0, nose=YawMode.ALONG_TRACK),
        FlyTo(target=(0.6, 0.0, 4.5), speed=2.0, nose=YawMode.ALONG_TRACK),
        FlyTo(target=UP, speed=2.0, nose=YawMode.FREE),
    ],
)
def test_what_is_vertical_or_flat_enough_or_leaves_the_nose_alone_is_not_refused(motion: FlyTo) -> None:
    rig = airborne()
    rig.obstacles = sees()
    rig.fly(0.1)
    assert rig.command("a", motion) == "under way"


def test_without_a_depth_map_no_way_is_too_steep() -> None:
    rig = airborne()
    rig.command("a", FlyTo(target=UP, speed=2.0, nose=YawMode.ALONG_TRACK))
    rig.fly_until(MotionState.DONE)


def test_a_way_with_the_nose_along_it_is_not_flown_while_the_camera_does_not_see_it() -> None:
    rig = airborne()
    rig.obstacles = sees(along=None)
    rig.fly(0.1)
    start = rig.sim.motion.position
    rig.command("a", EAST)
    rig.fly_until(MotionState.WAITING, seconds=8.0)
    assert math.dist(start, rig.sim.motion.position) < 1.0
    rig.obstacles = sees()
    rig.fly_until(MotionState.DONE)


ORBIT = Orbit(center=(-3.0, 0.0, 0.0), radius=3.0, height=4.5, laps=0.5, speed=3.0)


def off_the_circle(rig: Rig) -> float:
    x, y, z = rig.sim.motion.position
    return math.hypot(math.hypot(x + 3.0, y) - ORBIT.radius, z - ORBIT.height)


def on_the_round(rig: Rig) -> Rig:
    """Rig on its orbit, with the approach behind it."""
    rig.command("orbit", ORBIT)
    assert rig.fly(20.0, lambda: (rig.status.laps_done or 0.0) > 0.1), rig.status
    return rig


def test_an_orbit_goes_around_with_the_nose_on_the_centre() -> None:
    rig = on_the_round(airborne())
    assert rig.status.way, "others are told where the way bends to"

    def look() -> bool:
        x, y, _ = rig.sim.motion.position
        assert off_the_circle(rig) < 0.35
        assert abs(wrap(heading_of(rig.sim.motion.quaternion) - math.atan2(-y, -x - 3.0))) < 0.45
        return rig.status.body.state is MotionState.DONE

    assert rig.fly(20.0, look), rig.status
    assert rig.status.laps_done == pytest.approx(0.5)
    assert math.dist(rig.sim.motion.position, (-6.0, 0.0, 4.5)) < 0.3
    assert (rig.status.target, rig.status.way) == (None, ())


def test_an_obstacle_on_the_circle_blocks_the_orbit() -> None:
    rig = airborne()

    def report(t: float, status: GuidanceStatus) -> ObstacleStatus | None:
        """Report an obstacle on the circle, a third of a lap from its start."""
        if not status.way:
            return None
        x, y, _ = status.setpoint
        free = max(0.0, (2.0 * math.pi / 3.0 - math.atan2(y, x + 3.0)) * ORBIT.radius)
        return ObstacleStatus(
            t=t, source=ObstacleSource.LIDAR, free_distance=free, horizon=5.0, ahead=None, stamp=t - 0.1, across=True
        )

    rig.obstacles = report
    rig.command("orbit", ORBIT)
    rig.fly_until(MotionState.BLOCKED)
    x, y, _ = rig.sim.motion.position
    assert 1.5 < (2.0 * math.pi / 3.0 - math.atan2(y, x + 3.0)) * ORBIT.radius < 3.5
    assert off_the_circle(rig) < 0.35
    assert 0.0 < (rig.status.laps_done or 0.0) < 0.25


def test_an_orbit_that_loses_its_view_waits_and_flies_the_rest_of_its_laps() -> None:
    rig = airborne()
    blind = (math.inf, math.inf)

    def report(t: float, status: GuidanceStatus) -> ObstacleStatus | None:
        stamp = blind[0] if blind[0] <= t < blind[1] else t - 0.1
        free = 20.0 if status.way or status.target else None
        return ObstacleStatus(
            t=t, source=ObstacleSource.LIDAR, free_distance=free, horizon=5.0, ahead=None, stamp=stamp, across=True
        )

    rig.obstacles = report
    on_the_round(rig)
    blind = (rig.sim.t, rig.sim.t + 4.0)
    rig.fly_until(MotionState.WAITING, seconds=5.0)
    waiting = rig.status.laps_done
    rig.fly_until(MotionState.DONE)
    assert waiting is not None
    assert 0.1 < waiting < 0.5
    assert rig.status.laps_done == pytest.approx(0.5)
    assert math.dist(rig.sim.motion.position, (-6.0, 0.0, 4.5)) < 0.3


def test_an_orbit_that_loses_the_heading_is_aborted() -> None:
    rig = on_the_round(airborne())
    rig.command("turn", Turn(heading=0.0, lock=True))
    rig.fly_until(MotionState.ABORTED, seconds=5.0)
    assert "heading" in rig.status.body.text


@pytest.mark.parametrize(("across", "angle"), [(False, 0.0), (True, math.pi / 2)])
def test_the_nose_can_be_left_to_what_looks_along_the_way(across: bool, angle: float) -> None:
    rig = airborne()
    source = ObstacleSource.LIDAR if across else ObstacleSource.ZED
    rig.obstacles = lambda t, status: ObstacleStatus(
        t=t, source=source, free_distance=30.0, horizon=14.0, ahead=None, stamp=t - 0.1, across=across
    )
    rig.fly(0.1)
    rig.command("north", FlyTo(target=(0.0, 4.0, 4.0), speed=2.0, nose=YawMode.IN_VIEW))
    rig.fly_until(MotionState.MOVING, seconds=6.0)
    off_track = abs(wrap(heading_of(rig.sim.motion.quaternion) - math.pi / 2))
    assert off_track == pytest.approx(angle, abs=0.1)
    rig.fly_until(MotionState.DONE)


def test_it_flies_no_faster_than_the_depth_map_reaches() -> None:
    rig = airborne()
    rig.obstacles = lambda t, status: ObstacleStatus(
        t=t, source=ObstacleSource.LIDAR, free_distance=25.0, horizon=4.0, ahead=None, stamp=t - 0.1, across=True
    )
    rig.fly(0.1)
    rig.command("a", FlyTo(target=(12.0, 0.0, 4.0), speed=5.0, nose=YawMode.FREE))
    fastest_seen = 0.0

    def look() -> bool:
        nonlocal fastest_seen
        fastest_seen = max(fastest_seen, math.hypot(*rig.sim.motion.velocity))
        return rig.status.body.state is MotionState.DONE

    assert rig.fly(30.0, look)
    assert 1.5 < fastest_seen < fastest(4.0) + 0.2


def test_deaf_to_reports_it_flies_on() -> None:
    rig = airborne()
    rig.core = GuidanceCore(WORLD.geofence, watch=False)
    rig.fly(0.1)
    rig.obstacles = wall_at(8.0)
    rig.command("a", EAST, token=100)
    rig.fly_until(MotionState.DONE)


@pytest.mark.parametrize("speed", [2.0, 5.0])
def test_in_gusts_it_stops_in_time_at_every_speed(speed: float) -> None:
    """The wall is visible from 14 m on, in ten reports a second on measurements that are 0.2 s old."""
    rig, wall = Rig(replace(WORLD, obstacles=()), wind=(4.0, 3.0, 0.0), turbulence=8.0), 24.0
    rig.take_off()
    seen: ObstacleStatus | None = None

    def report(t: float, status: GuidanceStatus) -> ObstacleStatus | None:
        nonlocal seen
        if seen is None or t - seen.t >= 0.1:
            x, then = rig.sim.motion.position[0], rig.track[-10][1][0]
            free = wall - x if wall - then < 14.0 else 20.0
            seen = ObstacleStatus(
                t=t, source=ObstacleSource.ZED, free_distance=free, horizon=14.0, ahead=None, stamp=t - 0.2
            )
        return seen

    rig.obstacles = report
    rig.fly(0.3)
    rig.command("a", FlyTo(target=(30.0, 0.0, 4.0), speed=speed, nose=YawMode.ALONG_TRACK))
    rig.fly_until(MotionState.BLOCKED, seconds=60.0)
    nearest = wall - max(place[0] for _, place in rig.track)
    assert 1.0 < nearest < 5.0
    assert max(abs(place[1]) for _, place in rig.track) < 1.0


@pytest.mark.parametrize("by_pilot", [True, False])
def test_a_motion_that_loses_its_authority_says_so(by_pilot: bool) -> None:
    rig = airborne()
    rig.command("goto", EAST, token=10)
    rig.fly(1.0)
    if by_pilot:
        rig.sim.autopilot.authority = False
    else:
        rig.core.revoke(Revoked(goal_id="goto", token=10), rig.sim.t)
    assert rig.fly(10.0, lambda: rig.status.body.state is MotionState.ABORTED)
    assert rig.status.body.authority_lost
    assert rig.status.body.text == (TAKEN_OVER if by_pilot else REVOKED)
