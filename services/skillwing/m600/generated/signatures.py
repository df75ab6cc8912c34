# Generated from m600.skillset by `skillwing generate`. Do not edit: change the skillset instead.
"""Signatures of the skills of `m600`: results, outputs and feedback."""

from __future__ import annotations

from skillwing.services.client.outcome import Signature as _Signature

from .types import (
    GotoFeedback,
    GotoOutputs,
    GotoResult,
    GotoStraightFeedback,
    GotoStraightOutputs,
    GotoStraightResult,
    HoverFeedback,
    HoverResult,
    InspectFeedback,
    InspectResult,
    LandFeedback,
    LandResult,
    LidarDepthmapFeedback,
    LidarDepthmapResult,
    LidarMappingFeedback,
    LidarMappingResult,
    LockHeadFeedback,
    LockHeadResult,
    ReturnHomeFeedback,
    ReturnHomeResult,
    RotateHeadFeedback,
    RotateHeadResult,
    StreamFeedback,
    StreamResult,
    TakeoffFeedback,
    TakeoffResult,
    ZedDepthmapFeedback,
    ZedDepthmapResult,
)

takeoff = _Signature[TakeoffResult, None, TakeoffFeedback]("takeoff", None, TakeoffFeedback)
land = _Signature[LandResult, None, LandFeedback]("land", None, LandFeedback)
hover = _Signature[HoverResult, None, HoverFeedback]("hover", None, HoverFeedback)
goto = _Signature[GotoResult, GotoOutputs, GotoFeedback]("goto", GotoOutputs, GotoFeedback)
goto_straight = _Signature[GotoStraightResult, GotoStraightOutputs, GotoStraightFeedback](
    "goto_straight", GotoStraightOutputs, GotoStraightFeedback
)
return_home = _Signature[ReturnHomeResult, None, ReturnHomeFeedback]("return_home", None, ReturnHomeFeedback)
rotate_head = _Signature[RotateHeadResult, None, RotateHeadFeedback]("rotate_head", None, RotateHeadFeedback)
lock_head = _Signature[LockHeadResult, None, LockHeadFeedback]("lock_head", None, LockHeadFeedback)
zed_depthmap = _Signature[ZedDepthmapResult, None, ZedDepthmapFeedback]("zed_depthmap", None, ZedDepthmapFeedback)
lidar_depthmap = _Signature[LidarDepthmapResult, None, LidarDepthmapFeedback](
    "lidar_depthmap", None, LidarDepthmapFeedback
)
lidar_mapping = _Signature[LidarMappingResult, None, LidarMappingFeedback]("lidar_mapping", None, LidarMappingFeedback)
inspect = _Signature[InspectResult, None, InspectFeedback]("inspect", None, InspectFeedback)
stream = _Signature[StreamResult, None, StreamFeedback]("stream", None, StreamFeedback)
