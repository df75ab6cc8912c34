# Generated from m600.skillset by `skillwing generate`. Do not edit: change the skillset instead.
# ruff: noqa: N802 - results keep the names that the skillset gives them
"""How goals of mocked skills of `m600` go, for tests and for missions without a robot.

script(takeoff=[TakeoffMock.ended_AT_ALTITUDE(delay=0.5)])
"""

from __future__ import annotations

from skillwing.services.mocking import MockRun, MockScript
from skillwing.services.mocking.typed import Delay, Runs, SkillMock, StopDelay, scripted

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


class TakeoffMock(SkillMock[None, TakeoffFeedback]):
    """How one goal of a mocked `takeoff` goes."""

    @classmethod
    def ended_AT_ALTITUDE(
        cls,
        *,
        feedback: TakeoffFeedback | None = None,
        delay: Delay = 1.0,
        stop_delay: StopDelay = 0.0,
    ) -> MockRun:
        """End as a success, `delay` seconds after the dispatch."""
        return cls.ended("AT_ALTITUDE", feedback=feedback, delay=delay, stop_delay=stop_delay)

    @classmethod
    def ended_BLOCKED(
        cls,
        *,
        feedback: TakeoffFeedback | None = None,
        delay: Delay = 1.0,
        stop_delay: StopDelay = 0.0,
    ) -> MockRun:
        """End as a failure, `delay` seconds after the dispatch."""
        return cls.ended("BLOCKED", feedback=feedback, delay=delay, stop_delay=stop_delay)

    @classmethod
    def ended_ABORTED(
        cls,
        *,
        feedback: TakeoffFeedback | None = None,
        delay: Delay = 1.0,
        stop_delay: StopDelay = 0.0,
    ) -> MockRun:
        """End as a failure, `delay` seconds after the dispatch."""
        return cls.ended("ABORTED", feedback=feedback, delay=delay, stop_delay=stop_delay)


class LandMock(SkillMock[None, LandFeedback]):
    """How one goal of a mocked `land` goes."""

    @classmethod
    def ended_LANDED(
        cls,
        *,
        feedback: LandFeedback | None = None,
        delay: Delay = 1.0,
        stop_delay: StopDelay = 0.0,
    ) -> MockRun:
        """End as a success, `delay` seconds after the dispatch."""
        return cls.ended("LANDED", feedback=feedback, delay=delay, stop_delay=stop_delay)

    @classmethod
    def ended_BLOCKED(
        cls,
        *,
        feedback: LandFeedback | None = None,
        delay: Delay = 1.0,
        stop_delay: StopDelay = 0.0,
    ) -> MockRun:
        """End as a failure, `delay` seconds after the dispatch."""
        return cls.ended("BLOCKED", feedback=feedback, delay=delay, stop_delay=stop_delay)


class HoverMock(SkillMock[None, HoverFeedback]):
    """How one goal of a mocked `hover` goes."""

    @classmethod
    def ended_DONE(
        cls,
        *,
        feedback: HoverFeedback | None = None,
        delay: Delay = 1.0,
        stop_delay: StopDelay = 0.0,
    ) -> MockRun:
        """End as a success, `delay` seconds after the dispatch."""
        return cls.ended("DONE", feedback=feedback, delay=delay, stop_delay=stop_delay)


class GotoMock(SkillMock[GotoOutputs, GotoFeedback]):
    """How one goal of a mocked `goto` goes."""

    @classmethod
    def ended_ARRIVED(
        cls,
        output: GotoOutputs | None = None,
        *,
        feedback: GotoFeedback | None = None,
        delay: Delay = 1.0,
        stop_delay: StopDelay = 0.0,
    ) -> MockRun:
        """End as a success, `delay` seconds after the dispatch."""
        return cls.ended("ARRIVED", output=output, feedback=feedback, delay=delay, stop_delay=stop_delay)

    @classmethod
    def ended_BLOCKED(
        cls,
        output: GotoOutputs | None = None,
        *,
        feedback: GotoFeedback | None = None,
        delay: Delay = 1.0,
        stop_delay: StopDelay = 0.0,
    ) -> MockRun:
        """End as a failure, `delay` seconds after the dispatch."""
        return cls.ended("BLOCKED", output=output, feedback=feedback, delay=delay, stop_delay=stop_delay)

    @classmethod
    def ended_ABORTED(
        cls,
        output: GotoOutputs | None = None,
        *,
        feedback: GotoFeedback | None = None,
        delay: Delay = 1.0,
        stop_delay: StopDelay = 0.0,
    ) -> MockRun:
        """End as a failure, `delay` seconds after the dispatch."""
        return cls.ended("ABORTED", output=output, feedback=feedback, delay=delay, stop_delay=stop_delay)


