"""Other robots at a system's router, which nobody can command once that router has ended."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from skillwing.dsl.suggest import listed
from skillwing.services.access.identity_files import process_identity
from skillwing.services.access.key_store import KeysError
from skillwing.services.bus.router_robots import robots_at
from skillwing.services.bus.zenoh_session import RouterUnreachableError
from skillwing.services.names import LAUNCHER
from skillwing.services.processes.launcher import ROUTER
from skillwing.services.processes.run_state import RunState, running_systems

TIMEOUT = 1.0
"""Seconds for the connection to the router, which may be gone already."""


def owns_router(state: RunState) -> bool:
    """True for a system that has started its own router."""
    return any(process.name == ROUTER for process in state.processes)


def others_at_router(endpoint: str, robot: str, keys: Path | None = None) -> dict[str, bool]:
    """The other robots at a router, each with True if it is known to be at work. keys: of this robot's system."""
    here = {state.robot: bool(state.active_work) for state in running_systems() if state.endpoint == endpoint}
    try:
        identity = None if keys is None else process_identity(keys, robot, LAUNCHER)
        present = dict.fromkeys(robots_at(endpoint, timeout=TIMEOUT, identity=identity), False)
    except (RouterUnreachableError, KeysError):
        present = {}
    return {name: works for name, works in sorted((present | here).items()) if name != robot}


def objection(robot: str, others: Mapping[str, bool]) -> str:
    """Sentences against the end of a router with these other robots; empty without any."""
    if not others:
        return ""
    works = [name for name, at_work in others.items() if at_work]
    text = f"The router of `{robot}` is also that of {listed(others)}, which nobody could command any more."
    return f"{text} At work: {listed(works)}." if works else text


def consequence(others: Mapping[str, bool]) -> str:
    """Sentence after the end of such a router; empty without other robots."""
    return f"{listed(others)} {'is' if len(others) == 1 else 'are'} without a router now." if others else ""
