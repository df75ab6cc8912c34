# Generated from m600.skillset by `skillwing generate`. Do not edit: change the skillset instead.
# ruff: noqa: N802 - results keep the names that the skillset gives them
"""Base classes of the managers of `m600`: one for each skill, with its results as methods."""

from __future__ import annotations

from skillwing.services.managers.hooks import SkillHooks as _SkillHooks

from .types import (
    GotoFeedback,
    GotoInputs,
    GotoOutputs,
    GotoStraightFeedback,
    GotoStraightInputs,
    GotoStraightOutputs,
    HoverFeedback,
    HoverInputs,
    InspectFeedback,
    InspectInputs,
    LandFeedback,
    LandInputs,
    LidarDepthmapFeedback,
    LidarDepthmapInputs,
    LidarMappingFeedback,
    LidarMappingInputs,
    LockHeadFeedback,
    LockHeadInputs,
    ReturnHomeFeedback,
    ReturnHomeInputs,
    RotateHeadFeedback,
    RotateHeadInputs,
    StreamFeedback,
    StreamInputs,
    TakeoffFeedback,
    TakeoffInputs,
    ZedDepthmapFeedback,
    ZedDepthmapInputs,
)


class AbstractTakeoffManager(_SkillHooks[TakeoffInputs, None, TakeoffFeedback]):
    """Hooks of the skill `takeoff`: ends AT_ALTITUDE, BLOCKED or ABORTED."""

    skill = "takeoff"
    Inputs = TakeoffInputs
    Feedback = TakeoffFeedback

    def terminated_AT_ALTITUDE(self, goal_id: str, *, cause: str | None = None, why: str = "") -> None:
        """End the goal as a success."""
        self.terminated(goal_id, "AT_ALTITUDE", cause=cause, why=why)

    def terminated_BLOCKED(self, goal_id: str, *, cause: str | None = None, why: str = "") -> None:
        """End the goal as a failure."""
        self.terminated(goal_id, "BLOCKED", cause=cause, why=why)

    def terminated_ABORTED(self, goal_id: str, *, cause: str | None = None, why: str = "") -> None:
        """End the goal as a failure."""
        self.terminated(goal_id, "ABORTED", cause=cause, why=why)


class AbstractLandManager(_SkillHooks[LandInputs, None, LandFeedback]):
    """Hooks of the skill `land`: ends LANDED or BLOCKED."""

    skill = "land"
    Inputs = LandInputs
    Feedback = LandFeedback

    def terminated_LANDED(self, goal_id: str, *, cause: str | None = None, why: str = "") -> None:
        """End the goal as a success."""
        self.terminated(goal_id, "LANDED", cause=cause, why=why)

    def terminated_BLOCKED(self, goal_id: str, *, cause: str | None = None, why: str = "") -> None:
        """End the goal as a failure."""
        self.terminated(goal_id, "BLOCKED", cause=cause, why=why)


class AbstractHoverManager(_SkillHooks[HoverInputs, None, HoverFeedback]):
    """Hooks of the skill `hover`: ends DONE."""

    skill = "hover"
    Inputs = HoverInputs
    Feedback = HoverFeedback

    def terminated_DONE(self, goal_id: str, *, cause: str | None = None, why: str = "") -> None:
        """End the goal as a success."""
        self.terminated(goal_id, "DONE", cause=cause, why=why)


class AbstractGotoManager(_SkillHooks[GotoInputs, GotoOutputs, GotoFeedback]):
    """Hooks of the skill `goto`: ends ARRIVED, BLOCKED or ABORTED."""

    skill = "goto"
    Inputs = GotoInputs
    Outputs = GotoOutputs
    Feedback = GotoFeedback

    def terminated_ARRIVED(self, goal_id: str, output: GotoOutputs, *, cause: str | None = None, why: str = "") -> None:
        """End the goal as a success."""
        self.terminated(goal_id, "ARRIVED", output, cause=cause, why=why)

    def terminated_BLOCKED(self, goal_id: str, output: GotoOutputs, *, cause: str | None = None, why: str = "") -> None:
        """End the goal as a failure."""
        self.terminated(goal_id, "BLOCKED", output, cause=cause, why=why)

    def terminated_ABORTED(self, goal_id: str, output: GotoOutputs, *, cause: str | None = None, why: str = "") -> None:
        """End the goal as a failure."""
        self.terminated(goal_id, "ABORTED", output, cause=cause, why=why)


class AbstractGotoStraightManager(_SkillHooks[GotoStraightInputs, GotoStraightOutputs, GotoStraightFeedback]):
    """Hooks of the skill `goto_straight`: ends ARRIVED, BLOCKED or ABORTED."""

    skill = "goto_straight"
    Inputs = GotoStraightInputs
    Outputs = GotoStraightOutputs
    Feedback = GotoStraightFeedback

    def terminated_ARRIVED(
        self, goal_id: str, output: GotoStraightOutputs, *, cause: str | None = None, why: str = ""
    ) -> None:
        """End the goal as a success."""
        self.terminated(goal_id, "ARRIVED", output, cause=cause, why=why)

    def terminated_BLOCKED(
        self, goal_id: str, output: GotoStraightOutputs, *, cause: str | None = None, why: str = ""
    ) -> None:
        """End the goal as a failure."""
        self.terminated(goal_id, "BLOCKED", output, cause=cause, why=why)

    def terminated_ABORTED(
        self, goal_id: str, output: GotoStraightOutputs, *, cause: str | None = None, why: str = ""
    ) -> None:
        """End the goal as a failure."""
        self.terminated(goal_id, "ABORTED", output, cause=cause, why=why)


