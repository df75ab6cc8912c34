"""`recording.json`: what is missing in the recording of a run, and why.

The file has a fixed size. It is reserved when the recorder begins, and written in place, so that it can be written on a
full disk. It has no parts, and is never deleted.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

import msgspec
from msgspec.structs import replace

from skillwing.services.history.wording import time_text
from skillwing.services.sizes import size_text

STATE_FILE = "recording.json"
STATE_BYTES = 16 << 10
MOST_GAPS = 50
"""Gaps that are listed; earlier ones are taken together."""


class Gap(msgspec.Struct, frozen=True, kw_only=True):
    """A time without writing, as on a full disk. begin, end: robot time in seconds; end is None while it lasts.

    why: the reason of the operating system. lost: number of lost lines or blocks, by file.
    """

    begin: float
    end: float | None = None
    why: str = ""
    lost: dict[str, int] = {}


class Deleted(msgspec.Struct, frozen=True, kw_only=True):
    """Deleted parts of one file. until: robot time of the last deleted line; None for files without times."""

    parts: int = 0
    size: int = 0
    until: float | None = None


class RecordingState(msgspec.Struct, frozen=True, kw_only=True):
    """State of a recording. keep: bytes that its files may have; None without a limit.

    mission_since: Unix time from which files belong to a mission that runs; None without one. deleted: by file.
    """

    keep: int | None = None
    mission_since: float | None = None
    deleted: dict[str, Deleted] = {}
    gaps: tuple[Gap, ...] = ()

    @property
    def failing(self) -> Gap | None:
        """The gap that lasts; None while everything is written."""
        return self.gaps[-1] if self.gaps and self.gaps[-1].end is None else None

    def with_deleted(self, name: str, size: int, until: float | None) -> RecordingState:
        """The state after the deletion of a part."""
        before = self.deleted.get(name, Deleted())
        times = [t for t in (before.until, until) if t is not None]
        after = Deleted(parts=before.parts + 1, size=before.size + size, until=max(times, default=None))
        return replace(self, deleted={**self.deleted, name: after})

    def with_gap(self, gap: Gap) -> RecordingState:
        """The state with a further gap, or with news of the one that lasts."""
        gaps = [*(self.gaps[:-1] if self.failing is not None else self.gaps), gap]
        while len(gaps) > MOST_GAPS:
            gaps[:2] = [_joined(gaps[0], gaps[1])]
        return replace(self, gaps=tuple(gaps))


def _joined(one: Gap, other: Gap) -> Gap:
    return Gap(begin=one.begin, end=other.end, why=other.why, lost=add_up((one.lost, other.lost)))


def add_up(counts: Iterable[dict[str, int]]) -> dict[str, int]:
    """The sums of some counts, by name."""
    total: dict[str, int] = {}
    for each in counts:
        for name, count in each.items():
            total[name] = total.get(name, 0) + count
    return total


def missing_sentences(state: RecordingState, begin: float, end: float) -> list[str]:
    """Sentences on what is missing between two robot times; none if nothing is."""
    gaps = [gap for gap in state.gaps if gap.begin <= end and (gap.end is None or gap.end >= begin)]
    return [*map(gap_sentence, gaps), *_deletions(state, begin)]


def gap_sentence(gap: Gap) -> str:
    """A sentence on one gap."""
    lost = ", ".join(f"{count} in {name}" for name, count in sorted(gap.lost.items()) if count)
    missing = f" Missing: {lost}." if lost else ""
    if gap.end is None:
        return f"Nothing can be written since {time_text(gap.begin)}: {gap.why}.{missing}"
    return f"Nothing could be written from {time_text(gap.begin)} to {time_text(gap.end)}: {gap.why}.{missing}"


def _deletions(state: RecordingState, begin: float) -> list[str]:
    gone = {name: each for name, each in state.deleted.items() if each.until is None or each.until >= begin}
    if not any(each.until is not None for each in gone.values()):
        return []
    until = max(each.until for each in gone.values() if each.until is not None)
    limit = "" if state.keep is None else f" to keep the run below {size_text(state.keep)}"
    parts = ", ".join(
        f"{each.parts} part{'' if each.parts == 1 else 's'} of {name} ({size_text(each.size)})"
        for name, each in sorted(gone.items())
    )
    return [f"What was recorded until {time_text(until)} was deleted{limit}: {parts}."]


def read_state(run_dir: Path) -> RecordingState:
    """The state of a run's recording; an empty one for a run without a readable file."""
    for _ in range(2):  # the file may be written at this moment
        with suppress(OSError, msgspec.DecodeError):
            return msgspec.json.decode((run_dir / STATE_FILE).read_bytes(), type=RecordingState)
    return RecordingState()


class StateFile:
    """Writer of `recording.json`. It raises nothing: `write` returns False if the disk takes nothing."""

    def __init__(self, run_dir: Path) -> None:
        self._path = run_dir / STATE_FILE

    def write(self, state: RecordingState) -> bool:
        content = msgspec.json.encode(state)
        while len(content) > STATE_BYTES - 1 and state.gaps:
            state = replace(state, gaps=state.gaps[len(state.gaps) // 2 + 1 :])
            content = msgspec.json.encode(state)
        padded = content.ljust(STATE_BYTES - 1) + b"\n"
        try:
            file = os.open(self._path, os.O_WRONLY | os.O_CREAT | os.O_CLOEXEC, 0o666)
            try:
                return os.pwrite(file, padded, 0) == len(padded)
            finally:
                os.close(file)
        except OSError:
            return False
