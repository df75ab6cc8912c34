"""Phases of a mission in `MissionStatus` and the timeline."""

from __future__ import annotations

from enum import StrEnum


class Phase(StrEnum):
    """PAUSED: by the operator, until a resume. HELD: the safety pilot has the drone."""

    IDLE = "IDLE"
    RUNNING = "RUNNING"
    PAUSED = "PAUSED"
    HELD = "HELD"
    SUCCEEDED = "SUCCEEDED"
    FAILED = "FAILED"
    ABORTED = "ABORTED"


ENDED = frozenset({Phase.SUCCEEDED, Phase.FAILED, Phase.ABORTED})
