"""Obstacle detection as a process: one sensor at a time makes the depth map, chosen by the newest token's goal.

For landings the node also subscribes to the LiDAR, whatever was chosen: its ring sees the ground below the drone.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from skillwing.onboard.commands.authority import CommandAuthority
from skillwing.onboard.commands.service import answer_with, reply_with
from skillwing.onboard.frames.extent import Box
from skillwing.onboard.frames.pose_history import PoseHistory
from skillwing.onboard.frames.vectors import add, to_world
from skillwing.onboard.obstacles.free_space import STALE, FreeSpace, Sighting
from skillwing.onboard.obstacles.landing_memory import LandingMemory
from skillwing.onboard.obstacles.landing_place import ANYWHERE, Below
from skillwing.onboard.obstacles.views import view_of
from skillwing.onboard.sensor_data.directions import RANGE_MOUNT
from skillwing.onboard.sensor_data.names import LIDAR, RANGE, ZED
from skillwing.onboard.sensor_data.scans import DepthPicture, LidarScan, measurement_reader
from skillwing.onboard.topics import common, obstacles, sensors
from skillwing.onboard.topics.guidance import AUTHORITY, GEOFENCE, GUIDANCE_STATUS, Geofence, GuidanceStatus, Revoked
from skillwing.onboard.topics.navigation import NAVIGATION, Navigation
from skillwing.onboard.topics.obstacles import ObstacleSource
from skillwing.services.bus import Bus, Handle, Publisher
from skillwing.services.bus.reading import message_reader
from skillwing.services.options import OptionsError
from skillwing.services.protocol import encode

PERIOD = 0.1


class ObstaclesNode:
    """Shell around `FreeSpace` and `LandingMemory`. It subscribes to the camera only while that is the source."""

    name = "obstacles"
    owns_clock = False
    closes_loop = True

    def __init__(self) -> None:
        self._source = ObstacleSource.NONE
        self._holder = CommandAuthority("obstacle source")
        self._space = FreeSpace()
        self._ground = LandingMemory()
        self._poses = PoseHistory()
        self._waiting: dict[ObstacleSource, LidarScan | DepthPicture] = {}
        self._camera: Handle | None = None
        self._failed: set[str] = set()
        self._navigation: Navigation | None = None
        self._guidance: GuidanceStatus | None = None
        self._targets = ANYWHERE
        self._bus: Bus | None = None
        self._status: Publisher | None = None

    def attach(self, bus: Bus) -> None:
        self._bus = bus
        self._status = bus.advertise(obstacles.OBSTACLE_STATUS)
        bus.subscribe(NAVIGATION, message_reader(Navigation, self._on_navigation))
        bus.subscribe(GUIDANCE_STATUS, message_reader(GuidanceStatus, self._on_guidance), latest_only=True)
        bus.subscribe(GEOFENCE, message_reader(Geofence, self._on_geofence), events=True)
        bus.subscribe(sensors.RANGE, message_reader(sensors.Range, self._on_range))
        bus.subscribe(AUTHORITY, message_reader(Revoked, self._on_revoked), events=True)
        bus.subscribe(sensors.health_key("*"), message_reader(sensors.Health, self._on_health), events=True)
        self._follow(ObstacleSource.LIDAR)
        bus.serve(obstacles.OBSTACLE_COMMAND, answer_with(obstacles.SelectObstacleSource, self._on_command))
        bus.serve(obstacles.LANDING_PLACE, reply_with(common.Empty, lambda _: self._landing_place()))
        bus.every(PERIOD, self._publish)

    def detach(self) -> None:
        """Guidance notices by itself that reports have ended."""

    # --- commands --------------------------------------------------------------------------------------------

    def _on_command(self, command: obstacles.SelectObstacleSource) -> str:
        holder = self._holder
        holder.require_fresh(command.goal_id, command.token)
        if command.source is not ObstacleSource.NONE:
            holder.take(command.goal_id, command.token)
            self._switch_to(command.source)
            return f"the source is {command.source}"
        if holder.goal == command.goal_id:
            self._release()
            return "released"
        return "this goal does not hold the source; nothing to release"

    def _on_revoked(self, revoked: Revoked) -> None:
        if self._holder.revoke(revoked.goal_id, revoked.token):
            self._release()

    def _release(self) -> None:
        self._holder.goal = None
        self._switch_to(ObstacleSource.NONE)

    def _switch_to(self, source: ObstacleSource) -> None:
        assert self._bus is not None
        if source is self._source:
            return
        self._source = source
        if self._camera is not None:
            self._camera.cancel()
            self._camera = None
            self._waiting.pop(ObstacleSource.ZED, None)
        if source is not ObstacleSource.NONE:
            self._space.forget()
        if source is ObstacleSource.ZED:
            self._camera = self._follow(source)
        # Guidance must not begin a segment by a report of the previous source.
        self._publish()

    # --- measurements ----------------------------------------------------------------------------------------

    def _follow(self, sensor: ObstacleSource) -> Handle:
        assert self._bus is not None
        key, read, _ = _SENSORS[sensor]
        reader = measurement_reader(read, lambda measurement: self._on_measurement(sensor, measurement))
        return self._bus.subscribe(key, reader, latest_only=True)

    def _on_navigation(self, navigation: Navigation) -> None:
        self._navigation = navigation
        self._poses.add(navigation)
        self._ground.follow(navigation)
        for sensor in list(self._waiting):
            self._place_measurement(sensor)

    def _on_guidance(self, status: GuidanceStatus) -> None:
        self._guidance = status

    def _on_geofence(self, fence: Geofence) -> None:
        self._targets = Box(fence.low, fence.high)

    def _on_health(self, health: sensors.Health) -> None:
        if health.status is sensors.SensorStatus.FAILED:
            self._failed.add(health.sensor)
            if health.sensor == RANGE:
                self._ground.drop_line()
        else:
            self._failed.discard(health.sensor)

    def _on_range(self, seen: sensors.Range) -> None:
        navigation = self._navigation
        if seen.distance is None or RANGE in self._failed or navigation is None or not navigation.valid:
            return
        if abs(seen.t - navigation.t) > PERIOD:
            return
        down = (RANGE_MOUNT[0], RANGE_MOUNT[1], RANGE_MOUNT[2] - seen.distance)
        self._ground.meet(seen.t, add(navigation.position, to_world(navigation.quaternion, down)))

    def _on_measurement(self, sensor: ObstacleSource, measurement: LidarScan | DepthPicture) -> None:
        if sensor is self._source or self._ground_wants(sensor, measurement):
            self._waiting[sensor] = measurement
            self._place_measurement(sensor)

    def _place_measurement(self, sensor: ObstacleSource) -> None:
        """Place the waiting measurement once the drone's pose is known up to its end."""
        measurement = self._waiting[sensor]
        if not self._poses.covers(*measurement.span):
            return
        del self._waiting[sensor]
        view = view_of(measurement)
        sighting = Sighting(view, measurement.place(self._poses, view.sight))
        if sensor is self._source:
            self._space.see(sighting)
        if self._ground_wants(sensor, measurement):
            self._ground.see(sensor, sighting)

    def _ground_wants(self, sensor: ObstacleSource, measurement: LidarScan | DepthPicture) -> bool:
        """Test for a measurement for the landing memory: the memory needs it, and the sensor has not failed."""
        return _SENSORS[sensor].name not in self._failed and self._ground.wants(sensor, measurement.span[1])

    # --- publications ----------------------------------------------------------------------------------------

    def _publish(self) -> None:
        assert self._bus is not None
        assert self._status is not None
        t, navigation = self._bus.now(), self._navigation
        status = obstacles.ObstacleStatus(
            t=t, source=self._source, free_distance=None, horizon=0.0, ahead=None, stamp=None
        )
        if navigation is not None and self._source is not ObstacleSource.NONE:
            outlook = self._space.outlook(t, navigation.position, navigation.velocity, navigation.heading, self._way(t))
            status = obstacles.ObstacleStatus(
                t=t,
                source=self._source,
                free_distance=outlook.free_distance,
                horizon=outlook.horizon,
                ahead=outlook.ahead,
                stamp=outlook.stamp,
                across=self._source in LOOKING_ACROSS,
            )
        self._status.put(encode(status))

    def _landing_place(self) -> obstacles.LandingPlace:
        assert self._bus is not None
        t, navigation = self._bus.now(), self._navigation
        known = self._ground.known(t)
        if known is None or navigation is None or not navigation.valid or t - navigation.t > STALE:
            return obstacles.LandingPlace(place=None, text="nothing is known of the ground below")
        below = Below(known, navigation.position)
        if not below.taken:
            seen = "the ground below is free" if below.seen else "nothing is known to stand below"
            return obstacles.LandingPlace(place=None, text=seen)
        place = below.free_place(self._targets)
        elsewhere = "no free ground is known within reach"
        if place is not None:
            elsewhere = f"free ground is known {math.dist(place[:2], navigation.position[:2]):.0f} m away"
        return obstacles.LandingPlace(
            place=place, taken=True, text=f"something stands below, or it is steep; {elsewhere}"
        )

    def _way(self, t: float) -> tuple[common.Vector3, ...]:
        """Corners of the way that guidance flies, by its own status."""
        guidance = self._guidance
        if guidance is None or guidance.target is None or t - guidance.t > STALE:
            return ()
        return guidance.way or (guidance.target,)


def make_obstacles(options: dict[str, Any]) -> ObstaclesNode:
    """The obstacle node; it takes no options. Raises OptionsError if there are any."""
    if options:
        raise OptionsError(f"the obstacle node takes no options; remove {', '.join(sorted(options))}")
    return ObstaclesNode()


class _Sensor(NamedTuple):
    """Key and decoder of a sensor's measurements, and its name in messages of health."""

    key: str
    read: Callable[[bytes, bytes], LidarScan | DepthPicture]
    name: str


_SENSORS = {
    ObstacleSource.ZED: _Sensor(sensors.ZED_DEPTH, DepthPicture.decode, ZED),
    ObstacleSource.LIDAR: _Sensor(sensors.LIDAR, LidarScan.decode, LIDAR),
}

LOOKING_ACROSS = frozenset({ObstacleSource.LIDAR})
"""Sources that look to the sides of the nose."""
