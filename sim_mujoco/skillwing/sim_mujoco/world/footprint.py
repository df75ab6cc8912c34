"""Plan-view outlines of obstacles and their distances, in metres, in the world frame (ENU)."""

from __future__ import annotations

import math
from dataclasses import dataclass

Point = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Footprint:
    """An oriented rectangle in plan view; a disc is a zero-sized rectangle with a radius.

    `half` holds the half extents along the rectangle's own axes, and `yaw` turns them. `radius` grows the outline on
    every side; poles and tree crowns have only a radius.
    """

    centre: Point
    half: Point = (0.0, 0.0)
    yaw: float = 0.0
    radius: float = 0.0

    def distance_to(self, point: Point) -> float:
        """Distance from the outline to a point; 0 inside."""
        x, y = self._local(point)
        gap = math.hypot(max(abs(x) - self.half[0], 0.0), max(abs(y) - self.half[1], 0.0))
        return max(gap - self.radius, 0.0)

    def distance_to_segment(self, start: Point, end: Point) -> float:
        """Distance from the outline to the segment start-end; 0 where they meet."""
        a, b = self._local(start), self._local(end)
        if _segment_crosses_box(a, b, self.half):
            return 0.0
        hx, hy = self.half
        corners = [_point_to_segment((sx * hx, sy * hy), a, b) for sx in (-1, 1) for sy in (-1, 1)]
        ends = [math.hypot(max(abs(x) - hx, 0.0), max(abs(y) - hy, 0.0)) for x, y in (a, b)]
        return max(min(corners + ends) - self.radius, 0.0)

    def distance_to_footprint(self, other: Footprint) -> float:
        """Distance between two outlines; 0 where they touch or one lies within the other."""
        if self.distance_to(other.centre) == 0.0 or other.distance_to(self.centre) == 0.0:
            return 0.0
        corners = other.corners()
        edges = zip(corners, (*corners[1:], corners[0]), strict=True)
        return max(min(self.distance_to_segment(a, b) for a, b in edges) - other.radius, 0.0)

    def corners(self) -> tuple[Point, Point, Point, Point]:
        """The rectangle's corners, counter-clockwise, without the radius."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        hx, hy = self.half

        def at(x: float, y: float) -> Point:
            return self.centre[0] + c * x - s * y, self.centre[1] + s * x + c * y

        return at(-hx, -hy), at(hx, -hy), at(hx, hy), at(-hx, hy)

    def _local(self, point: Point) -> Point:
        dx, dy = point[0] - self.centre[0], point[1] - self.centre[1]
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return c * dx + s * dy, c * dy - s * dx


def _point_to_segment(point: Point, a: Point, b: Point) -> float:
    ux, uy = b[0] - a[0], b[1] - a[1]
    length2 = ux * ux + uy * uy
    along = 0.0 if length2 == 0.0 else ((point[0] - a[0]) * ux + (point[1] - a[1]) * uy) / length2
    along = min(max(along, 0.0), 1.0)
    return math.hypot(point[0] - a[0] - along * ux, point[1] - a[1] - along * uy)


def _segment_crosses_box(a: Point, b: Point, half: Point) -> bool:
    """Slab test of a segment against the box |x| <= half[0], |y| <= half[1]."""
    enter, leave = 0.0, 1.0
    for axis in (0, 1):
        start, step = a[axis], b[axis] - a[axis]
        if step == 0.0:
            if abs(start) > half[axis]:
                return False
            continue
        near, far = sorted(((-half[axis] - start) / step, (half[axis] - start) / step))
        enter, leave = max(enter, near), min(leave, far)
    return enter <= leave
