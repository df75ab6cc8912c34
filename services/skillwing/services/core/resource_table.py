"""The states of all resources, which change by whole effects or not at all."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from types import MappingProxyType
from typing import TypeAlias

from skillwing.dsl.model import Skillset
from skillwing.services.core.outbox import Outbox
from skillwing.services.core.snapshot import OnEntry, ResourceEntry
from skillwing.services.protocol import Lost, RecordKind, ResourceChange, Violated

Event: TypeAlias = ResourceChange | Violated | Lost
Transitions: TypeAlias = Iterable[tuple[str, str]]
"""(resource, target state) pairs."""


class ResourceTable:
    """State of each resource of a skillset; changes go to a scribe, and what must not be forgotten to `keep`.

    found: the states at first, instead of the initial ones; kept: those that a predecessor of this process has kept.
    """

    def __init__(
        self,
        skillset: Skillset,
        scribe: Outbox[Event],
        keep: OnEntry,
        *,
        found: Mapping[str, str] | None = None,
        kept: Iterable[ResourceEntry] = (),
    ) -> None:
        self._resources = {resource.name: resource for resource in skillset.resources}
        self._states = {resource.name: resource.initial for resource in skillset.resources} | dict(found or {})
        self._outbox = scribe
        self._keep = keep
        self._last_change: dict[str, tuple[int, str]] = {}
        for stands in kept:
            self._states[stands.resource] = stands.state
            if stands.revision:
                self._last_change[stands.resource] = (stands.revision, stands.record)
        self.revision = max((revision for revision, _ in self._last_change.values()), default=0)
        """Grows by one with every change set."""

    @property
    def states(self) -> Mapping[str, str]:
        """A live view."""
        return MappingProxyType(self._states)

    def initial_entries(self) -> tuple[ResourceEntry, ...]:
        """Every resource as it stands."""
        return tuple(self._entry_of(name) for name in self._states)

    def obstacle(self, transitions: Transitions, *, extern: bool = False) -> str | None:
        """None if all transitions may be taken now, else a sentence on the first that may not."""
        for name, target in transitions:
            source = self._states[name]
            if not self._resources[name].allows(source, target, extern):
                kind = "extern" if extern else "internal"
                return f"`{name}` has no {kind} transition from {source} to {target}."
        return None

    def extern_targets(self, name: str) -> tuple[str, ...]:
        """Where the functional layer may bring a resource from its present state."""
        edges = self._resources[name].transitions
        return tuple(edge.target for edge in edges if edge.extern and edge.source == self._states[name])

    def apply(
        self, transitions: Transitions, now: float, text: str, *, cause: str | None, goal_id: str | None = None
    ) -> None:
        """Take transitions that `obstacle` has let through, as one change set. Staying in a state is no change."""
        changing = [(name, target) for name, target in transitions if self._states[name] != target]
        if not changing:
            return
        self.revision += 1
        for name, target in changing:
            before, self._states[name] = self._states[name], target
            record = self._outbox.record(
                now, RecordKind.RESOURCE, name, before, target, text, cause=cause, goal_id=goal_id
            )
            self._last_change[name] = (self.revision, record)
            self._keep(self._entry_of(name))
            self._outbox.add(
                ResourceChange(
                    resource=name,
                    before=before,
                    after=target,
                    revision=self.revision,
                    t=now,
                    record=record,
                    cause=cause,
                )
            )

    def latest_change(self, names: Collection[str]) -> tuple[str, str] | None:
        """Of these resources the one that changed last, and the record of it; None if none ever changed.

        Of several that one effect has changed it is the one declared first, in every process.
        """
        changed = [name for name in self._resources if name in names and name in self._last_change]
        if not changed:
            return None
        latest = max(changed, key=lambda name: self._last_change[name][0])
        return latest, self._last_change[latest][1]

    def _entry_of(self, name: str) -> ResourceEntry:
        return ResourceEntry(name, self._states[name], *self._last_change.get(name, (0, "")))
