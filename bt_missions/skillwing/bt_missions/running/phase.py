"""The phases of a mission that `MissionStatus` and the timeline know."""

from __future__ import annotations

from enum import StrEnum


class Phase(StrEnum):
    """PAUSED: by the operator, until he resumes it. HELD: the safety pilot has the drone, until he gives it back."""

    IDLE = "IDLE"
    RUNNING = "RUNNING"
    PAUSED = "PAUSED"
    HELD = "HELD"
    SUCCEEDED = "SUCCEEDED"
    FAILED = "FAILED"
    ABORTED = "ABORTED"


ENDED = frozenset({Phase.SUCCEEDED, Phase.FAILED, Phase.ABORTED})
