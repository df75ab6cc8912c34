"""The manager of `lidar_depthmap`."""

from __future__ import annotations

from depthmap_cases import DepthmapCases

from skillwing.m600.skills.lidar_depthmap import LidarDepthmapManager


class TestLidarDepthmap(DepthmapCases):
    manager = LidarDepthmapManager
    sensor = "lidar"
