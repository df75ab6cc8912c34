"""The roll call of a running system: how each process is, and what to tell when that changes."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass

from skillwing.services.processes.proc_files import Usage, usage
from skillwing.services.processes.process_state import Condition, ProcessState, condition

SILENCE = 3.0
"""Seconds for which a process has to be silent until that is worth a word: a healing network lets tokens flap."""


@dataclass(frozen=True, slots=True)
class Entry:
    """One process and how it is. used: what it uses, None if it does not live.

    missing: those of its nodes without alive token, None if nobody could be asked.
    """

    state: ProcessState
    condition: Condition
    used: Usage | None
    missing: frozenset[str] | None = None

    @property
    def nodes(self) -> dict[str, Condition]:
        """How each of the nodes is that share it: well in a process that is not quite well is who holds its token."""
        here = frozenset[str]() if self.missing is None else frozenset(self.state.nodes) - self.missing
        unwell = self.condition in (Condition.STARTS, Condition.SILENT) and not (self.used and self.used.stopped)
        return {node: Condition.RUNS if unwell and node in here else self.condition for node in self.state.nodes}


def entries_of(states: Iterable[ProcessState], alive: Collection[str] | None) -> list[Entry]:
    """How processes are. alive: who holds an alive token, None if nobody could be asked."""
    used = {state: None if state.pid is None else usage(state.pid) for state in states}
    return [
        Entry(
            state,
            condition(state, found, alive),
            found,
            None if alive is None else frozenset(state.tokens) - frozenset(alive),
        )
        for state, found in used.items()
    ]


class RollCall:
    """Compares each look at the system with what was told of it before."""

    def __init__(self) -> None:
        self._told: dict[str, Condition] = {}
        self._silent: dict[str, float] = {}
        self._restarts: dict[str, int] = {}

    def look(self, entries: Iterable[Entry], now: float) -> list[str]:
        """A sentence for each process that has fallen silent, or runs again; `now` in seconds.

        Deaths are told by whoever sees them, with their reasons.
        """
        told: list[str] = []
        for entry in entries:
            state = entry.state
            if state.restarts > self._restarts.get(state.name, 0):
                # A restart may be over sooner than the next look.
                self._told[state.name] = Condition.RESTARTS
            self._restarts[state.name] = state.restarts
            told.append(self._sentence(entry, now))
        return [sentence for sentence in told if sentence]

    def _sentence(self, entry: Entry, now: float) -> str:
        name, found = entry.state.name, entry.condition
        if found is not Condition.SILENT:
            self._silent.pop(name, None)
        elif now - self._silent.setdefault(name, now) < SILENCE:
            return ""
        before = self._told.get(name)
        self._told[name] = found
        if found is Condition.SILENT and before is not Condition.SILENT:
            silent = [node for node, how in entry.nodes.items() if how is Condition.SILENT]
            who = f"{', '.join(silent)} in {name}" if len(silent) < len(entry.nodes) else name
            return f"{who} does not answer any more: it is stopped, hangs or is cut off."
        if found is Condition.RUNS and before not in (None, Condition.RUNS):
            return f"{name} runs again."
        if found is Condition.STARTS:
            # Whether it comes up is still to be seen.
            self._told[name] = before or Condition.RUNS
        return ""
