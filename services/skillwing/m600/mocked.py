"""The table of the M600 whose skills are all mocked."""

from __future__ import annotations

from skillwing.m600.robot import ROBOT as M600
from skillwing.services.mocking.system import mocked

ROBOT = mocked(M600)
