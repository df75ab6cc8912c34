"""Waits and look-ups of tests in a running system."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from command_line import Command

from skillwing.services.processes.run_state import read_run_state
from skillwing.services.protocol import State

PATIENCE = 60.0
"""Wall seconds after which a test gives up."""


def until(found: Callable[[], Any], what: str) -> Any:
    """Wait until something is found, and return it. what: noun for the failure."""
    deadline = time.monotonic() + PATIENCE
    while not (seen := found()):
        assert time.monotonic() < deadline, what
        time.sleep(0.05)
    return seen


def process_id(robot: str, name: str) -> int | None:
    """Id of a running process of a robot, None without it."""
    state = read_run_state(robot)
    return None if state is None else next((each.pid for each in state.processes if each.name == name), None)


def goal_runs(skillwing: Command, robot: str, skill: str) -> bool:
    """True while a goal of the skill is RUNNING."""
    goals = skillwing("status", "--json", "--robot", robot).json["goals"]
    return any((each["skill"], each["state"]) == (skill, State.RUNNING) for each in goals)


def shown_phase(skillwing: Command, robot: str) -> str | None:
    """Phase of the mission that a robot shows; None for none."""
    shown = skillwing("status", "--json", "--robot", robot).json.get("mission")
    return None if shown is None else shown["phase"]
