"""Monitor of a system's processes: the status of each, and a sentence for each change."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass

from skillwing.services.processes.proc_files import Usage, usage
from skillwing.services.processes.process_state import ProcessCondition, ProcessState, condition

SILENCE = 3.0
"""Seconds after which a silent process is reported: tokens disappear for a moment while a network recovers."""


@dataclass(frozen=True, slots=True)
class ProcessStatus:
    """Status of one process. used: its usage, None for a process that does not live.

    missing: its nodes without alive token, None if unknown.
    """

    state: ProcessState
    condition: ProcessCondition
    used: Usage | None
    missing: frozenset[str] | None = None

    @property
    def nodes(self) -> dict[str, ProcessCondition]:
        """Condition of each node that shares the process. In a silent process, a node with its token runs."""
        held = frozenset[str]() if self.missing is None else frozenset(self.state.nodes) - self.missing
        silent = self.condition in (ProcessCondition.STARTS, ProcessCondition.SILENT)
        runs = held if silent and not (self.used and self.used.stopped) else frozenset[str]()
        return {node: ProcessCondition.RUNS if node in runs else self.condition for node in self.state.nodes}


def process_statuses(states: Iterable[ProcessState], alive: Collection[str] | None) -> list[ProcessStatus]:
    """The status of each process. alive: holders of alive tokens, None if unknown."""
    used = {state: None if state.pid is None else usage(state.pid) for state in states}
    return [
        ProcessStatus(
            state,
            condition(state, found, alive),
            found,
            None if alive is None else frozenset(state.tokens) - frozenset(alive),
        )
        for state, found in used.items()
    ]


class ProcessMonitor:
    """Compares each status of a system with what was reported before."""

    def __init__(self) -> None:
        self._reported: dict[str, ProcessCondition] = {}
        self._silent: dict[str, float] = {}
        self._restarts: dict[str, int] = {}

    def changes(self, statuses: Iterable[ProcessStatus], now: float) -> list[str]:
        """A sentence for each process that became silent or runs again; `now` in seconds.

        The launcher reports exits, with their reasons.
        """
        sentences: list[str] = []
        for status in statuses:
            state = status.state
            if state.restarts > self._restarts.get(state.name, 0):
                # A restart may be over before the next check.
                self._reported[state.name] = ProcessCondition.RESTARTS
            self._restarts[state.name] = state.restarts
            sentences.append(self._sentence(status, now))
        return [sentence for sentence in sentences if sentence]

    def _sentence(self, status: ProcessStatus, now: float) -> str:
        name, found = status.state.name, status.condition
        if found is not ProcessCondition.SILENT:
            self._silent.pop(name, None)
        elif now - self._silent.setdefault(name, now) < SILENCE:
            return ""
        before = self._reported.get(name)
        self._reported[name] = found
        if found is ProcessCondition.SILENT and before is not ProcessCondition.SILENT:
            silent = [node for node, how in status.nodes.items() if how is ProcessCondition.SILENT]
            subject = f"{', '.join(silent)} in {name}" if len(silent) < len(status.nodes) else name
            return f"{subject} does not answer any more: it is stopped, hangs or is cut off."
        if found is ProcessCondition.RUNS and before not in (None, ProcessCondition.RUNS):
            return f"{name} runs again."
        if found is ProcessCondition.STARTS:
            # It may still fail to come up.
            self._reported[name] = before or ProcessCondition.RUNS
        return ""
