"""Extern resources follow the functional layer by level, not by edge.

A lost request, a restart of either side or an unlucky order of start heals by itself, because what counts is not that
a transition was asked for but that the resource stands where the robot is.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Level:
    """Where a resource should stand, and the timeline record of why."""

    resource: str
    state: str
    cause: str | None


class ExternLevels:
    """What the functional layer says the extern resources should be. Pure."""

    def __init__(self) -> None:
        self._levels: dict[str, Level] = {}

    def wanted(self, resource: str) -> str | None:
        """The state that the resource should have, None while nobody knows."""
        level = self._levels.get(resource)
        return None if level is None else level.state

    def want(self, resource: str, state: str, cause: str | None) -> None:
        """From now on the resource should be in `state`; `cause` is the record of what made it so."""
        self._levels[resource] = Level(resource, state, cause)

    def mismatches(self, states: Mapping[str, str]) -> list[Level]:
        """The resources among the known `states` that are not where they should be."""
        return [
            level
            for level in self._levels.values()
            if level.resource in states and states[level.resource] != level.state
        ]
