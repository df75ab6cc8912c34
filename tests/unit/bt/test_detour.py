"""The route planner: laws for every world, and walls that are found stop by stop."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from skillwing.bt_missions.planning.detour import NARROWER, Position, RoutePlanner, bearing, crab_heading, wrap
from skillwing.bt_missions.planning.known_space import (
    MARGIN,
    OBSTACLE_RADIUS,
    STOPPED_BEFORE,
    TIP_RADIUS,
    KnownSpace,
    Point,
)

metres = st.floats(-20.0, 20.0)
points = st.tuples(metres, metres)
angles = st.floats(-math.pi, math.pi)
INFLATED = OBSTACLE_RADIUS + TIP_RADIUS + MARGIN
AREA = (-15.0, -25.0, 35.0, 25.0)
STOPS_TO_ONE = 41
"""Most blocked legs to one waypoint."""
LEGS_TO_ONE = 200


def along(a: Point, b: Point, step: float = 0.05) -> list[Point]:
    count = max(1, math.ceil(math.dist(a, b) / step))
    return [(a[0] + (b[0] - a[0]) * i / count, a[1] + (b[1] - a[1]) * i / count) for i in range(count + 1)]


class Courtyard:
    """World with exact, instant legs. A leg ends 2 m before an obstacle that is within 1.44 m of it."""

    def __init__(self, *walls: tuple[Point, Point]) -> None:
        self.bricks = [brick for a, b in walls for brick in along(a, b, 0.1)]
        self.nearest = math.inf

    def fly(self, start: Position, target: Position) -> tuple[Position, float | None]:
        """End of the leg, and the free distance if it ended before an obstacle."""
        length = math.dist(start[:2], target[:2])
        if length == 0.0:
            return target, None
        unit = (target[0] - start[0]) / length, (target[1] - start[1]) / length
        hits = [self._along_track(start, unit, brick) for brick in self.bricks]
        ahead = min((hit for hit in hits if hit is not None and hit < length + STOPPED_BEFORE), default=None)
        flown = length if ahead is None else max(0.0, ahead - STOPPED_BEFORE)
        end = (start[0] + unit[0] * flown, start[1] + unit[1] * flown, target[2])
        self.nearest = min([self.nearest, *(self._distance(brick, start, unit, flown) for brick in self.bricks)])
        return (target, None) if ahead is None else (end, ahead - flown)

    @staticmethod
    def _distance(brick: Point, start: Position, unit: Point, flown: float) -> float:
        """Least distance of the leg from a brick."""
        x, y = brick[0] - start[0], brick[1] - start[1]
        track = min(max(x * unit[0] + y * unit[1], 0.0), flown)
        return math.hypot(x - unit[0] * track, y - unit[1] * track)

    @staticmethod
    def _along_track(start: Position, unit: Point, brick: Point) -> float | None:
        x, y = brick[0] - start[0], brick[1] - start[1]
        track, aside = x * unit[0] + y * unit[1], abs(x * unit[1] - y * unit[0])
        return track if aside < 1.44 and track > 0.0 else None


def fly_route(planner: RoutePlanner, world: Courtyard, start: Position, limit: int = 1000) -> int:
    """Fly until the planner has nothing left; returns the number of legs."""
    position, legs = start, 0
    while (target := planner.next_target(position)) is not None:
        legs += 1
        assert legs <= limit, "the route never ends"
        position, ahead = world.fly(position, target)
        if ahead is None:
            planner.arrived()
        else:
            planner.blocked(position, ahead)
    return legs


def test_a_free_route_is_flown_straight() -> None:
    planner = RoutePlanner([(10, 0, 4), (10, 10, 5)])
    assert planner.next_target((0, 0, 4)) == (10, 0, 4)
    planner.arrived()
    assert planner.next_target((10, 0, 4)) == (10, 10, 5)
    planner.arrived()
    assert planner.next_target((10, 10, 5)) is None
    assert (planner.done, planner.reached, planner.given_up) == (True, 2, [])


def test_a_waypoint_underneath_is_not_flown_to() -> None:
    planner = RoutePlanner([(0, 0, 4), (10, 0, 4)])
    assert planner.next_target((0.2, -0.1, 4.1)) == (10, 0, 4)
    assert planner.reached == 1


def test_a_leg_that_was_interrupted_is_given_again() -> None:
    planner = RoutePlanner([(10, 0, 4)])
    assert planner.next_target((0, 0, 4)) == planner.next_target((4, 0, 4)) == (10, 0, 4)


def test_a_pole_on_the_leg_is_passed_and_the_waypoint_reached() -> None:
    world = Courtyard(((15.0, -0.2), (15.0, 0.2)))
    planner = RoutePlanner([(30, 0, 4)])
    fly_route(planner, world, (0, 0, 4))
    assert (planner.reached, planner.given_up) == (1, [])
    assert world.nearest > TIP_RADIUS + 1.0


@pytest.mark.parametrize("shift", [0.0, 1.5, -3.0, 4.0])
def test_a_wall_of_ten_metres_is_found_bump_by_bump_and_passed(shift: float) -> None:
    world = Courtyard(((15.0, shift - 5.0), (15.0, shift + 5.0)))
    planner = RoutePlanner([(30, 0, 4), (0, 0, 4)])
    fly_route(planner, world, (0, 0, 4))
    assert (planner.reached, planner.given_up) == (2, [])
    assert world.nearest > TIP_RADIUS + 0.5


def test_a_dead_end_is_left_again_and_flown_round() -> None:
    world = Courtyard(((16.0, -3.5), (16.0, 3.5)), ((11.0, 3.5), (16.0, 3.5)), ((11.0, -3.5), (16.0, -3.5)))
    planner = RoutePlanner([(26, 0, 4)])
    fly_route(planner, world, (0, 0, 4))
    assert (planner.reached, planner.given_up) == (1, [])
    assert world.nearest > TIP_RADIUS + 0.5


def test_a_waypoint_inside_a_closed_yard_is_given_up_with_its_reason() -> None:
    corners = [(10.0, -5.0), (20.0, -5.0), (20.0, 5.0), (10.0, 5.0), (10.0, -5.0)]
    planner = RoutePlanner([(15, 0, 4), (0, 10, 4)])
    fly_route(planner, Courtyard(*pairwise(corners)), (0, 0, 4))
    assert planner.done
    assert planner.reached == 1
    assert [left.waypoint for left in planner.given_up] == [0]
    assert planner.given_up[0].reason


def wall_with_gaps(*gaps: Point, x: float = 10.0) -> Courtyard:
    """A wall across the whole area, with these openings: where each begins and ends."""
    edges = [-30.0, *(y for gap in sorted(gaps) for y in gap), 30.0]
    return Courtyard(*(((x, low), (x, high)) for low, high in zip(edges[::2], edges[1::2], strict=True)))


@pytest.mark.parametrize("aside", [3.0, -6.0, 9.0, 12.0])
@pytest.mark.parametrize("width", [4.0, 4.5, 5.0, 6.0])
def test_the_only_gap_in_a_wall_is_found(width: float, aside: float) -> None:
    world = wall_with_gaps((aside - width / 2, aside + width / 2))
    planner = RoutePlanner([(20, 0, 4)], area=AREA)
    fly_route(planner, world, (0, 0, 4))
    assert (planner.reached, planner.given_up) == (1, [])
    assert world.nearest > TIP_RADIUS + 0.5


def test_a_gap_that_nothing_fits_through_is_given_up() -> None:
    planner = RoutePlanner([(20, 0, 4)], area=AREA)
    fly_route(planner, wall_with_gaps((4.0, 6.7)), (0, 0, 4), limit=LEGS_TO_ONE)
    assert planner.reached == 0
    assert planner.given_up[0].for_obstacle


@given(
    shifts=st.lists(st.floats(-18.0, 18.0), min_size=2, max_size=2),
    widths=st.lists(st.floats(1.0, 3.5), min_size=2, max_size=2),
)
@settings(max_examples=4, deadline=None)
def test_two_gaps_that_look_like_ways_do_not_keep_the_drone_for_ever(shifts: list[float], widths: list[float]) -> None:
    gaps = [(shift - width / 2, shift + width / 2) for shift, width in zip(sorted(shifts), widths, strict=True)]
    if gaps[1][0] - gaps[0][1] < 1.0:
        gaps = gaps[:1]
    planner = RoutePlanner([(20, 0, 4)], area=AREA)
    fly_route(planner, wall_with_gaps(*gaps), (0, 0, 4), limit=LEGS_TO_ONE)
    assert planner.done


def test_the_end_of_a_leg_with_something_behind_it_is_closed_when_that_is_met_once_more() -> None:
    """The same leg, which ends before the place of the stop, would otherwise be planned for ever."""
    space = KnownSpace()
    for _ in range(2):
        space.add((11.2, 0.0), before=(10.0, 0.0))
    assert [disc.centre for disc in space.narrowed(0.5).discs] == [(11.2, 0.0), (10.0, 0.0)]


def test_no_opening_is_looked_for_in_what_no_sensor_sees() -> None:
    planner = RoutePlanner([(10, 0, 4)], max_detours=2)
    bump(planner, times=3, distance=1000.0)
    assert planner.done


def test_the_margin_is_kept_as_long_as_a_way_with_it_is_left() -> None:
    """Two openings in a wall, one narrower than the margin wants: the drone flies through the wide one."""
    world = wall_with_gaps((-16.0, -6.0), (3.0, 7.0))
    planner = RoutePlanner([(20, 0, 4)], area=AREA)
    position: Position = (0, 0, 4)
    while (target := planner.next_target(position)) is not None:
        for disc in planner.known.discs:
            allowed = min(INFLATED, math.dist(position[:2], disc.centre), math.dist(target[:2], disc.centre))
            nearest = min(math.dist(place, disc.centre) for place in along(position[:2], target[:2]))
            assert nearest >= allowed - 1e-6
        position, ahead = world.fly(position, target)
        planner.arrived() if ahead is None else planner.blocked(position, ahead)
    assert planner.reached == 1


def bump(planner: RoutePlanner, times: int, distance: float, position: Position = (0, 0, 4)) -> None:
    for _ in range(times):
        assert planner.next_target(position) is not None
        planner.blocked(position, distance)


def test_a_route_is_fulfilled_when_every_waypoint_was_reached() -> None:
    planner = RoutePlanner([(10, 0, 4), (10, 10, 4)])
    fly_route(planner, Courtyard(), (0, 0, 4))
    assert planner.fulfilled
    assert planner.summary == "2 of 2 waypoints reached"


def test_a_route_is_fulfilled_when_only_obstacles_kept_the_drone_from_a_waypoint() -> None:
    corners = [(10.0, -5.0), (20.0, -5.0), (20.0, 5.0), (10.0, 5.0), (10.0, -5.0)]
    planner = RoutePlanner([(15, 0, 4), (0, 10, 4)])
    fly_route(planner, Courtyard(*pairwise(corners)), (0, 0, 4))
    assert planner.fulfilled
    assert planner.summary.startswith("1 of 2 waypoints reached (1 given up: ")


def test_a_route_of_which_no_waypoint_was_reached_is_not_fulfilled() -> None:
    planner = RoutePlanner([(10, 0, 4)], max_detours=2, max_narrow=0)
    bump(planner, times=3, distance=2.0)
    assert planner.done
    assert planner.given_up[0].for_obstacle
    assert not planner.fulfilled


def test_a_waypoint_given_up_for_something_unseen_leaves_the_route_unfulfilled() -> None:
    planner = RoutePlanner([(10, 0, 4), (0, 8, 4)], max_detours=2)
    bump(planner, times=2, distance=2.0)
    bump(planner, times=1, distance=1000.0)
    while planner.next_target((0, 0, 4)) is not None:
        planner.arrived()
    assert (planner.reached, planner.given_up[0].for_obstacle) == (1, False)
    assert "no sensor saw" in planner.summary
    assert not planner.fulfilled


@pytest.mark.parametrize(("rest", "fulfilled"), [([], True), ([(10, 10, 4)], False)])
def test_coming_home_is_no_route_unless_nothing_else_was_asked_for(rest: list[Position], fulfilled: bool) -> None:
    planner = RoutePlanner([*rest, (0, 0, 4)], max_detours=0, max_narrow=0)
    for _ in rest:
        bump(planner, times=1, distance=2.0)
    while planner.next_target((5, 5, 4)) is not None:
        planner.arrived()
    assert planner.reached == 1
    assert planner.fulfilled is fulfilled


def test_a_drone_that_drifted_away_plans_to_the_same_waypoint_again() -> None:
    planner = RoutePlanner([(20, 0, 4)])
    planner.next_target((0, 0, 4))
    planner.blocked((8, 0, 4), 2.0)
    assert planner.next_target((8, 0, 4)) != (20, 0, 4), "round the obstacle"
    planner.moved()
    assert planner.next_target((20, -12, 4)) == (20, 0, 4)
    assert planner.waypoint == 0


@given(short=st.floats(-0.3, 0.3), aside=st.floats(-0.3, 0.3), direction=angles)
def test_what_stands_behind_the_end_of_a_leg_is_remembered_there(short: float, aside: float, direction: float) -> None:
    """The drone may be short of the end, past it or beside it, with the end in any direction."""
    along, across = (math.cos(direction), math.sin(direction)), (-math.sin(direction), math.cos(direction))
    planner = RoutePlanner([(20.0 * along[0], 20.0 * along[1], 4.0)])
    planner.next_target((0.0, 0.0, 4.0))
    stood = tuple((20.0 - short) * a + aside * b for a, b in zip(along, across, strict=True))
    planner.blocked((stood[0], stood[1], 4.0), 1.2)
    (disc,) = planner.known.discs
    assert disc.centre == pytest.approx((stood[0] + 1.2 * along[0], stood[1] + 1.2 * along[1]))


def test_a_route_under_way_is_not_fulfilled() -> None:
    planner = RoutePlanner([(10, 0, 4), (10, 10, 4)])
    planner.next_target((0, 0, 4))
    planner.arrived()
    assert not planner.fulfilled


def test_detours_stay_in_the_area() -> None:
    world = Courtyard(((15.0, -2.0), (15.0, 2.0)))
    planner = RoutePlanner([(30, 0, 4)], area=(-1.0, -20.0, 31.0, 1.0))
    position: Position = (0, 0, 4)
    while (target := planner.next_target(position)) is not None:
        assert target[1] <= 1.0
        position, ahead = world.fly(position, target)
        planner.arrived() if ahead is None else planner.blocked(position, ahead)
    assert planner.reached == 1


def test_heights_change_evenly_along_a_detour() -> None:
    planner = RoutePlanner([(20, 0, 10)])
    planner.next_target((0, 0, 0))
    planner.blocked((8, 0, 4), 2.0)
    heights = [4.0]
    position: Position = (8, 0, 4)
    while (target := planner.next_target(position)) is not None:
        heights.append(target[2])
        position = target
        planner.arrived()
    assert heights == sorted(heights)
    assert heights[-1] == 10
    assert len(heights) > 2


@given(start=points, goal=points, seen=st.lists(points, max_size=8))
@settings(max_examples=60, deadline=None)
def test_a_path_keeps_clear_of_every_known_disc(start: Point, goal: Point, seen: list[Point]) -> None:
    space = KnownSpace()
    for place in seen:
        space.add(place)
    path = space.path(start, goal)
    if path is None:
        return
    assert path[-1] == goal
    for disc in space.discs:
        wanted = disc.radius + TIP_RADIUS + MARGIN
        wanted = min(wanted, math.dist(start, disc.centre), math.dist(goal, disc.centre))
        for a, b in pairwise([start, *path]):
            assert min(math.dist(place, disc.centre) for place in along(a, b)) >= wanted - 1e-6


@given(start=points, goal=points, seen=st.lists(points, max_size=12), room=st.sampled_from(NARROWER))
@settings(max_examples=60, deadline=None)
def test_a_narrow_path_keeps_its_room_from_every_place_where_the_drone_was_stopped(
    start: Point, goal: Point, seen: list[Point], room: float
) -> None:
    """Every stop counts, also each of two that are so close that they count as one obstacle."""
    places = [*seen, *((x + 0.3, y) for x, y in seen)]
    space = KnownSpace()
    for place in places:
        space.add(place)
    path = space.narrowed(room).path(start, goal)
    if path is None:
        return
    for a, b in pairwise([start, *path]):
        for place in places:
            wanted = min(room, math.dist(start, place), math.dist(goal, place))
            assert min(math.dist(step, place) for step in along(a, b)) >= wanted - 1e-6


@given(start=points, goal=points, seen=points)
@settings(max_examples=60, deadline=None)
def test_one_obstacle_never_closes_the_way(start: Point, goal: Point, seen: Point) -> None:
    space = KnownSpace()
    space.add(seen)
    if math.dist(goal, seen) >= INFLATED:
        assert space.path(start, goal) is not None


@given(
    route=st.lists(st.tuples(metres, metres, st.floats(1.0, 20.0)), max_size=4),
    ends=st.lists(st.one_of(st.none(), st.floats(0.0, 10.0)), max_size=30),
)
@settings(max_examples=40, deadline=None)
def test_every_route_ends_whatever_happens_on_it(route: list[Position], ends: list[float | None]) -> None:
    """List `ends` holds the ends of the first legs; all later legs are blocked."""
    planner = RoutePlanner(route)
    position: Position = (0.0, 0.0, 4.0)
    legs = 0
    while (target := planner.next_target(position)) is not None:
        end = ends[legs] if legs < len(ends) else 1.0
        legs += 1
        assert legs <= len(ends) + len(route) * STOPS_TO_ONE
        if end is None:
            position = target
            planner.arrived()
        else:
            planner.blocked(position, end)
    assert planner.reached + len(planner.given_up) == len(route)


@given(direction=angles, heading=angles)
def test_the_crab_heading_is_across_the_motion_and_the_nearer_of_the_two(direction: float, heading: float) -> None:
    crab = crab_heading(direction, heading)
    assert abs(math.cos(crab - direction)) < 1e-9
    assert abs(wrap(crab - heading)) <= math.pi / 2 + 1e-9
    assert -math.pi - 1e-9 <= crab <= math.pi + 1e-9


def test_a_vertical_leg_has_no_bearing() -> None:
    assert bearing((1, 1, 2), (1, 1, 9)) is None
    assert bearing((0, 0, 0), (0, 3, 0)) == pytest.approx(math.pi / 2)
