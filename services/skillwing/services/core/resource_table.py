"""States of all resources, which change by whole effects or not at all."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from types import MappingProxyType
from typing import Any, TypeAlias

from skillwing.dsl.model import Resource, Skillset
from skillwing.services.core.outbox import RecordOutbox
from skillwing.services.core.snapshot import OnEntry, ResourceEntry
from skillwing.services.protocol import RecordKind

Transitions: TypeAlias = Iterable[tuple[str, str]]
"""(resource, target state) pairs."""


def transition_obstacle(
    resource_of: Callable[[str], Resource], states: Mapping[str, str], transitions: Transitions, *, extern: bool = False
) -> str | None:
    """None if all transitions may be taken from these states, else a sentence on the first that may not."""
    for name, target in transitions:
        source = states[name]
        if not resource_of(name).allows(source, target, extern):
            kind = "extern" if extern else "internal"
            return f"`{name}` has no {kind} transition from {source} to {target}."
    return None


class ResourceTable:
    """State of each resource of a skillset.

    outbox: receives all changes; on_entry: an entry for each. found: initial states that differ from the skillset's;
    entries: from the snapshot.
    """

    def __init__(
        self,
        skillset: Skillset,
        outbox: RecordOutbox[Any],
        on_entry: OnEntry,
        *,
        found: Mapping[str, str] | None = None,
        entries: Iterable[ResourceEntry] = (),
    ) -> None:
        self._resources = {resource.name: resource for resource in skillset.resources}
        self._states = {resource.name: resource.initial for resource in skillset.resources} | dict(found or {})
        self._outbox = outbox
        self._on_entry = on_entry
        self._last_change: dict[str, tuple[int, str]] = {}
        """Number of the latest change set of a resource, and its record."""
        for entry in entries:
            self._states[entry.resource] = entry.state
            if entry.change_set:
                self._last_change[entry.resource] = (entry.change_set, entry.record)
        self._change_set = max((number for number, _ in self._last_change.values()), default=0)

    @property
    def states(self) -> Mapping[str, str]:
        """A live view."""
        return MappingProxyType(self._states)

    def initial_entries(self) -> tuple[ResourceEntry, ...]:
        """An entry for each resource in its present state."""
        return tuple(self._entry_of(name) for name in self._states)

    def obstacle(self, transitions: Transitions, *, extern: bool = False) -> str | None:
        """None if all transitions may be taken now, else a sentence on the first that may not."""
        return transition_obstacle(self._resources.__getitem__, self._states, transitions, extern=extern)

    def extern_targets(self, name: str) -> tuple[str, ...]:
        """States that the functional layer may bring a resource to from its present one."""
        edges = self._resources[name].transitions
        return tuple(edge.target for edge in edges if edge.extern and edge.source == self._states[name])

    def apply(
        self, transitions: Transitions, now: float, text: str, *, cause: str | None, goal_id: str | None = None
    ) -> None:
        """Take transitions without an `obstacle`, as one change set. Staying in a state is no change."""
        changing = [(name, target) for name, target in transitions if self._states[name] != target]
        if not changing:
            return
        self._change_set += 1
        for name, target in changing:
            before, self._states[name] = self._states[name], target
            record = self._outbox.record(
                now, RecordKind.RESOURCE, name, before, target, text, cause=cause, goal_id=goal_id
            )
            self._last_change[name] = (self._change_set, record)
            self._on_entry(self._entry_of(name))

    def latest_change(self, names: Collection[str]) -> tuple[str, str] | None:
        """The resource that changed last, of these, and the record of its change; None if none ever changed.

        If one effect changed several, the answer is the one declared first, in every process.
        """
        changed = [name for name in self._resources if name in names and name in self._last_change]
        if not changed:
            return None
        latest = max(changed, key=lambda name: self._last_change[name][0])
        return latest, self._last_change[latest][1]

    def _entry_of(self, name: str) -> ResourceEntry:
        return ResourceEntry(name, self._states[name], *self._last_change.get(name, (0, "")))
