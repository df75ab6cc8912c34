"""The manager of `goto_straight`."""

from __future__ import annotations

from goto_cases import GotoCases

from skillwing.m600.skills.goto_straight import GotoStraightManager
from skillwing.onboard.topics.guidance import YawMode


class TestGotoStraight(GotoCases):
    manager = GotoStraightManager
    nose = YawMode.ALONG_TRACK
