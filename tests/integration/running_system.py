"""Waits and look-ups of tests in a running system."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import psutil
from command_line import Command

from skillwing.services.processes.forked_process import SERVER as FORK_SERVER
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


def processes_below(pid: int) -> list[psutil.Process]:
    """The router and the hosts of nodes of a launcher, without its fork server."""
    processes = psutil.Process(pid).children(recursive=True)
    return [each for each in processes if FORK_SERVER not in command_line_of(each)]


def living_in(directory: Path) -> list[psutil.Process]:
    """The processes with a runtime directory there, and those that write there: a fork has no environment to see."""
    below = f"{directory}/"
    found: list[psutil.Process] = []
    for process in psutil.process_iter():
        with suppress(psutil.Error):
            runtime = process.environ().get("XDG_RUNTIME_DIR", "")
            if f"{runtime}/".startswith(below) or any(each.path.startswith(below) for each in process.open_files()):
                found.append(process)
    return found


def command_line_of(process: psutil.Process) -> list[str]:
    """The command line of a process; empty for one that has ended."""
    with suppress(psutil.NoSuchProcess):  # such as a zombie
        return process.cmdline()
    return []


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
