"""Mocks: skills and a world that follow a script, between real managers, to try missions without a robot.

A script (`script.py`, read from a file by `script_file.py`) is fitted to a skillset (`fitting.py`). Pure cores
(`player.py`, `world_core.py`) decide the next step, and nodes (`skill.py`, `world.py`) do it on a bus. The names below
are the public API.
"""

from __future__ import annotations

from skillwing.services.mocking.script import Choices, InputDelay, MockRun, MockScript, Reaction, ScriptError, When
from skillwing.services.mocking.script_file import load_script, load_scripts
from skillwing.services.mocking.skill import MockHooks, MockSkillNode
from skillwing.services.mocking.system import make_mock_managers, make_mock_skill
from skillwing.services.mocking.world import MockWorld

__all__ = [
    "Choices",
    "InputDelay",
    "MockHooks",
    "MockRun",
    "MockScript",
    "MockSkillNode",
    "MockWorld",
    "Reaction",
    "ScriptError",
    "When",
    "load_script",
    "load_scripts",
    "make_mock_managers",
    "make_mock_skill",
]
