"""The stream skill on real managers, real codec and emulated link, through zones where the link narrows."""

from __future__ import annotations

from typing import Any

import pytest
from filmed_flight import SPEED, FilmedFlight

from skillwing.m600.bridge.node import RobotBridge
from skillwing.m600.robot import ROBOT
from skillwing.m600.skills.stream import StreamManager
from skillwing.onboard.topics import faults, video
from skillwing.onboard.video.ground import make_ground
from skillwing.onboard.video.node import make_video
from skillwing.services.protocol import RecordKind, decode, encode
from skillwing.services.testing import SkillsetInProcess
from skillwing.sim_mujoco.link.node import make_link

SKILLSET = ROBOT.load_skillset()
ENTRY, EXIT = 18.0, 34.0


def zone(**effect: float) -> dict[str, Any]:
    """A zone across the way, and what it does to the link."""
    return {"low": [ENTRY, -50.0, -10.0], "high": [EXIT, 50.0, 50.0], "edge": 4.0, **effect}


class Streaming(SkillsetInProcess):
    """A robot in the air that can stream, and everything that was said of its video."""

    def __init__(self, **link: Any) -> None:
        self.film = FilmedFlight()
        nodes = (
            RobotBridge(SKILLSET),
            self.film,
            make_video({}),
            make_link({"bandwidth": 2.0, **link}),
            make_ground({}),
        )
        super().__init__(SKILLSET, hooks=[StreamManager], mocks=False, nodes=nodes)
        self.seen: list[video.VideoStatus] = []
        self.rates: list[video.EncoderStatus] = []
        self.packets = 0
        watch = self.network.bus("onlooker")
        watch.subscribe(video.VIDEO_STATUS, lambda s: self.seen.append(decode(s.payload, video.VideoStatus)))
        watch.subscribe(video.VIDEO_ENCODER, lambda s: self.rates.append(decode(s.payload, video.EncoderStatus)))
        watch.subscribe(video.VIDEO_SENT, lambda s: setattr(self, "packets", self.packets + 1))
        self._onlooker = watch
        self.run(2.5)

    def break_link(self, kind: str, *, on: bool, magnitude: float | None = None) -> None:
        fault = faults.SetLinkFault(kind=kind, on=on, magnitude=magnitude)
        self._onlooker.ask(faults.LINK_FAULT, encode(fault), lambda answer: None)


def test_a_mild_zone_costs_detail_and_the_stream_goes_on() -> None:
    with Streaming(zones=[zone(bandwidth=0.35, loss=0.01)]) as drone:
        goal = drone.start_skill("stream", min_fps=8.0, min_quality=0.6)
        drone.run(EXIT / SPEED + 7.0)
        goal.assert_running()
        before = [r.bitrate for r in drone.rates if r.t < ENTRY / SPEED - 3.0]
        within = [r.bitrate for r in drone.rates if ENTRY / SPEED + 1.0 < r.t < EXIT / SPEED - 1.0]
        assert max(within) < 0.4 * max(before)
        assert drone.rates[-1].bitrate > 2.0 * max(within), "the rate recovers behind the zone"
        settled = [s for s in drone.seen if s.t > 6.0]
        assert sum(s.fps >= 8.0 and (s.quality or 0.0) >= 0.6 for s in settled) > 0.9 * len(settled)
        assert goal.progress.bitrate > 0.3
        reading = drone.reading("link_bandwidth")
        assert not reading.stale
        assert 1.5 < reading.value < 2.0


def test_a_critical_zone_ends_it_once_and_the_camera_is_left_alone() -> None:
    with Streaming(zones=[zone(bandwidth=0.008)]) as drone:
        goal = drone.start_skill("stream", min_fps=8.0, min_quality=0.6)
        drone.run((ENTRY - 6.0) / SPEED - 3.0)
        goal.assert_running()
        goal.assert_ended("S_FPS_LOST", within=14.0)
        assert goal.causes[:2] == ["link LOST", "link_status LOST"]
        assert drone.film.position[0] < EXIT, "inside of the zone, not behind it"
        drone.assert_states(link_status="LOST")
        drone.run(4.0)
        taken = drone.film.pictures
        drone.run(5.0)
        assert drone.film.pictures == taken


