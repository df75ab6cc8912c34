"""One trial of the video: a drone that circles the inspection building and streams over an emulated link.

Everything but the flight is the real code: camera, codec, link, ground, the skill's manager, the resource manager.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from skillwing.m600.bridge.node import RobotBridge
from skillwing.m600.robot import ROBOT
from skillwing.m600.skills.stream import StreamManager
from skillwing.onboard.commands.service import answer_with
from skillwing.onboard.frames.vectors import Motion
from skillwing.onboard.topics import video
from skillwing.onboard.topics.link import LINK_STATUS, LinkStatus
from skillwing.onboard.topics.truth import TRUTH, Truth
from skillwing.onboard.video.ground import make_ground
from skillwing.onboard.video.node import make_video
from skillwing.onboard.video.receiver import VideoReceiver
from skillwing.services.bus import Bus
from skillwing.services.bus.reading import stream_reader
from skillwing.services.protocol import decode, encode
from skillwing.services.testing import SkillsetInProcess
from skillwing.sim_mujoco.camera.camera import Camera, Picture, camera_header
from skillwing.sim_mujoco.camera.feed import CameraFeed
from skillwing.sim_mujoco.link.node import make_link
from skillwing.sim_mujoco.world.rays import RayScene
from skillwing.sim_mujoco.world.world import World, make_world

SPEED = 2.0
SLICE = 0.02
START_UP = 2.5
SKILLSET = ROBOT.load_skillset()


class Album:
    """A camera that keeps its pictures, because all trials fly the same way at the same times."""

    def __init__(self, world: World) -> None:
        self._camera = Camera(world, RayScene(world.triangles()))
        self._pictures: dict[float, Picture] = {}

    def picture(self, motion: Motion, tilt: float = 0.0) -> Picture:
        if motion.t not in self._pictures:
            self._pictures[motion.t] = self._camera.picture(motion, tilt)
        return self._pictures[motion.t]


class Orbiter:
    """Stand-in for the simulator: a level drone on the inspection's circle, with its nose to the centre."""

    name = "orbiter"
    owns_clock = False

    def __init__(self, world: World, album: Album) -> None:
        assert world.site.target is not None
        self._target = world.site.target
        self._feed = CameraFeed(lambda: album, np.random.default_rng(0))

    def attach(self, bus: Bus) -> None:
        self._bus = bus
        self._truth, self._pictures = bus.advertise(TRUTH), bus.advertise(video.CAMERA)
        bus.serve(video.CAMERA_COMMAND, answer_with(video.ControlCamera, self._control))
        bus.every(SLICE, self._look)
        bus.every(0.05, self._tell)

    def detach(self) -> None:
        pass

    def motion(self, t: float) -> Motion:
        target = self._target
        angle = math.pi + SPEED * t / target.radius
        place = (
            target.centre[0] + target.radius * math.cos(angle),
            target.centre[1] + target.radius * math.sin(angle),
            target.height,
        )
        half = (angle + math.pi) / 2
        return Motion(t, place, (0.0, 0.0, 0.0), (math.cos(half), 0.0, 0.0, math.sin(half)), (0.0, 0.0, 0.0))

    def _control(self, wanted: video.ControlCamera) -> str:
        self._feed.request(self._bus.now(), wanted.fps, wanted.seconds, wanted.tilt)
        return ""

    def _look(self) -> None:
        now = self._bus.now()
        shot = self._feed.take(now, self.motion(now))
        if shot is not None:
            self._pictures.put(shot.picture.tobytes(), encode(camera_header(shot.t, shot.tilt)))

    def _tell(self) -> None:
        motion = self.motion(self._bus.now())
        truth = Truth(
            t=motion.t,
            position=motion.position,
            quaternion=motion.quaternion,
            velocity=motion.velocity,
            collisions=0,
            clearance=7.0,
            inside_fence=True,
        )
        self._truth.put(encode(truth))


@dataclass
class Trial:
    """Result of a trial. delays: time of display, and delay of the picture since its capture [s]. ended: result of the
    skill. after: time from its start to its end [s].
    """

    seen: list[video.VideoStatus] = field(default_factory=list)
    aimed: list[video.EncoderStatus] = field(default_factory=list)
    links: list[LinkStatus] = field(default_factory=list)
    delays: list[tuple[float, float]] = field(default_factory=list)
    shown: list[tuple[float, bytes]] = field(default_factory=list)
    ended: str = ""
    after: float = 0.0

    def settled(self, since: float) -> list[video.VideoStatus]:
        return [status for status in self.seen if status.t >= since]


def stream(
    world: World, album: Album, seconds: float, link: dict[str, Any], *, min_fps: float = 10.0, min_quality: float = 0.7
) -> Trial:
    """Stream for `seconds`, or until the skill ends. link: options as in docs/video.md."""
    orbiter, trial = Orbiter(world, album), Trial()
    nodes = (RobotBridge(SKILLSET), orbiter, make_video({}), make_link(link), make_ground({}))
    with SkillsetInProcess(SKILLSET, hooks=[StreamManager], mocks=False, nodes=nodes) as drone:
        watch = drone.network.bus("onlooker")
        watch.subscribe(video.VIDEO_STATUS, lambda s: trial.seen.append(decode(s.payload, video.VideoStatus)))
        watch.subscribe(video.VIDEO_ENCODER, lambda s: trial.aimed.append(decode(s.payload, video.EncoderStatus)))
        watch.subscribe(LINK_STATUS, lambda s: trial.links.append(decode(s.payload, LinkStatus)))

        receiver = VideoReceiver()

        def on_piece(header: video.VideoPacket, data: bytes) -> None:
            now = watch.now()
            picture = receiver.packet(now, header, data)
            if picture is not None:
                trial.delays.append((now, now - picture.t))

        watch.subscribe(video.VIDEO_RECEIVED, stream_reader(video.VideoPacket, on_piece))
        watch.subscribe(video.VIDEO_SHOWN, lambda s: trial.shown.append((watch.now(), s.payload)))
        drone.run(START_UP)
        begun = drone.now()
        goal = drone.start_skill("stream", min_fps=min_fps, min_quality=min_quality)
        while drone.now() < begun + seconds and not goal.done:
            drone.run(0.25)
        trial.ended = goal.terminal.label if goal.done else "goes on"
        trial.after = drone.now() - begun
    return trial


def inspection_world(seed: int) -> World:
    return make_world(seed, "inspection")
