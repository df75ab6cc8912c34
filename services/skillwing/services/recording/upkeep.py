"""Upkeep of a run's files: gaps of a full disk, and the deletion of old parts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from msgspec.structs import replace

from skillwing.services.history.recording_state import Gap, RecordingState, StateFile, add_up, read_state
from skillwing.services.recording.retention import Retention

AFTER_MISSION = 60.0
"""Seconds after a mission for which its files are kept: its report is made from them."""

MOST_MISSIONS = 1000
"""Missions that run beside one another at a shared robot, of which the files are kept."""


class Writer(Protocol):
    """A writer of one file. failure: the reason why it cannot be written; empty while it can."""

    @property
    def name(self) -> str: ...

    @property
    def failure(self) -> str: ...

    def retry(self) -> None: ...

    def take_lost(self) -> int: ...


@dataclass(slots=True)
class _KeptMission:
    """A mission whose files are kept. since: Unix time of its begin; until: None while it runs. name: its process."""

    since: float
    name: str = ""
    until: float | None = None


class Upkeep:
    """Upkeep of the files of one run. Call `check` once a second.

    writers: of its files. retention: deletes old parts. has_room: tells whether the disk has room again.
    """

    def __init__(
        self, run_dir: Path, writers: Sequence[Writer], retention: Retention, has_room: Callable[[], bool]
    ) -> None:
        self._writers = tuple(writers)
        self._retention = retention
        self._has_room = has_room
        self._file = StateFile(run_dir)
        self._written: RecordingState | None = None
        self.state = replace(read_state(run_dir), keep=retention.keep)
        since = self.state.mission_since
        self._missions = [] if since is None else [_KeptMission(since)]
        """Missions whose files are kept, oldest first."""
        self._save()

    def check(self, now: float) -> Gap | None:
        """Note what was lost, try again where there is room, and write the state.

        now: robot time in seconds. Returns a gap that begins or ends, else None.
        """
        before = self.state.failing
        lost = add_up({each.name: each.take_lost()} for each in self._writers)
        failing = [each for each in self._writers if each.failure]
        if before is None and not failing:
            self._save()
            return None
        why = failing[0].failure if failing else ""
        gap = before or Gap(begin=now, why=why)
        gap = replace(gap, why=why or gap.why, lost=add_up((gap.lost, {name: n for name, n in lost.items() if n})))
        if failing and before is not None and self._has_room():
            for each in failing:
                each.retry()
            failing = [each for each in failing if each.failure]
        if not failing:
            gap = replace(gap, end=now)
        self.state = self.state.with_gap(gap)
        self._save()
        return gap if before is None or gap.end is not None else None

    def delete_old_parts(self, wall: float) -> None:
        """Apply the retention. wall: Unix time in seconds."""
        self._missions = [each for each in self._missions if each.until is None or each.until > wall]
        self._note_missions()
        self.state = self._retention.apply(self.state)
        self._save()

    def mission_runs(self, wall: float, name: str = "") -> None:
        """Keep all files from now on, because a mission runs. wall: Unix time in seconds. name: of its process."""
        running = [each.name for each in self._missions if each.until is None]
        if name not in running and len(running) < MOST_MISSIONS:
            self._missions.append(_KeptMission(wall, name))
            self._note_missions()

    def mission_is_over(self, wall: float, name: str | None = None) -> None:
        """A mission has ended. Without a name no mission has a process any more."""
        for each in self._missions:
            if each.until is None and name in (None, each.name):
                each.until = wall + AFTER_MISSION

    def _note_missions(self) -> None:
        since = self._missions[0].since if self._missions else None
        self.state = replace(self.state, mission_since=since)

    def _save(self) -> None:
        if self.state != self._written and self._file.write(self.state):
            self._written = self.state
