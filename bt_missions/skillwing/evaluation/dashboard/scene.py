"""Dashboard of the UAV: its position, its target, its sensors and its map.

The world is drawn as the robot knows it, from its navigation, sensors and map, never from the simulator's truth.
Streams are thinned on their way into the recording: five minutes of flight stay below 40 MB.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import msgspec
import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from skillwing.evaluation.dashboard.arrangement import SERIES, Arrangement, Front, overview
from skillwing.evaluation.dashboard.companions import Companion, attach_companions
from skillwing.evaluation.dashboard.depth_png import depth_png
from skillwing.evaluation.dashboard.drone_shape import draw_drone
from skillwing.evaluation.dashboard.geometry import (
    DEPTH_LEVELS,
    DEPTH_STEP,
    Throttle,
    by_height,
    depth_levels,
    world_points,
)
from skillwing.evaluation.dashboard.voxel_pieces import VoxelPieces
from skillwing.onboard.sensor_data.directions import depth_directions, lidar_directions
from skillwing.onboard.sensor_data.scans import DepthPicture, LidarScan, measurement_reader
from skillwing.onboard.topics import common, flight, guidance, mapping, navigation, obstacles, sensors, video
from skillwing.onboard.topics.link import LINK_STATUS, LinkStatus
from skillwing.services.bus import Bus
from skillwing.services.bus.reading import message_reader, stream_reader
from skillwing.services.client.causal_feed import follow_records
from skillwing.services.options import read_options
from skillwing.services.protocol import Keys, Message, MissionStatus, Record, RecordKind
from skillwing.services.recording import palette
from skillwing.services.recording.mission_view import MissionPanels, at
from skillwing.sim_mujoco.world.kinds import SiteOptions
from skillwing.sim_mujoco.world.site import Site

M = TypeVar("M", bound=Message)

SCAN_STRIDE = 12
"""Stride of the drawn columns of a scan: 86 x 16 points, about half of them returns."""
PIECE_OF_PATH = 100
"""Number of points in a strip of the path. Strips are short because each new point logs its strip again."""

PATH_COLOURS = {"ZED": "#ff5a4f", "LIDAR": "#4da3ff"}
"""Colours of the path by the source of the depth map, as in the paper's Figure 1; without one it is grey."""
_BLIND = "#b8bec6"
_TARGET = [255, 196, 61]

SEEN_SIZE = 0.5
"""Size of the voxels that show the world while no mapping runs [m]."""
PIXEL_STRIDE, SURE_DEPTH = 8, 14.0
"""Stride of the pixels used from the depth camera, and their largest depth [m]: its error there is half a voxel."""
STEADY = 0.3
"""Largest rotation rate at which scans are accumulated: a delay of 0.1 s would displace them too far [rad/s]."""


