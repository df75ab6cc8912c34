# Generated from m600.skillset by `skillwing generate`. Do not edit: change the skillset instead.
# ruff: noqa: N802 - results keep the names that the skillset gives them
"""Typed mock scripts for skills of `m600`, for tests and for missions without a robot.

script(takeoff=[TakeoffMock.ended_AT_ALTITUDE(delay=0.5)])
"""

from __future__ import annotations

from skillwing.services.mocking import MockRun as _MockRun
from skillwing.services.mocking import MockScript as _MockScript
from skillwing.services.mocking.typed import Delay as _Delay
from skillwing.services.mocking.typed import Runs as _Runs
from skillwing.services.mocking.typed import SkillMock as _SkillMock
from skillwing.services.mocking.typed import StopDelay as _StopDelay
from skillwing.services.mocking.typed import scripted as _scripted

from .types import (
    GotoFeedback,
    GotoOutputs,
    GotoStraightFeedback,
    GotoStraightOutputs,
    HoverFeedback,
    InspectFeedback,
    LandFeedback,
    LidarDepthmapFeedback,
    LidarMappingFeedback,
    LockHeadFeedback,
    ReturnHomeFeedback,
    RotateHeadFeedback,
    StreamFeedback,
    TakeoffFeedback,
    ZedDepthmapFeedback,
)


class TakeoffMock(_SkillMock[None, TakeoffFeedback]):
    """Run of one goal of a mocked `takeoff`."""

    @classmethod
    def ended_AT_ALTITUDE(
        cls,
        *,
        feedback: TakeoffFeedback | None = None,
        delay: _Delay = 1.0,
        stop_delay: _StopDelay = 0.0,
    ) -> _MockRun:
        """End as a success, `delay` seconds after the dispatch."""
        return cls.ended("AT_ALTITUDE", feedback=feedback, delay=delay, stop_delay=stop_delay)

    @classmethod
    def ended_BLOCKED(
        cls,
        *,
        feedback: TakeoffFeedback | None = None,
        delay: _Delay = 1.0,
        stop_delay: _StopDelay = 0.0,
    ) -> _MockRun:
        """End as a failure, `delay` seconds after the dispatch."""
        return cls.ended("BLOCKED", feedback=feedback, delay=delay, stop_delay=stop_delay)

    @classmethod
    def ended_ABORTED(
        cls,
        *,
        feedback: TakeoffFeedback | None = None,
        delay: _Delay = 1.0,
        stop_delay: _StopDelay = 0.0,
    ) -> _MockRun:
        """End as a failure, `delay` seconds after the dispatch."""
        return cls.ended("ABORTED", feedback=feedback, delay=delay, stop_delay=stop_delay)


class LandMock(_SkillMock[None, LandFeedback]):
    """Run of one goal of a mocked `land`."""

    @classmethod
    def ended_LANDED(
        cls,
        *,
        feedback: LandFeedback | None = None,
        delay: _Delay = 1.0,
        stop_delay: _StopDelay = 0.0,
    ) -> _MockRun:
        """End as a success, `delay` seconds after the dispatch."""
        return cls.ended("LANDED", feedback=feedback, delay=delay, stop_delay=stop_delay)

    @classmethod
    def ended_BLOCKED(
        cls,
        *,
        feedback: LandFeedback | None = None,
        delay: _Delay = 1.0,
        stop_delay: _StopDelay = 0.0,
    ) -> _MockRun:
        """End as a failure, `delay` seconds after the dispatch."""
        return cls.ended("BLOCKED", feedback=feedback, delay=delay, stop_delay=stop_delay)


class HoverMock(_SkillMock[None, HoverFeedback]):
    """Run of one goal of a mocked `hover`."""

    @classmethod
    def ended_DONE(
        cls,
        *,
        feedback: HoverFeedback | None = None,
        delay: _Delay = 1.0,
        stop_delay: _StopDelay = 0.0,
    ) -> _MockRun:
        """End as a success, `delay` seconds after the dispatch."""
        return cls.ended("DONE", feedback=feedback, delay=delay, stop_delay=stop_delay)


