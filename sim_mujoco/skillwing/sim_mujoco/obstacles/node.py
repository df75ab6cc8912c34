"""Obstacle detection as a process: one sensor at a time, chosen by whoever holds the newest token."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from skillwing.services.bus import Bus, Handle, Publisher
from skillwing.services.bus.reading import message_reader
from skillwing.services.protocol import encode
from skillwing.sim_mujoco import topics
from skillwing.sim_mujoco.axis import Axis
from skillwing.sim_mujoco.frames.pose_history import PoseHistory
from skillwing.sim_mujoco.messaging import answer_with, stream_reader
from skillwing.sim_mujoco.obstacles.free_space import STALE, FreeSpace, Sighting
from skillwing.sim_mujoco.obstacles.landing_place import Below
from skillwing.sim_mujoco.obstacles.views import view_of
from skillwing.sim_mujoco.options import OptionsError
from skillwing.sim_mujoco.sensors.scans import DepthPicture, LidarScan
from skillwing.sim_mujoco.topics import ObstacleSource

PERIOD = 0.1


class ObstaclesNode:
    """Shell around `FreeSpace`. It listens to a sensor only while that is the chosen source."""

    name = "obstacles"
    owns_clock = False
    closes_loop = True

    def __init__(self) -> None:
        self._source = ObstacleSource.NONE
        self._holder = Axis("obstacle source")
        self._space = FreeSpace()
        self._poses = PoseHistory()
        self._waiting: LidarScan | DepthPicture | None = None
        self._sensor: Handle | None = None
        self._navigation: topics.Navigation | None = None
        self._guidance: topics.GuidanceStatus | None = None
        self._bus: Bus | None = None
        self._status: Publisher | None = None

    def attach(self, bus: Bus) -> None:
        self._bus = bus
        self._status = bus.advertise(topics.OBSTACLE_STATUS)
        bus.subscribe(topics.NAVIGATION, message_reader(topics.Navigation, self._on_navigation))
        bus.subscribe(
            topics.GUIDANCE_STATUS, message_reader(topics.GuidanceStatus, self._on_guidance), latest_only=True
        )
        bus.subscribe(topics.AUTHORITY, message_reader(topics.Revoked, self._on_revoked), events=True)
        bus.serve(topics.OBSTACLE_COMMAND, answer_with(topics.SelectObstacleSource, self._on_command))
        bus.serve(topics.LANDING_PLACE, lambda request: request.reply(encode(self._landing_place())))
        bus.every(PERIOD, self._publish)

    def detach(self) -> None:
        """Guidance notices by itself that reports have ended."""

    # --- who chooses -----------------------------------------------------------------------------------------

    def _on_command(self, command: topics.SelectObstacleSource) -> str:
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

    def _on_revoked(self, revoked: topics.Revoked) -> None:
        if self._holder.revoke(revoked.goal_id, revoked.token):
            self._release()

    def _release(self) -> None:
        self._holder.goal = None
        self._switch_to(ObstacleSource.NONE)

    def _switch_to(self, source: ObstacleSource) -> None:
        assert self._bus is not None
        if source is self._source:
            return
        self._source, self._waiting = source, None
        if self._sensor is not None:
            self._sensor.cancel()
            self._sensor = None
        if source is not ObstacleSource.NONE:
            # What the last source has seen is kept until then, for whoever wants to land meanwhile.
            self._space.forget()
            key, read = _STREAMS[source]
            self._sensor = self._bus.subscribe(key, stream_reader(read, self._on_measurement), latest_only=True)
        # Guidance must not begin a segment on the word of a source that has just been given up.
        self._publish()

    # --- what it sees ----------------------------------------------------------------------------------------

    def _on_navigation(self, navigation: topics.Navigation) -> None:
        self._navigation = navigation
        self._poses.add(navigation)
        self._place_measurement()

    def _on_guidance(self, status: topics.GuidanceStatus) -> None:
        self._guidance = status

    def _on_measurement(self, measurement: LidarScan | DepthPicture) -> None:
        self._waiting = measurement
        self._place_measurement()

    def _place_measurement(self) -> None:
        """A measurement waits until the drone's pose is known up to its end."""
        measurement = self._waiting
        if measurement is None or not self._poses.covers(*measurement.span):
            return
        self._waiting = None
        view = view_of(measurement)
        self._space.see(Sighting(view, measurement.place(self._poses, view.sight)))

    # --- what it says ----------------------------------------------------------------------------------------

    def _publish(self) -> None:
        assert self._bus is not None
        assert self._status is not None
        t, navigation = self._bus.now(), self._navigation
        status = topics.ObstacleStatus(
            t=t, source=self._source, free_distance=None, horizon=0.0, ahead=None, stamp=None
        )
        if navigation is not None and self._source is not ObstacleSource.NONE:
            outlook = self._space.outlook(t, navigation.position, navigation.velocity, navigation.heading, self._way(t))
            status = topics.ObstacleStatus(
                t=t,
                source=self._source,
                free_distance=outlook.free_distance,
                horizon=outlook.horizon,
                ahead=outlook.ahead,
                stamp=outlook.stamp,
                across=self._source in LOOKING_ACROSS,
            )
        self._status.put(encode(status))

    def _landing_place(self) -> topics.LandingPlace:
        assert self._bus is not None
        t, navigation = self._bus.now(), self._navigation
        known = self._space.known(t)
        if known is None or navigation is None or not navigation.valid or t - navigation.t > STALE:
            return topics.LandingPlace(place=None, text="nothing is known of the ground below")
        below = Below(known, navigation.position)
        if not below.taken:
            return topics.LandingPlace(place=None, text="nothing is known to stand below")
        place = below.free_place()
        text = "no free ground is known nearby" if place is None else "something stands below; here the ground is free"
        return topics.LandingPlace(place=place, text=text)

    def _way(self, t: float) -> tuple[topics.Vector3, ...]:
        """Where guidance is flying, as far as it says so itself."""
        guidance = self._guidance
        if guidance is None or guidance.target is None or t - guidance.t > STALE:
            return ()
        return guidance.way or (guidance.target,)


def make_obstacles(options: dict[str, Any]) -> ObstaclesNode:
    """The obstacle node; it takes no options. Raises OptionsError if there are any."""
    if options:
        raise OptionsError(f"the obstacle node takes no options; remove {', '.join(sorted(options))}")
    return ObstaclesNode()


_STREAMS: dict[ObstacleSource, tuple[str, Callable[[bytes, bytes], LidarScan | DepthPicture]]] = {
    ObstacleSource.ZED: (topics.ZED_DEPTH, DepthPicture.decode),
    ObstacleSource.LIDAR: (topics.LIDAR, LidarScan.decode),
}

LOOKING_ACROSS = frozenset({ObstacleSource.LIDAR})
"""Sources that look to the sides of the nose."""
