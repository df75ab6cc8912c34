"""`recording.json` is always readable, has a fixed size, and says what is missing."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import ClassVar

from hypothesis import given, settings
from hypothesis import strategies as st

from skillwing.services.history.recording_state import (
    MOST_GAPS,
    STATE_BYTES,
    STATE_FILE,
    Gap,
    RecordingState,
    StateFile,
    missing_sentences,
    read_state,
)
from skillwing.services.recording.retention import Retention
from skillwing.services.recording.upkeep import Upkeep


def test_what_was_written_is_read_and_the_file_never_grows(tmp_path: Path) -> None:
    file, state = StateFile(tmp_path), RecordingState(keep=100)
    assert read_state(tmp_path) == RecordingState()
    for number in range(200):
        state = state.with_gap(Gap(begin=number, end=number + 0.5, why="No space left on device", lost={"x": 1}))
        assert file.write(state)
        assert (tmp_path / STATE_FILE).stat().st_size == STATE_BYTES
        assert read_state(tmp_path) == state
    assert len(state.gaps) == MOST_GAPS
    assert sum(gap.lost["x"] for gap in state.gaps) == 200, "earlier gaps are taken together"


def test_sentences_are_about_the_asked_time_only() -> None:
    state = RecordingState(keep=10_000_000_000).with_gap(
        Gap(begin=100.0, end=160.0, why="No space left on device", lost={"timeline.jsonl": 312, "goals.jsonl": 0})
    )
    state = state.with_deleted("timeline.jsonl", 16_000_000, 50.0).with_deleted("steps", 8_000_000, None)
    assert missing_sentences(state, 200.0, 300.0) == []
    assert missing_sentences(state, 150.0, 300.0) == [
        "Nothing could be written from 100.00 s to 160.00 s: No space left on device. Missing: 312 in timeline.jsonl."
    ]
    assert missing_sentences(state, 0.0, 99.0) == [
        "What was recorded until 50.00 s was deleted to keep the run below 10 GB: "
        "1 part of steps (8 MB), 1 part of timeline.jsonl (16 MB)."
    ]
    lasting = RecordingState().with_gap(Gap(begin=7.0, why="No space left on device"))
    assert lasting.failing is not None
    assert missing_sentences(lasting, 8.0, 9.0) == ["Nothing can be written since 7.00 s: No space left on device."]


class Writer:
    """A writer on a disk that is full at times."""

    full: ClassVar[bool] = False

    def __init__(self) -> None:
        self.name, self.failure, self.lost, self.total = "x.jsonl", "", 0, 0

    def write(self) -> None:
        if self.failure or Writer.full:
            self.failure, self.lost, self.total = "No space left on device", self.lost + 1, self.total + 1

    def retry(self) -> None:
        if not Writer.full:
            self.failure = ""

    def take_lost(self) -> int:
        lost, self.lost = self.lost, 0
        return lost


@given(st.lists(st.tuples(st.booleans(), st.integers(0, 3)), max_size=60))
@settings(max_examples=60)
def test_every_lost_line_is_in_a_gap_and_gaps_end(seconds: list[tuple[bool, int]]) -> None:
    with TemporaryDirectory() as folder:
        writer = Writer()
        upkeep = Upkeep(Path(folder), [writer], Retention(Path(folder), 100), lambda: not Writer.full)
        told: list[Gap] = []
        for number, (full, writes) in enumerate([*seconds, (False, 0), (False, 0)]):
            Writer.full = full
            for _ in range(writes):
                writer.write()
            if (gap := upkeep.check(float(number))) is not None:
                told.append(gap)
        assert upkeep.state.failing is None
        assert sum(gap.lost.get("x.jsonl", 0) for gap in upkeep.state.gaps) == writer.total
        assert [gap.end is None for gap in told] == [True, False] * (len(told) // 2), "each is told twice"
        assert read_state(Path(folder)) == upkeep.state
