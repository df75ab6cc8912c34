"""`skillwing down`: the end of a running system."""

from __future__ import annotations

import os
import signal
import time
from typing import Annotated

import typer

from skillwing.dsl.suggest import listed
from skillwing.services.client.connection import find_target
from skillwing.services.errors import NoSystemError, RefusedError
from skillwing.services.processes.launcher import STOP_TIMEOUT
from skillwing.services.processes.run_state import read_run_state, remove_run_state, started
from skillwing.services.protocol import ErrorCode
from skillwing.services.terminal.connection import RobotOption
from skillwing.services.terminal.shared_router import consequence, objection, others_at_router, owns_router

PATIENCE = 3 * STOP_TIMEOUT
"""Seconds in which the system can stop; it kills its own processes earlier."""
REPORT_PATIENCE = 60.0
"""Seconds for a system that is stopping and writes a mission's report."""


def down(
    robot: RobotOption = None,
    force: Annotated[bool, typer.Option("--force", help="Stop it although other robots use its router.")] = False,
) -> None:
    """Stop the running system, all processes in order, and print what that cuts short.

    A system whose router other robots use is not stopped without --force. See docs/operations.md.

    Exit codes: 0 it has stopped; 3 no system is running; 4 other robots use its router.
    """
    target = find_target(robot)
    state = read_run_state(target.robot)
    if state is None:
        raise NoSystemError(f"The system at {target.endpoint} was not started here. Stop it where it was started.")
    others = others_at_router(state.endpoint, state.robot, target.keys) if owns_router(state) else {}
    if others and not force:
        commands = listed(f"skillwing down --robot {name}" for name in others)
        stop = f"Stop the others first, with {commands}, or use `--force`."
        raise RefusedError(ErrorCode.NOT_ALLOWED, objection(state.robot, others), help=stop)
    os.kill(state.pid, signal.SIGTERM)
    ended = _wait_for_end(state.pid, state.pid_started)
    if not ended and read_run_state(state.robot) is None:
        typer.echo("It still ends. It may be writing a report ...")
        ended = _wait_for_end(state.pid, state.pid_started, REPORT_PATIENCE)
    if not ended:
        # Its children end with it: their pipes to it close.
        os.kill(state.pid, signal.SIGKILL)
        _wait_for_end(state.pid, state.pid_started)
    remove_run_state(state.robot)
    typer.echo(f"{state.robot} has stopped.")
    if state.active_work:
        typer.echo(state.active_work)
    if others:
        typer.echo(consequence(others))


def _wait_for_end(pid: int, pid_started: str, patience: float = PATIENCE) -> bool:
    """Wait until a process has ended. It is no child of this process, so its id is all there is to watch."""
    deadline = time.monotonic() + patience
    while started(pid) == pid_started:
        if time.monotonic() > deadline:
            return False
        time.sleep(0.05)
    return True
