"""Retention of a run: which old parts of its files are deleted, so that it stays below a size."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from skillwing.services.history.files import GOALS_FILE, TIMELINE_FILE, last_time
from skillwing.services.history.mission_intervals import FOLDERS
from skillwing.services.history.parts import part_paths
from skillwing.services.history.recording_state import RecordingState
from skillwing.services.names import STEPS_FOLDER
from skillwing.services.replay.files import step_files

RECORDING_FILE = "recording.rrd"
FILES = (TIMELINE_FILE, GOALS_FILE, RECORDING_FILE)
"""Files in parts of every run; a robot may have more."""
KEEP = 10_000_000_000
"""Bytes that the files of a run may have by default."""
_PARTS_OF_ALL = 100
"""Number of full parts of lines in the size of a run."""
LARGEST_PART, LEAST_PART = 16_000_000, 1_000_000
RECORDING_PARTS = 4
"""Size of a part of `recording.rrd`, in parts of lines."""


def part_bytes(keep: int) -> int:
    """Size of the parts of lines for a run of that size."""
    return min(LARGEST_PART, max(LEAST_PART, keep // _PARTS_OF_ALL))


@dataclass(frozen=True, slots=True)
class Part:
    """A part of a file. name: of its first part. size: bytes. written: Unix time of its last change.

    present: it is the newest of its file, which is never deleted.
    """

    path: Path
    name: str
    size: int
    written: float
    present: bool = False


def deletable(parts: Sequence[Part], keep: int, since: float | None) -> list[Part]:
    """The oldest parts, so many that the others have at most `keep` bytes.

    since: Unix time from which parts belong to a mission that runs, and stay; None without one. Pure.
    """
    excess = sum(part.size for part in parts) - keep
    chosen: list[Part] = []
    for part in sorted(parts, key=lambda each: (each.written, each.path.name)):
        if excess <= 0:
            break
        if not part.present and (since is None or part.written < since):
            chosen.append(part)
            excess -= part.size
    return chosen


def find_parts(run_dir: Path, names: Iterable[str]) -> list[Part]:
    """The parts of those files of a run, and of its steps."""
    found: list[Part] = []
    for name in names:
        found += _parts(name, part_paths(run_dir, name))
    return found + _parts(STEPS_FOLDER, step_files(run_dir / STEPS_FOLDER))


def _parts(name: str, paths: Sequence[Path]) -> list[Part]:
    found: list[Part] = []
    for path in paths:
        with suppress(OSError):  # it was deleted meanwhile
            stat = path.stat()
            found.append(Part(path, name, stat.st_size, stat.st_mtime, present=path == paths[-1]))
    return found


def mission_bytes(run_dir: Path) -> int:
    """Size of the files in the folders of a run's missions, which are never deleted."""
    total = 0
    for path in run_dir.glob(f"{FOLDERS}/*"):
        with suppress(OSError):  # it was deleted meanwhile
            total += path.stat().st_size
    return total


class Retention:
    """The retention of one run. keep: bytes. names: of the files with parts, beyond those of the recorder.

    The folders of missions count. With each mission, old parts give way to its report and its map.
    """

    def __init__(self, run_dir: Path, keep: int, names: Iterable[str] = ()) -> None:
        self.keep = keep
        self._run_dir = run_dir
        self._names = (*FILES, *names)

    def apply(self, state: RecordingState) -> RecordingState:
        """Delete old parts. Returns the state with what was deleted."""
        room = self.keep - mission_bytes(self._run_dir)
        for part in deletable(find_parts(self._run_dir, self._names), room, state.mission_since):
            until = last_time(part.path) if part.path.suffix == ".jsonl" else None
            try:
                part.path.unlink()
            except OSError:
                continue
            state = state.with_deleted(part.name, part.size, until)
        return state