class GotoMock(_SkillMock[GotoOutputs, GotoFeedback]):
    """Run of one goal of a mocked `goto`."""

    @classmethod
    def ended_ARRIVED(
        cls,
        output: GotoOutputs | None = None,
        *,
        feedback: GotoFeedback | None = None,
        delay: _Delay = 1.0,
        stop_delay: _StopDelay = 0.0,
    ) -> _MockRun:
        """End as a success, `delay` seconds after the dispatch."""
        return cls.ended("ARRIVED", output=output, feedback=feedback, delay=delay, stop_delay=stop_delay)

    @classmethod
    def ended_BLOCKED(
        cls,
        output: GotoOutputs | None = None,
        *,
        feedback: GotoFeedback | None = None,
        delay: _Delay = 1.0,
        stop_delay: _StopDelay = 0.0,
    ) -> _MockRun:
        """End as a failure, `delay` seconds after the dispatch."""
        return cls.ended("BLOCKED", output=output, feedback=feedback, delay=delay, stop_delay=stop_delay)

    @classmethod
    def ended_ABORTED(
        cls,
        output: GotoOutputs | None = None,
        *,
        feedback: GotoFeedback | None = None,
        delay: _Delay = 1.0,
        stop_delay: _StopDelay = 0.0,
    ) -> _MockRun:
        """End as a failure, `delay` seconds after the dispatch."""
        return cls.ended("ABORTED", output=output, feedback=feedback, delay=delay, stop_delay=stop_delay)


class GotoStraightMock(_SkillMock[GotoStraightOutputs, GotoStraightFeedback]):
    """Run of one goal of a mocked `goto_straight`."""

    @classmethod
    def ended_ARRIVED(
        cls,
        output: GotoStraightOutputs | None = None,
        *,
        feedback: GotoStraightFeedback | None = None,
        delay: _Delay = 1.0,
        stop_delay: _StopDelay = 0.0,
    ) -> _MockRun:
        """End as a success, `delay` seconds after the dispatch."""
        return cls.ended("ARRIVED", output=output, feedback=feedback, delay=delay, stop_delay=stop_delay)

    @classmethod
    def ended_BLOCKED(
        cls,
        output: GotoStraightOutputs | None = None,
        *,
        feedback: GotoStraightFeedback | None = None,
        delay: _Delay = 1.0,
        stop_delay: _StopDelay = 0.0,
    ) -> _MockRun:
        """End as a failure, `delay` seconds after the dispatch."""
        return cls.ended("BLOCKED", output=output, feedback=feedback, delay=delay, stop_delay=stop_delay)

    @classmethod
    def ended_ABORTED(
        cls,
        output: GotoStraightOutputs | None = None,
        *,
        feedback: GotoStraightFeedback | None = None,
        delay: _Delay = 1.0,
        stop_delay: _StopDelay = 0.0,
    ) -> _MockRun:
        """End as a failure, `delay` seconds after the dispatch."""
        return cls.ended("ABORTED", output=output, feedback=feedback, delay=delay, stop_delay=stop_delay)


class ReturnHomeMock(_SkillMock[None, ReturnHomeFeedback]):
    """Run of one goal of a mocked `return_home`."""

    @classmethod
    def ended_ARRIVED(
        cls,
        *,
        feedback: ReturnHomeFeedback | None = None,
        delay: _Delay = 1.0,
        stop_delay: _StopDelay = 0.0,
    ) -> _MockRun:
        """End as a success, `delay` seconds after the dispatch."""
        return cls.ended("ARRIVED", feedback=feedback, delay=delay, stop_delay=stop_delay)

    @classmethod
    def ended_ABORTED(
        cls,
        *,
        feedback: ReturnHomeFeedback | None = None,
        delay: _Delay = 1.0,
        stop_delay: _StopDelay = 0.0,
    ) -> _MockRun:
        """End as a failure, `delay` seconds after the dispatch."""
        return cls.ended("ABORTED", feedback=feedback, delay=delay, stop_delay=stop_delay)


class RotateHeadMock(_SkillMock[None, RotateHeadFeedback]):
    """Run of one goal of a mocked `rotate_head`."""

    @classmethod
    def ended_ALIGNED(
        cls,
        *,
        feedback: RotateHeadFeedback | None = None,
        delay: _Delay = 1.0,
        stop_delay: _StopDelay = 0.0,
    ) -> _MockRun:
        """End as a success, `delay` seconds after the dispatch."""
        return cls.ended("ALIGNED", feedback=feedback, delay=delay, stop_delay=stop_delay)


class LockHeadMock(_SkillMock[None, LockHeadFeedback]):
    """Run of one goal of a mocked `lock_head`."""