class Dashboard:
    """Scene of one UAV. `site` only sets the overview: obstacles are drawn once the robot has seen them.

    others: robots whose drones fly in the same world, and are drawn as well.
    """

    def __init__(self, recording: rr.RecordingStream, *, skillset: str, site: Site, others: Sequence[str] = ()) -> None:
        self._recording = recording
        self._others = others
        self._companions: tuple[Companion, ...] = ()
        self._keys = Keys(skillset)
        self._site = site
        self._arrangement: Arrangement | None = None
        self._front = Front.WORLD
        self._pose: navigation.Navigation | None = None
        self._path: list[common.Vector3] = []
        self._strips = 0
        self._colour = _BLIND
        self._target: common.Vector3 | None = None
        self._waypoint: common.Vector3 | None = None
        self._voxels: VoxelPieces | None = None
        self._seen: VoxelPieces | None = VoxelPieces(SEEN_SIZE)
        self._seen_lately: list[NDArray[np.float32]] = []
        self._pixels: NDArray[np.float32] | None = None
        self._pose_due, self._path_due, self._plan_due = Throttle(0.1), Throttle(0.2), Throttle(0.5)
        self._scan_due, self._depth_due, self._free_due = Throttle(0.25), Throttle(0.2), Throttle(0.2)
        self._clearing_due, self._link_due, self._seen_due = Throttle(5.0), Throttle(0.5), Throttle(1.0)

    # --- arrangement ---------------------------------------------------------------------------------------

    def blueprint(self, panels: MissionPanels) -> rrb.Blueprint:
        self._arrangement = Arrangement(panels, overview(self._site))
        return self._arrangement.blueprint(self._front)

    def _bring_forward(self, front: Front) -> None:
        """Send a new arrangement, once in a run. It resets views that the user has rearranged."""
        if self._arrangement is None or front is self._front:
            return
        self._front = front
        self._recording.send_blueprint(self._arrangement.blueprint(front))

    def attach(self, bus: Bus) -> None:
        self._draw_static()
        self._companions = attach_companions(self._recording, bus, self._others, self._site.ceiling)
        _follow(bus, navigation.NAVIGATION, navigation.Navigation, self._on_navigation)
        bus.subscribe(
            guidance.GUIDANCE_STATUS, message_reader(guidance.GuidanceStatus, self._on_guidance), latest_only=True
        )
        bus.subscribe(
            obstacles.OBSTACLE_STATUS, message_reader(obstacles.ObstacleStatus, self._on_obstacle), latest_only=True
        )
        _follow(bus, flight.BATTERY, flight.Battery, self._on_battery)
        bus.subscribe(sensors.LIDAR, measurement_reader(LidarScan.decode, self._on_scan), latest_only=True)
        bus.subscribe(sensors.ZED_DEPTH, measurement_reader(DepthPicture.decode, self._on_depth), latest_only=True)
        bus.subscribe(video.VIDEO_SHOWN, stream_reader(video.VideoShown, self._on_video), latest_only=True)
        _follow(bus, LINK_STATUS, LinkStatus, self._on_link)
        _follow(bus, video.VIDEO_STATUS, video.VideoStatus, self._on_video_status)
        bus.subscribe(mapping.MAP, stream_reader(mapping.MapHeader, self._on_map))
        bus.subscribe(sensors.health_key("*"), message_reader(sensors.Health, self._on_health), events=True)
        follow_records(bus, self._keys, self._on_record)
        bus.subscribe(self._keys.mission_status, message_reader(MissionStatus, self._on_mission), events=True)

    def restate(self) -> None:
        """Draw again what does not change, and the whole map. The camera follows with its next picture."""
        self._draw_static()
        for each in self._companions:
            each.restate()
        self._pixels = None
        if self._pose is not None and self._voxels is not None:
            at(self._recording, self._pose.t)
            self._draw_voxels("map", self._voxels, self._voxels.pieces)

    def close(self) -> None:
        """Do nothing: the scene ends with its recording."""

    def _draw_static(self) -> None:
        self._recording.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        draw_drone(self._recording, "world/drone")
        for name, colour in SERIES.items():
            label = name.rpartition("/")[2].replace("_", " ")
            lines = rr.SeriesLines(colors=[palette.rgba(colour)], names=[label], widths=[1.8])
            self._recording.log(f"plots/{name}", lines, static=True)

    # --- position and target -------------------------------------------------------------------------------

    def _on_navigation(self, pose: navigation.Navigation) -> None:
        self._pose = pose
        if not self._pose_due.due(pose.t):
            return
        at(self._recording, pose.t)
        w, x, y, z = pose.quaternion
        turn = rr.Quaternion(xyzw=(x, y, z, w))
        self._recording.log("world/drone", rr.Transform3D(translation=pose.position, rotation=turn))
        if self._path_due.due(pose.t):
            self._extend_path(pose.position)
            self._scalar("motion/altitude", pose.position[2])
            self._scalar("motion/speed", math.hypot(*pose.velocity))

    def _extend_path(self, position: common.Vector3) -> None:
        self._path.append(position)
        strip = rr.LineStrips3D([self._path], colors=[palette.rgba(self._colour)], radii=0.09)
        self._recording.log(f"world/path/{self._strips:03}", strip)
        if len(self._path) >= PIECE_OF_PATH:
            self._next_strip()

    def _next_strip(self) -> None:
        self._path = self._path[-1:]
        self._strips += 1

    def _on_guidance(self, status: guidance.GuidanceStatus) -> None:
        if status.target == self._target and (status.target is None or not self._plan_due.due(status.t)):
            return
        self._target = status.target
        at(self._recording, status.t)
        if status.target is None or self._pose is None:
            self._recording.log("world/plan", rr.Clear(recursive=True))
            return
        line = rr.LineStrips3D([[self._pose.position, status.target]], colors=[_TARGET], radii=0.05)
        self._recording.log("world/plan/segment", line)
        self._recording.log("world/plan/target", rr.Points3D([status.target], colors=[_TARGET], radii=0.35))

    def _on_mission(self, status: MissionStatus) -> None:
        if status.goal == self._waypoint:
            return
        self._waypoint = status.goal
        at(self._recording, status.t)
        if status.goal is None:
            self._recording.log("world/waypoint", rr.Clear(recursive=False))
            return
        label = f"waypoint {status.waypoint}/{status.waypoints}"
        marker = rr.Points3D([status.goal], colors=[[255, 255, 255]], radii=0.25, labels=[label], show_labels=True)
        self._recording.log("world/waypoint", marker)

    def _on_record(self, record: Record) -> None:
        """Change the colour of the path at a change of the depth map's source."""
        if record.kind is RecordKind.RESOURCE and record.subject == "depthmap_source":
            self._next_strip()
            self._colour = PATH_COLOURS.get(record.after, _BLIND)

    def _on_obstacle(self, status: obstacles.ObstacleStatus) -> None:
        if not self._free_due.due(status.t):
            return
        at(self._recording, status.t)
        # NaN makes a gap in the curve while the sensor does not look along the way.
        self._scalar("motion/free_distance", math.nan if status.free_distance is None else status.free_distance)

    def _on_battery(self, battery: flight.Battery) -> None:
        at(self._recording, battery.t)
        self._scalar("battery/battery", battery.percent)

    def _scalar(self, name: str, value: float) -> None:
        self._recording.log(f"plots/{name}", rr.Scalars(value))

    # --- sensors -------------------------------------------------------------------------------------------

    def _on_scan(self, scan: LidarScan) -> None:
        header = scan.header
        if self._pose is None or not self._scan_due.due(header.t1):
            return
        directions = lidar_directions(header.columns, header.beams)[::SCAN_STRIDE]
        points = world_points(scan.ranges[::SCAN_STRIDE], directions, header.mount, self._pose)
        at(self._recording, header.t1)
        self._recording.log("world/scan", rr.Points3D(points, colors=[[255, 255, 255]], radii=rr.Radius.ui_points(1.1)))
        self._pile_up(points, self._pose, header.t1)

    def _pile_up(self, points: NDArray[np.float32], pose: navigation.Navigation, t: float) -> None:
        """Accumulate a scan, to show the world while no mapping runs."""
        if self._seen is None or math.hypot(*pose.angular_velocity) > STEADY:
            return
        self._seen_lately.append(points)
        if self._seen_due.due(t):
            changed = self._seen.add(np.vstack(self._seen_lately))
            self._seen_lately.clear()
            self._draw_voxels("seen", self._seen, changed)

    def _on_depth(self, picture: DepthPicture) -> None:
        header = picture.header
        if not self._depth_due.due(header.t):
            return
        depths = picture.depth[::PIXEL_STRIDE, ::PIXEL_STRIDE] / np.float32(1000.0)
        if self._pixels is None or self._pixels.shape[:2] != depths.shape:
            _draw_camera(self._recording, header)
            self._pixels = depth_directions(header)[::PIXEL_STRIDE, ::PIXEL_STRIDE]
        levels = depth_levels(picture.depth)
        at(self._recording, header.t)
        image = rr.EncodedDepthImage(
            depth_png(levels),
            media_type="image/png",
            meter=1.0 / DEPTH_STEP,
            colormap="turbo",
            depth_range=(0.0, DEPTH_LEVELS),
        )
        self._recording.log("world/drone/camera/depth", image)
        if self._pose is not None and self._seen is not None:
            near = np.where(depths < SURE_DEPTH, depths, np.float32(0.0))
            self._pile_up(world_points(near, self._pixels, header.mount, self._pose), self._pose, header.t)

    def _on_video(self, header: video.VideoShown, payload: bytes) -> None:
        """Show the video as the ground station receives it. The first picture brings the video to the front."""
        at(self._recording, header.t)
        self._recording.log("video/ground", rr.EncodedImage(contents=payload, media_type="image/jpeg"))
        self._bring_forward(Front.VIDEO)

    def _on_link(self, link: LinkStatus) -> None:
        if self._link_due.due(link.t):
            at(self._recording, link.t)
            self._scalar("link/bandwidth", link.bandwidth / 1e6)

    def _on_video_status(self, status: video.VideoStatus) -> None:
        at(self._recording, status.t)
        self._scalar("link/received", status.bitrate / 1e6)
        self._scalar("video/fps", status.fps)
        self._scalar("video/SSIM_tenths", math.nan if status.quality is None else 10.0 * status.quality)

    def _on_health(self, health: sensors.Health) -> None:
        """Remove the last picture of a failed camera."""
        if health.sensor == "zed" and health.status is sensors.SensorStatus.FAILED:
            at(self._recording, health.t)
            self._recording.log("world/drone/camera/depth", rr.EncodedDepthImage.cleared())

    # --- map -----------------------------------------------------------------------------------------------

    def _on_map(self, header: mapping.MapHeader, payload: bytes) -> None:
        """Draw the changed pieces of the map. A whole map shows voxels that became free: they are removed only every
        few seconds. The first map replaces the accumulated scans for good."""
        at(self._recording, header.t)
        centres = np.frombuffer(payload, np.float32).reshape(-1, 3)
        if self._voxels is None:
            self._voxels = VoxelPieces(header.voxel_size)
            self._seen = None
            self._recording.log("world/seen", rr.Clear(recursive=True))
        if header.complete and self._clearing_due.due(header.t):
            changed = self._voxels.replace(centres)
        else:
            changed = self._voxels.add(centres)
        self._draw_voxels("map", self._voxels, changed)
        self._scalar("mapped/surface", len(self._voxels) * header.voxel_size**2)

    def _draw_voxels(self, entity: str, voxels: VoxelPieces, changed: set[int]) -> None:
        for number in sorted(changed):
            piece = voxels.centres(number)
            points = rr.Points3D(piece, colors=by_height(piece, self._site.ceiling), radii=voxels.size * 0.5)
            self._recording.log(f"world/{entity}/{number:03}", points)


