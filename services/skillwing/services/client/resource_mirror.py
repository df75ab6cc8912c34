"""A client's copy of the resource states, from changes that may overtake each other."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from skillwing.services.protocol import ResourceChange, ResourceStates


class ResourceMirror:
    """A merge of snapshots and changes, in any order, each any number of times."""

    def __init__(self) -> None:
        self._states: dict[str, str] = {}
        self._revisions: dict[str, int] = {}
        self._records: dict[str, str] = {}
        self.ready = False

    @property
    def states(self) -> Mapping[str, str]:
        """Live view; empty until the first snapshot."""
        return MappingProxyType(self._states) if self.ready else MappingProxyType({})

    def change_record(self, resource: str) -> str | None:
        """Id of the timeline record of the resource's last change; None if no change was seen."""
        return self._records.get(resource)

    def take_snapshot(self, snapshot: ResourceStates) -> None:
        for resource, state in snapshot.states.items():
            if snapshot.revision >= self._revisions.get(resource, -1):
                self._states[resource] = state
                self._revisions[resource] = snapshot.revision
        self.ready = True

    def take_change(self, change: ResourceChange) -> bool:
        """Take a change. False if a newer state of that resource is known."""
        if change.revision < self._revisions.get(change.resource, -1):
            return False
        self._revisions[change.resource] = change.revision
        self._states[change.resource] = change.after
        self._records[change.resource] = change.record
        return True

    def expect_new_manager(self) -> None:
        """Accept the lower revisions of a new manager. States stay as they were until its snapshot arrives."""
        self._revisions.clear()
