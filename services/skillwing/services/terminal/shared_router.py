"""Other robots at a system's router, which nobody can command once that router has ended."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

import typer
import zenoh

from skillwing.dsl.suggest import listed
from skillwing.services.access.identity_files import process_identity
from skillwing.services.bus.identity import SessionIdentity
from skillwing.services.bus.router_robots import robots_at, robots_seen
from skillwing.services.bus.zenoh_session import RouterUnreachableError
from skillwing.services.errors import KeysError, SkillwingError
from skillwing.services.names import LAUNCHER
from skillwing.services.processes.launcher import ROUTER
from skillwing.services.processes.run_state import RunState, running_systems
from skillwing.services.processes.stop_signal import CHECK_PERIOD, StopSignal

TIMEOUT = 1.0
"""Seconds for the connection to the router, which may be gone already."""
UPPER_PATIENCE = 3.0
"""Seconds for the connection to the router above, before its absence is reported."""
ENDING = 2.0
"""Seconds that the processes of a robot whose launcher was killed have for their end."""


def owns_router(state: RunState) -> bool:
    """True for a system that has started its own router."""
    return any(process.name == ROUTER for process in state.processes)


def others_at_router(endpoint: str, robot: str, keys: Path | None = None) -> dict[str, bool]:
    """The other robots at a router, each with True if it is known to be at work. keys: of this robot's system."""
    try:
        present = dict.fromkeys(robots_at(endpoint, timeout=TIMEOUT, identity=_launcher_identity(robot, keys)), False)
    except (RouterUnreachableError, KeysError):
        present = {}
    return {name: works for name, works in sorted((present | _started_here(endpoint)).items()) if name != robot}


def require_free_name(endpoint: str, robot: str, keys: Path | None, stop: StopSignal) -> None:
    """Raise SkillwingError if a robot of this name lives at a router, also one of another computer.

    A second one would take the place of the first one's managers, and its goals would be lost. One that is about to end
    has a moment for that. keys: of this robot's system. A router that cannot be asked is left to the start.
    """
    deadline = time.monotonic() + ENDING
    try:
        identity = _launcher_identity(robot, keys)
        while robot in robots_at(endpoint, robot, identity=identity):
            if time.monotonic() > deadline:
                text = f"`{robot}` runs at the router {endpoint} already."
                raise SkillwingError(f"{text} Give this one a name of its own with `--robot-name`, or stop that one.")
            time.sleep(CHECK_PERIOD)
            stop.check()
    except (RouterUnreachableError, KeysError):
        return


def _launcher_identity(robot: str, keys: Path | None) -> SessionIdentity | None:
    """The identity of a robot's launcher; None for a system without keys. Raises KeysError."""
    return None if keys is None else process_identity(keys, robot, LAUNCHER)


def robots_of_router(router: zenoh.Session, endpoint: str) -> dict[str, bool]:
    """The robots that a router's own session sees, each with True if it is known to be at work.

    In a tree of routers, these are all of the tree.
    """
    return dict(sorted((dict.fromkeys(robots_seen(router), False) | _started_here(endpoint)).items()))


def _started_here(endpoint: str) -> dict[str, bool]:
    """The robots of this machine at a router, each with True if it is at work."""
    return {state.robot: bool(state.active_work) for state in running_systems() if state.endpoint == endpoint}


def objection(robot: str, others: Mapping[str, bool]) -> str:
    """Sentences against the end of a router with these other robots; empty without any."""
    if not others:
        return ""
    text = f"The router of `{robot}` is also that of {listed(others)}, which nobody could command any more."
    return f"{text}{_at_work(others)}"


def _at_work(robots: Mapping[str, bool]) -> str:
    works = [name for name, at_work in robots.items() if at_work]
    return f" At work: {listed(works)}." if works else ""


def consequence(others: Mapping[str, bool]) -> str:
    """Sentence after the end of such a router; empty without other robots."""
    return f"{listed(others)} {'is' if len(others) == 1 else 'are'} without a router now." if others else ""


def hold_router(router: zenoh.Session, endpoint: str, stop: StopSignal, upper: str | None) -> None:
    """Block until a signal ends a router.

    While robots use it, the first Ctrl-C only warns, and the last line names them. upper: endpoint of the router above
    it, None for none. Its absence is reported, unless a router below has come. A router in a tree cannot tell its own
    robots from others.
    """
    branch = upper is not None
    patience = time.monotonic() + UPPER_PATIENCE if branch else math.inf
    while True:
        while not stop.received:
            time.sleep(CHECK_PERIOD)
            if time.monotonic() > patience:
                patience = math.inf
                if not router.info.routers_zid():
                    with suppress(OSError):  # a terminal that is gone must not end the router
                        typer.echo(f"No router answers at {upper} yet. This one goes on trying.", err=True)
        robots = robots_of_router(router, endpoint)
        if not robots or not stop.by_keyboard or stop.was_withdrawn:
            break
        stop.withdraw()
        text = f"This router connects {listed(robots)} with those who command them.{_at_work(robots)}"
        typer.echo(f"{text} Ctrl-C again ends it all the same.", err=True)
    if robots:
        unknown = f"{listed(robots)} may be without a router now."
        typer.echo(unknown if branch else consequence(robots), err=True)
