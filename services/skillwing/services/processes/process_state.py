"""What has become of a system's processes, as whoever runs them knows it and everybody else reads it."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from enum import StrEnum
from typing import Literal

import msgspec

from skillwing.services.processes.proc_files import Usage

STARTING_TIME = 10.0
"""Seconds that a process may take until it says that it is there; after that it counts as silent."""


class ProcessState(msgspec.Struct, frozen=True, kw_only=True):
    """One process. pid: None where only its alive token is known.

    life: it has one, waits for the next one, or is given up. restarts: how often it was started again; last_words: how
    it ended last, if it did. talks: it holds an alive token while it is well, which only the router does not. nodes:
    those that share it, each with an alive token of its own; none for a process of one node, which has its name.
    """

    name: str
    pid: int | None = None
    life: Literal["lives", "waits", "given up"] = "lives"
    restarts: int = 0
    last_words: str = ""
    essential: bool = True
    talks: bool = True
    nodes: tuple[str, ...] = ()

    @property
    def tokens(self) -> tuple[str, ...]:
        """Whose alive tokens it holds."""
        return self.nodes or (self.name,)


class Condition(StrEnum):
    """How a process is, seen from outside."""

    RUNS = "runs"
    STARTS = "starts"
    SILENT = "silent"
    """It lives, and an alive token of it is gone: stopped, hung or cut off."""
    RESTARTS = "restarts"
    DOWN = "down"


def condition(state: ProcessState, used: Usage | None, alive: Collection[str] | None) -> Condition:
    """How a process is.

    used: what its process id uses, None if there is no such process; alive: who holds an alive token, None if nobody
    could be asked.
    """
    here = alive is not None and all(token in alive for token in state.tokens)
    if state.pid is None:
        return Condition.RUNS if here else Condition.DOWN
    if state.life == "waits":
        return Condition.RESTARTS
    if state.life == "given up" or used is None:
        return Condition.DOWN
    if used.stopped:
        return Condition.SILENT
    if here or alive is None or not state.talks:
        return Condition.RUNS
    return Condition.STARTS if used.uptime < STARTING_TIME else Condition.SILENT


def headcount(conditions: Iterable[Condition]) -> str:
    """`19 of 20 processes run, besides the router.`, at which they meet."""
    found = list(conditions)
    return f"{found.count(Condition.RUNS)} of {len(found)} processes run, besides the router."
