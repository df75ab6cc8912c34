"""Mocks: skills and a world that follow a script, between real managers, so that missions can be tried without a robot.

A script (`script.py`, read from a file by `script_file.py`) is fitted to a skillset (`fitting.py`); players
(`player.py`, `stage.py`) decide from it what happens next, and nodes (`skill.py`, `world.py`) do it on a bus.
"""

from __future__ import annotations

from skillwing.services.mocking.script import Choices, MockRun, MockScript, Reaction, ScriptError, When
from skillwing.services.mocking.script_file import load_script, load_scripts
from skillwing.services.mocking.skill import MockHooks, MockSkillNode
from skillwing.services.mocking.system import make_mock_managers, make_mock_skill
from skillwing.services.mocking.world import MockWorld

__all__ = [
    "Choices",
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
