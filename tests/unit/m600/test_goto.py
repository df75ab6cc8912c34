"""The manager of `goto`."""

from __future__ import annotations

from goto_cases import GotoCases

from skillwing.m600.skills.goto import GotoManager
from skillwing.onboard.topics.guidance import YawMode


class TestGoto(GotoCases):
    manager = GotoManager
    nose = YawMode.FREE
