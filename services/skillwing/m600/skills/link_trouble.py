"""Memory of the link's last trouble: the timeline record that a bad video comes from."""

from __future__ import annotations

from skillwing.services.protocol import Record

GOOD = "GOOD"
AFTERMATH = 4.0
"""Time after the link's recovery in which a video that gets bad is still put down to it [s]. The ground's reports cover
a second and come late, and the video needs a new keyframe."""


class LinkTrouble:
    """The last time that `link_status` was not GOOD. Pure; times are robot time [s]."""

    def __init__(self) -> None:
        self._record: str | None = None
        self._ended_at: float | None = None

    def note(self, change: Record) -> None:
        """Take a change of `link_status`."""
        if change.after == GOOD:
            self._ended_at = change.t
        else:
            self._record, self._ended_at = change.id, None

    def cause_of_trouble(self, since: float) -> str | None:
        """Record of the change behind a video that has been bad since then; None if the link was good meanwhile."""
        is_behind = self._ended_at is None or since - self._ended_at <= AFTERMATH
        return self._record if is_behind else None
