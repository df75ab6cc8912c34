"""State of a system's processes: written by the process that runs them, read by all commands."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from enum import StrEnum
from typing import Literal

import msgspec

from skillwing.services.processes.proc_files import Usage

STARTING_TIME = 10.0
"""Longest time from the start of a process to its alive token; later it counts as silent [s]."""


class ProcessState(msgspec.Struct, frozen=True, kw_only=True):
    """State of one process. pid: None if only its alive token is known.

    life: it runs, waits for its restart, or is given up. restarts: their number. last_words: sentences on its last
    exit, if it had one. talks: it holds an alive token while it works; only the router does not. nodes: those that
    share it, each with an alive token; empty for a process of one node, which has its name.
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
        """Names of the alive tokens that it holds."""
        return self.nodes or (self.name,)


class ProcessCondition(StrEnum):
    """Condition of a process, seen from outside."""

    RUNS = "runs"
    STARTS = "starts"
    SILENT = "silent"
    """Process that lives without one of its alive tokens: stopped, hung or cut off."""
    RESTARTS = "restarts"
    DOWN = "down"


def condition(state: ProcessState, used: Usage | None, alive: Collection[str] | None) -> ProcessCondition:
    """Condition of a process.

    used: usage of its process id, None without such a process. alive: holders of alive tokens, None if unknown.
    """
    here = alive is not None and all(token in alive for token in state.tokens)
    if state.pid is None:
        return ProcessCondition.RUNS if here else ProcessCondition.DOWN
    if state.life == "waits":
        return ProcessCondition.RESTARTS
    if state.life == "given up" or used is None:
        return ProcessCondition.DOWN
    if used.stopped:
        return ProcessCondition.SILENT
    if here or alive is None or not state.talks:
        return ProcessCondition.RUNS
    return ProcessCondition.STARTS if used.uptime < STARTING_TIME else ProcessCondition.SILENT


def running_count(conditions: Iterable[ProcessCondition]) -> str:
    """Sentence such as `3 of 4 processes run, not counting the router.`"""
    found = list(conditions)
    return f"{found.count(ProcessCondition.RUNS)} of {len(found)} processes run, not counting the router."
