"""The video process on a bus: whose stream it is."""

from __future__ import annotations

import pytest

from skillwing.onboard.topics.common import Done
from skillwing.onboard.topics.video import VIDEO_COMMAND, ControlVideo
from skillwing.onboard.video.node import make_video
from skillwing.services.bus import Answer, Answered, Refused
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.protocol import ErrorCode, decode, encode


class Ground:
    """Client that commands the video, and reads the replies."""

    def __init__(self) -> None:
        self._network = InProcessNetwork()
        self._network.attach(make_video({}))
        self._bus = self._network.bus("commander")

    def ask(self, goal: str, token: int, *, run: bool = True, fps: float = 10.0, quality: float = 0.7) -> Answer:
        answers: list[Answer] = []
        command = ControlVideo(goal_id=goal, token=token, run=run, min_fps=fps, min_quality=quality)
        self._bus.ask(VIDEO_COMMAND, encode(command), answers.append)
        self._network.run_until(lambda: bool(answers), 2.0)
        return answers[0]


def told(answer: Answer) -> str:
    assert isinstance(answer, Answered)
    return decode(answer.payload, Done).text


@pytest.mark.parametrize(("fps", "quality"), [(0.0, 0.7), (31.0, 0.7), (10.0, -0.1), (10.0, 1.1)])
def test_a_start_that_is_refused_takes_nothing_from_who_streams(fps: float, quality: float) -> None:
    ground = Ground()
    assert told(ground.ask("first", 1)) == "streaming"
    refused = ground.ask("second", 2, fps=fps, quality=quality)
    assert isinstance(refused, Refused)
    assert refused.error.code is ErrorCode.BAD_REQUEST
    assert told(ground.ask("first", 1, run=False)) == "stopped"


def test_a_newer_goal_takes_the_video_over_for_good() -> None:
    ground = Ground()
    ground.ask("first", 1)
    assert told(ground.ask("second", 2)) == "streaming"
    late = ground.ask("first", 1, run=False)
    assert isinstance(late, Refused)
    assert late.error.code is ErrorCode.STALE_TOKEN
    assert told(ground.ask("second", 2, run=False)) == "stopped"