class GotoStraightMock(SkillMock[GotoStraightOutputs, GotoStraightFeedback]):
    """How one goal of a mocked `goto_straight` goes."""

    @classmethod
    def ended_ARRIVED(
        cls,
        output: GotoStraightOutputs | None = None,
        *,
        feedback: GotoStraightFeedback | None = None,
        delay: Delay = 1.0,
        stop_delay: StopDelay = 0.0,
    ) -> MockRun:
        """End as a success, `delay` seconds after the dispatch."""
        return cls.ended("ARRIVED", output=output, feedback=feedback, delay=delay, stop_delay=stop_delay)

    @classmethod
    def ended_BLOCKED(
        cls,
        output: GotoStraightOutputs | None = None,
        *,
        feedback: GotoStraightFeedback | None = None,
        delay: Delay = 1.0,
        stop_delay: StopDelay = 0.0,
    ) -> MockRun:
        """End as a failure, `delay` seconds after the dispatch."""
        return cls.ended("BLOCKED", output=output, feedback=feedback, delay=delay, stop_delay=stop_delay)

    @classmethod
    def ended_ABORTED(
        cls,
        output: GotoStraightOutputs | None = None,
        *,
        feedback: GotoStraightFeedback | None = None,
        delay: Delay = 1.0,
        stop_delay: StopDelay = 0.0,
    ) -> MockRun:
        """End as a failure, `delay` seconds after the dispatch."""
        return cls.ended("ABORTED", output=output, feedback=feedback, delay=delay, stop_delay=stop_delay)


class ReturnHomeMock(SkillMock[None, ReturnHomeFeedback]):
    """How one goal of a mocked `return_home` goes."""

    @classmethod
    def ended_ARRIVED(
        cls,
        *,
        feedback: ReturnHomeFeedback | None = None,
        delay: Delay = 1.0,
        stop_delay: StopDelay = 0.0,
    ) -> MockRun:
        """End as a success, `delay` seconds after the dispatch."""
        return cls.ended("ARRIVED", feedback=feedback, delay=delay, stop_delay=stop_delay)

    @classmethod
    def ended_ABORTED(
        cls,
        *,
        feedback: ReturnHomeFeedback | None = None,
        delay: Delay = 1.0,
        stop_delay: StopDelay = 0.0,
    ) -> MockRun:
        """End as a failure, `delay` seconds after the dispatch."""
        return cls.ended("ABORTED", feedback=feedback, delay=delay, stop_delay=stop_delay)


class RotateHeadMock(SkillMock[None, RotateHeadFeedback]):
    """How one goal of a mocked `rotate_head` goes."""

    @classmethod
    def ended_ALIGNED(
        cls,
        *,
        feedback: RotateHeadFeedback | None = None,
        delay: Delay = 1.0,
        stop_delay: StopDelay = 0.0,
    ) -> MockRun:
        """End as a success, `delay` seconds after the dispatch."""
        return cls.ended("ALIGNED", feedback=feedback, delay=delay, stop_delay=stop_delay)


class LockHeadMock(SkillMock[None, LockHeadFeedback]):
    """How one goal of a mocked `lock_head` goes."""


