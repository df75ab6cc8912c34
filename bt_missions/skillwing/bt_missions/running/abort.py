"""Calling a mission off from outside: `AbortMission` to `Keys.mission_abort`, answered by a `MissionStatus`."""

from __future__ import annotations

from skillwing.services.protocol import Message


class AbortMission(Message, frozen=True, kw_only=True):
    """Interrupt everything, land, and end the mission as ABORTED. Repeating it changes nothing."""

    reason: str = "aborted by the operator"
