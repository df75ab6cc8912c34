# Generated from m600.skillset by `skillwing generate`. Do not edit: change the skillset instead.
"""Typed access to `m600`, for asyncio: methods return a goal at once; awaiting it returns the outcome.

async with connect() as m600:
    outcome = await m600.takeoff(...)
"""

from __future__ import annotations

from collections.abc import AsyncGenerator as _AsyncGenerator
from contextlib import asynccontextmanager

from skillwing.services.client import aio as _aio

from . import SCHEMA_HASH as _SCHEMA_HASH
from . import processes as _processes
from . import signatures as _signatures
from .types import (
    AxesAuthorityState,
    BatteryStatusState,
    DepthmapSourceState,
    FlightStatusState,
    GotoFeedback,
    GotoOutputs,
    GotoResult,
    GotoStraightFeedback,
    GotoStraightOutputs,
    GotoStraightResult,
    HeadingAuthorityState,
    HomepointStatusState,
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
    LidarStatusState,
    LinkStatusState,
    LockHeadFeedback,
    LockHeadResult,
    MapStatistics,
    Position,
    ReturnHomeFeedback,
    ReturnHomeResult,
    RotateHeadFeedback,
    RotateHeadResult,
    SDKAuthorityState,
    SlamStatusState,
    StreamFeedback,
    StreamResult,
    TakeoffFeedback,
    TakeoffResult,
    Velocity,
    ZedDepthmapFeedback,
    ZedDepthmapResult,
    ZedStatusState,
)


class GotoGoal(_aio.Goal[GotoResult, GotoOutputs, GotoFeedback]):
    """A goal of `goto`. Its inputs can be modified while it runs."""

    async def modify(
        self,
        *,
        target: Position | None = None,
        speed: float | None = None,
    ) -> None:
        """Give the running goal new inputs; one of None stays. All are taken, or none.

        Raises RefusedError, also if the goal has ended, and NoReplyError.
        """
        await self.modify_inputs({"target": target, "speed": speed})


class M600Skills:
    """Starts skills.

    goal_id: the client chooses one unless given. cause: the timeline record that leads here.
    Raises InvalidInputError for a value of a wrong type.
    """

    def __init__(self, client: _aio.Client) -> None:
        self._client = client

    def takeoff(
        self,
        *,
        height: float = 5.0,
        speed: float = 1.0,
        goal_id: str | None = None,
        cause: str | None = None,
    ) -> _aio.Goal[TakeoffResult, None, TakeoffFeedback]:
        """Start `takeoff`. height: [m] in 1.0..50.0; speed: [m/s] in 0.1..3.0."""
        return self._client.start(_signatures.takeoff, {"height": height, "speed": speed}, goal_id=goal_id, cause=cause)

    def land(
        self,
        *,
        speed: float = 0.7,
        goal_id: str | None = None,
        cause: str | None = None,
    ) -> _aio.Goal[LandResult, None, LandFeedback]:
        """Start `land`. speed: [m/s] in 0.1..2.0."""
        return self._client.start(_signatures.land, {"speed": speed}, goal_id=goal_id, cause=cause)

    def hover(
        self,
        *,
        duration: float = 5.0,
        goal_id: str | None = None,
        cause: str | None = None,
    ) -> _aio.Goal[HoverResult, None, HoverFeedback]:
        """Start `hover`. duration: [s] in 0.0..3600.0."""
        return self._client.start(_signatures.hover, {"duration": duration}, goal_id=goal_id, cause=cause)

    def goto(
        self,
        *,
        target: Position,
        speed: float = 2.0,
        goal_id: str | None = None,
        cause: str | None = None,
    ) -> GotoGoal:
        """Start `goto`. speed: [m/s] in 0.1..5.0."""
        return self._client.start_as(
            GotoGoal,
            _signatures.goto,
            {"target": target, "speed": speed},
            goal_id=goal_id,
            cause=cause,
        )

    def goto_straight(
        self,
        *,
        target: Position,
        speed: float = 2.0,
        goal_id: str | None = None,
        cause: str | None = None,
    ) -> _aio.Goal[GotoStraightResult, GotoStraightOutputs, GotoStraightFeedback]:
        """Start `goto_straight`. speed: [m/s] in 0.1..5.0."""
        return self._client.start(
            _signatures.goto_straight,
            {"target": target, "speed": speed},
            goal_id=goal_id,
            cause=cause,
        )

    def return_home(
        self,
        *,
        height: float = 5.0,
        speed: float = 2.0,
        goal_id: str | None = None,
        cause: str | None = None,
    ) -> _aio.Goal[ReturnHomeResult, None, ReturnHomeFeedback]:
        """Start `return_home`. height: [m] in 1.0..50.0; speed: [m/s] in 0.1..5.0."""
        return self._client.start(
            _signatures.return_home,
            {"height": height, "speed": speed},
            goal_id=goal_id,
            cause=cause,
        )

    def rotate_head(
        self,
        *,
        heading: float,
        goal_id: str | None = None,
        cause: str | None = None,
    ) -> _aio.Goal[RotateHeadResult, None, RotateHeadFeedback]:
        """Start `rotate_head`. heading: [rad] in -6.3..6.3."""
        return self._client.start(_signatures.rotate_head, {"heading": heading}, goal_id=goal_id, cause=cause)

    def lock_head(
        self,
        *,
        heading: float,
        goal_id: str | None = None,
        cause: str | None = None,
    ) -> _aio.Goal[LockHeadResult, None, LockHeadFeedback]:
        """Start `lock_head`. heading: [rad] in -6.3..6.3."""
        return self._client.start(_signatures.lock_head, {"heading": heading}, goal_id=goal_id, cause=cause)

    def zed_depthmap(
        self,
        *,
        goal_id: str | None = None,
        cause: str | None = None,
    ) -> _aio.Goal[ZedDepthmapResult, None, ZedDepthmapFeedback]:
        """Start `zed_depthmap`."""
        return self._client.start(_signatures.zed_depthmap, {}, goal_id=goal_id, cause=cause)

    def lidar_depthmap(
        self,
        *,
        goal_id: str | None = None,
        cause: str | None = None,
    ) -> _aio.Goal[LidarDepthmapResult, None, LidarDepthmapFeedback]:
        """Start `lidar_depthmap`."""
        return self._client.start(_signatures.lidar_depthmap, {}, goal_id=goal_id, cause=cause)

    def lidar_mapping(
        self,
        *,
        goal_id: str | None = None,
        cause: str | None = None,
    ) -> _aio.Goal[LidarMappingResult, None, LidarMappingFeedback]:
        """Start `lidar_mapping`."""
        return self._client.start(_signatures.lidar_mapping, {}, goal_id=goal_id, cause=cause)

    def inspect(
        self,
        *,
        center: Position,
        radius: float,
        height: float,
        laps: float = 1.0,
        speed: float = 2.0,
        goal_id: str | None = None,
        cause: str | None = None,
    ) -> _aio.Goal[InspectResult, None, InspectFeedback]:
        """Start `inspect`.

        radius: [m] in 2.0..100.0.
        height: [m] in 1.0..50.0.
        laps: in 0.1..20.0.
        speed: [m/s] in 0.1..5.0.
        """
        return self._client.start(
            _signatures.inspect,
            {"center": center, "radius": radius, "height": height, "laps": laps, "speed": speed},
            goal_id=goal_id,
            cause=cause,
        )

    def stream(
        self,
        *,
        min_fps: float = 10.0,
        min_quality: float = 0.7,
        goal_id: str | None = None,
        cause: str | None = None,
    ) -> _aio.Goal[StreamResult, None, StreamFeedback]:
        """Start `stream`. min_fps: [1/s] in 1.0..60.0; min_quality: in 0.0..1.0."""
        return self._client.start(
            _signatures.stream,
            {"min_fps": min_fps, "min_quality": min_quality},
            goal_id=goal_id,
            cause=cause,
        )