class AbstractReturnHomeManager(_SkillHooks[ReturnHomeInputs, None, ReturnHomeFeedback]):
    """Hooks of the skill `return_home`: ends ARRIVED or ABORTED."""

    skill = "return_home"
    Inputs = ReturnHomeInputs
    Feedback = ReturnHomeFeedback

    def terminated_ARRIVED(self, goal_id: str, *, cause: str | None = None, why: str = "") -> None:
        """End the goal as a success."""
        self.terminated(goal_id, "ARRIVED", cause=cause, why=why)

    def terminated_ABORTED(self, goal_id: str, *, cause: str | None = None, why: str = "") -> None:
        """End the goal as a failure."""
        self.terminated(goal_id, "ABORTED", cause=cause, why=why)


class AbstractRotateHeadManager(_SkillHooks[RotateHeadInputs, None, RotateHeadFeedback]):
    """Hooks of the skill `rotate_head`: ends ALIGNED."""

    skill = "rotate_head"
    Inputs = RotateHeadInputs
    Feedback = RotateHeadFeedback

    def terminated_ALIGNED(self, goal_id: str, *, cause: str | None = None, why: str = "") -> None:
        """End the goal as a success."""
        self.terminated(goal_id, "ALIGNED", cause=cause, why=why)


class AbstractLockHeadManager(_SkillHooks[LockHeadInputs, None, LockHeadFeedback]):
    """Hooks of the skill `lock_head`: runs until it is interrupted."""

    skill = "lock_head"
    Inputs = LockHeadInputs
    Feedback = LockHeadFeedback


class AbstractZedDepthmapManager(_SkillHooks[ZedDepthmapInputs, None, ZedDepthmapFeedback]):
    """Hooks of the skill `zed_depthmap`: ends NO_DATA."""

    skill = "zed_depthmap"
    Inputs = ZedDepthmapInputs
    Feedback = ZedDepthmapFeedback

    def terminated_NO_DATA(self, goal_id: str, *, cause: str | None = None, why: str = "") -> None:
        """End the goal as a failure."""
        self.terminated(goal_id, "NO_DATA", cause=cause, why=why)


class AbstractLidarDepthmapManager(_SkillHooks[LidarDepthmapInputs, None, LidarDepthmapFeedback]):
    """Hooks of the skill `lidar_depthmap`: ends NO_DATA."""

    skill = "lidar_depthmap"
    Inputs = LidarDepthmapInputs
    Feedback = LidarDepthmapFeedback

    def terminated_NO_DATA(self, goal_id: str, *, cause: str | None = None, why: str = "") -> None:
        """End the goal as a failure."""
        self.terminated(goal_id, "NO_DATA", cause=cause, why=why)


class AbstractLidarMappingManager(_SkillHooks[LidarMappingInputs, None, LidarMappingFeedback]):
    """Hooks of the skill `lidar_mapping`: ends DIVERGED."""

    skill = "lidar_mapping"
    Inputs = LidarMappingInputs
    Feedback = LidarMappingFeedback

    def terminated_DIVERGED(self, goal_id: str, *, cause: str | None = None, why: str = "") -> None:
        """End the goal as a failure."""
        self.terminated(goal_id, "DIVERGED", cause=cause, why=why)


class AbstractInspectManager(_SkillHooks[InspectInputs, None, InspectFeedback]):
    """Hooks of the skill `inspect`: ends COMPLETED, BLOCKED or ABORTED."""

    skill = "inspect"
    Inputs = InspectInputs
    Feedback = InspectFeedback

    def terminated_COMPLETED(self, goal_id: str, *, cause: str | None = None, why: str = "") -> None:
        """End the goal as a success."""
        self.terminated(goal_id, "COMPLETED", cause=cause, why=why)

    def terminated_BLOCKED(self, goal_id: str, *, cause: str | None = None, why: str = "") -> None:
        """End the goal as a failure."""
        self.terminated(goal_id, "BLOCKED", cause=cause, why=why)

    def terminated_ABORTED(self, goal_id: str, *, cause: str | None = None, why: str = "") -> None:
        """End the goal as a failure."""
        self.terminated(goal_id, "ABORTED", cause=cause, why=why)


class AbstractStreamManager(_SkillHooks[StreamInputs, None, StreamFeedback]):
    """Hooks of the skill `stream`: ends FPS_LOST."""

    skill = "stream"
    Inputs = StreamInputs
    Feedback = StreamFeedback

    def terminated_FPS_LOST(self, goal_id: str, *, cause: str | None = None, why: str = "") -> None:
        """End the goal as a failure."""
        self.terminated(goal_id, "FPS_LOST", cause=cause, why=why)