def test_a_cut_that_is_short_is_survived_with_a_new_keyframe() -> None:
    with Streaming() as drone:
        goal = drone.start_skill("stream", min_fps=8.0, min_quality=0.6)
        drone.run(6.0)
        drone.break_link("cut", on=True)
        drone.run(2.0)
        assert goal.progress is not None
        drone.break_link("cut", on=False)
        drone.run(6.0)
        goal.assert_running()
        assert drone.seen[-1].fps >= 8.0
        assert not drone.seen[-1].wants_keyframe


def test_a_link_that_is_cut_for_good_ends_it() -> None:
    with Streaming() as drone:
        goal = drone.start_skill("stream")
        drone.run(6.0)
        drone.break_link("cut", on=True)
        goal.assert_ended("S_FPS_LOST", within=8.0, reason="no report of the ground for 1.5 s")
        drone.assert_states(link_status="LOST")
        assert goal.causes[:3] == ["link cut", "link LOST", "link_status LOST"]
        assert goal.causes[-1] == "stream S_FPS_LOST"
        drone.start_skill("stream").assert_ended("NR")


def test_an_end_after_the_links_recovery_is_put_down_to_the_link_all_the_same() -> None:
    with Streaming() as drone:
        goal = drone.start_skill("stream")
        drone.run(6.0)
        drone.break_link("cut", on=True)
        drone.run(4.4)
        drone.break_link("cut", on=False)
        goal.assert_ended("S_FPS_LOST", within=2.0, reason="of 10 pictures a second")
        drone.assert_states(link_status="GOOD")
        assert goal.causes == ["link cut", "link LOST", "link_status LOST", "video BAD", "stream S_FPS_LOST"]


def test_a_slow_link_that_counts_as_good_is_named_by_its_fault_and_the_measured_figures() -> None:
    with Streaming() as drone:
        goal = drone.start_skill("stream", min_quality=0.99)
        drone.break_link("narrow", on=True, magnitude=0.55)
        goal.assert_ended("S_FPS_LOST", within=20.0)
        drone.assert_states(link_status="GOOD")
        assert goal.causes == ["link narrow", "video BAD", "stream S_FPS_LOST"]


def test_a_fault_of_the_link_has_the_time_of_its_injection() -> None:
    with Streaming() as drone:
        drone.run(1.0)
        drone.break_link("cut", on=True)
        injected = drone.now()
        drone.run(1.0)
        [fault] = [record for record in drone.history.records if record.kind is RecordKind.FAULT]
        assert fault.t == pytest.approx(injected, abs=0.01)


def test_a_camera_that_goes_blind_ends_it() -> None:
    with Streaming() as drone:
        goal = drone.start_skill("stream")
        drone.run(6.0)
        drone.film.blind = True
        goal.assert_ended("S_FPS_LOST", within=8.0, reason="0.0 of 10 pictures a second, no picture")
        assert goal.causes == ["video BAD", "stream S_FPS_LOST"], "the link was good"


def test_an_interrupted_stream_stops_at_once() -> None:
    with Streaming() as drone:
        goal = drone.start_skill("stream")
        drone.run(4.0)
        goal.interrupt().assert_ended("IT", forced=False)
        drone.run(0.1)
        sent = drone.packets
        drone.run(2.0)
        assert drone.packets == sent


def test_more_pictures_than_the_camera_takes_are_refused() -> None:
    with Streaming() as drone:
        drone.start_skill("stream", min_fps=40.0).assert_ended("NV", reason="up to 25")


def test_without_the_video_process_it_says_so() -> None:
    with Streaming() as drone:
        goal = drone.start_skill("stream")
        drone.run(4.0)
        drone.kill("video")
        goal.assert_ended("ERROR", within=8.0, reason="has not reported")