class M600Resources:
    """The resources of `m600`."""

    def __init__(self, client: _aio.Client) -> None:
        self.SDK_authority = _aio.Resource[SDKAuthorityState](client, "SDK_authority")
        self.flight_status = _aio.Resource[FlightStatusState](client, "flight_status")
        self.homepoint_status = _aio.Resource[HomepointStatusState](client, "homepoint_status")
        self.zed_status = _aio.Resource[ZedStatusState](client, "zed_status")
        self.lidar_status = _aio.Resource[LidarStatusState](client, "lidar_status")
        self.battery_status = _aio.Resource[BatteryStatusState](client, "battery_status")
        self.link_status = _aio.Resource[LinkStatusState](client, "link_status")
        self.axes_authority = _aio.Resource[AxesAuthorityState](client, "axes_authority")
        self.heading_authority = _aio.Resource[HeadingAuthorityState](client, "heading_authority")
        self.depthmap_source = _aio.Resource[DepthmapSourceState](client, "depthmap_source")
        self.slam_status = _aio.Resource[SlamStatusState](client, "slam_status")


class M600Data:
    """The data of `m600`."""

    def __init__(self, client: _aio.Client) -> None:
        self.position = _aio.Datum[Position](client, "position", Position)
        """every 0.1 s"""
        self.velocity = _aio.Datum[Velocity](client, "velocity", Velocity)
        """every 0.1 s"""
        self.heading = _aio.Datum[float](client, "heading", float)
        """[rad] every 0.1 s"""
        self.battery = _aio.Datum[float](client, "battery", float)
        """[%] every 1.0 s"""
        self.link_bandwidth = _aio.Datum[float](client, "link_bandwidth", float)
        """[Mbit/s] every 1.0 s"""
        self.video_quality = _aio.Datum[float](client, "video_quality", float)
        """every 1.0 s"""
        self.obstacle_distance = _aio.Datum[float](client, "obstacle_distance", float)
        """[m] every 0.2 s"""
        self.map_statistics = _aio.Datum[MapStatistics](client, "map_statistics", MapStatistics)
        """every 1.0 s"""


class M600(M600Skills):
    """The robot: its skills, resources, data and events."""

    def __init__(self, client: _aio.Client) -> None:
        super().__init__(client)
        self.resources = M600Resources(client)
        self.data = M600Data(client)
        self.ready = client.ready


@asynccontextmanager
async def connect(
    robot: str | None = None,
    *,
    endpoint: str | None = None,
    owns_goals: bool = True,
) -> _AsyncGenerator[M600, None]:
    """Connect to a running `m600`.

    robot: its name, optional if only one runs here. endpoint: `tcp/HOST:PORT` of its router, if it runs elsewhere.
    owns_goals: goals that still run at the end of the context, or of the script, are interrupted, unless their skill
    says `owner_lost=continue`; with False they continue.
    Raises NoSystemError, NoReplyError, and a SkillwingError if the system runs another skillset than this code was
    generated from.
    """
    async with _aio.connect(
        robot, endpoint=endpoint, owns_goals=owns_goals, table=_processes.TABLE, schema=_SCHEMA_HASH
    ) as client:
        yield M600(client)
