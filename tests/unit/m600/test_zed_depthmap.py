"""The manager of `zed_depthmap`."""

from __future__ import annotations

from depthmap_cases import DepthmapCases

from skillwing.m600.skills.zed_depthmap import ZedDepthmapManager


class TestZedDepthmap(DepthmapCases):
    manager = ZedDepthmapManager
    sensor = "zed"