class ZedDepthmapMock(_SkillMock[None, ZedDepthmapFeedback]):
    """Run of one goal of a mocked `zed_depthmap`."""

    @classmethod
    def ended_NO_DATA(
        cls,
        *,
        feedback: ZedDepthmapFeedback | None = None,
        delay: _Delay = 1.0,
        stop_delay: _StopDelay = 0.0,
    ) -> _MockRun:
        """End as a failure, `delay` seconds after the dispatch."""
        return cls.ended("NO_DATA", feedback=feedback, delay=delay, stop_delay=stop_delay)


class LidarDepthmapMock(_SkillMock[None, LidarDepthmapFeedback]):
    """Run of one goal of a mocked `lidar_depthmap`."""

    @classmethod
    def ended_NO_DATA(
        cls,
        *,
        feedback: LidarDepthmapFeedback | None = None,
        delay: _Delay = 1.0,
        stop_delay: _StopDelay = 0.0,
    ) -> _MockRun:
        """End as a failure, `delay` seconds after the dispatch."""
        return cls.ended("NO_DATA", feedback=feedback, delay=delay, stop_delay=stop_delay)


class LidarMappingMock(_SkillMock[None, LidarMappingFeedback]):
    """Run of one goal of a mocked `lidar_mapping`."""

    @classmethod
    def ended_DIVERGED(
        cls,
        *,
        feedback: LidarMappingFeedback | None = None,
        delay: _Delay = 1.0,
        stop_delay: _StopDelay = 0.0,
    ) -> _MockRun:
        """End as a failure, `delay` seconds after the dispatch."""
        return cls.ended("DIVERGED", feedback=feedback, delay=delay, stop_delay=stop_delay)


class InspectMock(_SkillMock[None, InspectFeedback]):
    """Run of one goal of a mocked `inspect`."""

    @classmethod
    def ended_COMPLETED(
        cls,
        *,
        feedback: InspectFeedback | None = None,
        delay: _Delay = 1.0,
        stop_delay: _StopDelay = 0.0,
    ) -> _MockRun:
        """End as a success, `delay` seconds after the dispatch."""
        return cls.ended("COMPLETED", feedback=feedback, delay=delay, stop_delay=stop_delay)

    @classmethod
    def ended_BLOCKED(
        cls,
        *,
        feedback: InspectFeedback | None = None,
        delay: _Delay = 1.0,
        stop_delay: _StopDelay = 0.0,
    ) -> _MockRun:
        """End as a failure, `delay` seconds after the dispatch."""
        return cls.ended("BLOCKED", feedback=feedback, delay=delay, stop_delay=stop_delay)

    @classmethod
    def ended_ABORTED(
        cls,
        *,
        feedback: InspectFeedback | None = None,
        delay: _Delay = 1.0,
        stop_delay: _StopDelay = 0.0,
    ) -> _MockRun:
        """End as a failure, `delay` seconds after the dispatch."""
        return cls.ended("ABORTED", feedback=feedback, delay=delay, stop_delay=stop_delay)


class StreamMock(_SkillMock[None, StreamFeedback]):
    """Run of one goal of a mocked `stream`."""

    @classmethod
    def ended_FPS_LOST(
        cls,
        *,
        feedback: StreamFeedback | None = None,
        delay: _Delay = 1.0,
        stop_delay: _StopDelay = 0.0,
    ) -> _MockRun:
        """End as a failure, `delay` seconds after the dispatch."""
        return cls.ended("FPS_LOST", feedback=feedback, delay=delay, stop_delay=stop_delay)


def script(
    *,
    takeoff: _Runs = (),
    land: _Runs = (),
    hover: _Runs = (),
    goto: _Runs = (),
    goto_straight: _Runs = (),
    return_home: _Runs = (),
    rotate_head: _Runs = (),
    lock_head: _Runs = (),
    zed_depthmap: _Runs = (),
    lidar_depthmap: _Runs = (),
    lidar_mapping: _Runs = (),
    inspect: _Runs = (),
    stream: _Runs = (),
    seed: int = 0,
) -> _MockScript:
    """A script with the runs of goals by skill, in sequence; the last run repeats.

    `Choices` of runs are drawn with the seed. A skill without runs ends as without a script.
    """
    return _scripted(
        {
            "takeoff": takeoff,
            "land": land,
            "hover": hover,
            "goto": goto,
            "goto_straight": goto_straight,
            "return_home": return_home,
            "rotate_head": rotate_head,
            "lock_head": lock_head,
            "zed_depthmap": zed_depthmap,
            "lidar_depthmap": lidar_depthmap,
            "lidar_mapping": lidar_mapping,
            "inspect": inspect,
            "stream": stream,
        },
        seed,
    )