class ZedDepthmapMock(SkillMock[None, ZedDepthmapFeedback]):
    """How one goal of a mocked `zed_depthmap` goes."""

    @classmethod
    def ended_NO_DATA(
        cls,
        *,
        feedback: ZedDepthmapFeedback | None = None,
        delay: Delay = 1.0,
        stop_delay: StopDelay = 0.0,
    ) -> MockRun:
        """End as a failure, `delay` seconds after the dispatch."""
        return cls.ended("NO_DATA", feedback=feedback, delay=delay, stop_delay=stop_delay)


class LidarDepthmapMock(SkillMock[None, LidarDepthmapFeedback]):
    """How one goal of a mocked `lidar_depthmap` goes."""

    @classmethod
    def ended_NO_DATA(
        cls,
        *,
        feedback: LidarDepthmapFeedback | None = None,
        delay: Delay = 1.0,
        stop_delay: StopDelay = 0.0,
    ) -> MockRun:
        """End as a failure, `delay` seconds after the dispatch."""
        return cls.ended("NO_DATA", feedback=feedback, delay=delay, stop_delay=stop_delay)


class LidarMappingMock(SkillMock[None, LidarMappingFeedback]):
    """How one goal of a mocked `lidar_mapping` goes."""

    @classmethod
    def ended_DIVERGED(
        cls,
        *,
        feedback: LidarMappingFeedback | None = None,
        delay: Delay = 1.0,
        stop_delay: StopDelay = 0.0,
    ) -> MockRun:
        """End as a failure, `delay` seconds after the dispatch."""
        return cls.ended("DIVERGED", feedback=feedback, delay=delay, stop_delay=stop_delay)


class InspectMock(SkillMock[None, InspectFeedback]):
    """How one goal of a mocked `inspect` goes."""

    @classmethod
    def ended_COMPLETED(
        cls,
        *,
        feedback: InspectFeedback | None = None,
        delay: Delay = 1.0,
        stop_delay: StopDelay = 0.0,
    ) -> MockRun:
        """End as a success, `delay` seconds after the dispatch."""
        return cls.ended("COMPLETED", feedback=feedback, delay=delay, stop_delay=stop_delay)

    @classmethod
    def ended_BLOCKED(
        cls,
        *,
        feedback: InspectFeedback | None = None,
        delay: Delay = 1.0,
        stop_delay: StopDelay = 0.0,
    ) -> MockRun:
        """End as a failure, `delay` seconds after the dispatch."""
        return cls.ended("BLOCKED", feedback=feedback, delay=delay, stop_delay=stop_delay)

    @classmethod
    def ended_ABORTED(
        cls,
        *,
        feedback: InspectFeedback | None = None,
        delay: Delay = 1.0,
        stop_delay: StopDelay = 0.0,
    ) -> MockRun:
        """End as a failure, `delay` seconds after the dispatch."""
        return cls.ended("ABORTED", feedback=feedback, delay=delay, stop_delay=stop_delay)


class StreamMock(SkillMock[None, StreamFeedback]):
    """How one goal of a mocked `stream` goes."""

    @classmethod
    def ended_FPS_LOST(
        cls,
        *,
        feedback: StreamFeedback | None = None,
        delay: Delay = 1.0,
        stop_delay: StopDelay = 0.0,
    ) -> MockRun:
        """End as a failure, `delay` seconds after the dispatch."""
        return cls.ended("FPS_LOST", feedback=feedback, delay=delay, stop_delay=stop_delay)


def script(
    *,
    takeoff: Runs = (),
    land: Runs = (),
    hover: Runs = (),
    goto: Runs = (),
    goto_straight: Runs = (),
    return_home: Runs = (),
    rotate_head: Runs = (),
    lock_head: Runs = (),
    zed_depthmap: Runs = (),
    lidar_depthmap: Runs = (),
    lidar_mapping: Runs = (),
    inspect: Runs = (),
    stream: Runs = (),
    seed: int = 0,
) -> MockScript:
    """For each skill the runs of its goals, one after the other; the last one repeats.

    `Choices` of runs are drawn with the seed. A skill without runs does what it does unscripted.
    """
    return scripted(
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