class SceneOptions(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Options of `make_scene`. site: of the overview; default: the usual courtyard. others: robots in its world."""

    skillset: str = "m600"
    site: SiteOptions = SiteOptions()
    others: tuple[str, ...] = ()


def make_scene(recording: rr.RecordingStream, options: dict[str, Any]) -> Dashboard:
    """The dashboard that `SceneOptions` describe. Raises OptionsError."""
    wanted = read_options(options, SceneOptions)
    return Dashboard(recording, skillset=wanted.skillset, site=wanted.site.site(), others=wanted.others)


def _follow(bus: Bus, key: str, kind: type[M], show: Callable[[M], None]) -> None:
    bus.subscribe(key, message_reader(kind, show), latest_only=True)


def _draw_camera(recording: rr.RecordingStream, header: sensors.DepthHeader) -> None:
    """Log the pinhole model of the halved picture."""
    pinhole = rr.Pinhole(
        resolution=(header.width / 2, header.height / 2),
        focal_length=(header.fx / 2, header.fy / 2),
        principal_point=(header.cx / 2, header.cy / 2),
        camera_xyz=rr.ViewCoordinates.FLU,
        image_plane_distance=2.0,
    )
    recording.log("world/drone/camera", pinhole, rr.Transform3D(translation=header.mount), static=True)
