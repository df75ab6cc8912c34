"""The test kit: skill managers and whole skillsets under test, without a robot (docs/testing.md).

`SkillTest` runs the manager of one skill, `SkillsetInProcess` all managers of a skillset. Both run in one process and
in virtual time, with the real managers and a fake functional layer. `SkillsetProcesses` starts real processes. All
three are a `Bench`, so a test reads the same on each. Fixtures for pytest are in `fixtures.py`. The names below are the
public API.
"""

from __future__ import annotations

from skillwing.services.testing.bench import Bench
from skillwing.services.testing.context import ContextError
from skillwing.services.testing.fake_layer import FakeLayer
from skillwing.services.testing.goal import GoalUnderTest
from skillwing.services.testing.in_process import SkillsetInProcess
from skillwing.services.testing.processes import SkillsetProcesses
from skillwing.services.testing.skill import SkillTest

__all__ = [
    "Bench",
    "ContextError",
    "FakeLayer",
    "GoalUnderTest",
    "SkillTest",
    "SkillsetInProcess",
    "SkillsetProcesses",
]
