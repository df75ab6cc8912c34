"""Rows of logs and lanes: many reach Rerun in one call, in their order, and none waits for ever."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest
import rerun as rr

from skillwing.services.recording import row_buffer
from skillwing.services.recording.row_buffer import RowBuffer


class Calls(rr.RecordingStream):
    """A recording that only notes the calls: entity, times in seconds, and values of each column."""

    def __init__(self) -> None:
        super().__init__("rows")
        self.calls: list[tuple[str, list[float], list[list[str]]]] = []

    def send_columns(
        self, entity_path: str, indexes: Iterable[Any], columns: Iterable[Any], *, strict: bool | None = None
    ) -> None:
        del strict
        (times,) = indexes
        seconds = [each / 1e9 for each in times.as_arrow_array().cast("int64").to_pylist()]
        values = [[value for (value,) in each.as_arrow_array().to_pylist()] for each in columns]
        self.calls.append((entity_path, seconds, values))


def test_rows_of_one_entity_are_one_call_in_their_order() -> None:
    recording = Calls()
    rows = RowBuffer(recording, "t")
    rows.add_state("skills/go", 2.0, "RUNNING")
    rows.add_line("log/goal", 2.0, "begins", "INFO")
    rows.add_state("skills/go", 2.0, "S_DONE")
    rows.add_line("log/goal", 1.5, "late", "WARN")
    assert recording.calls == []
    rows.send()
    assert recording.calls == [
        ("log/goal", [2.0, 1.5], [["begins", "late"], ["INFO", "WARN"]]),
        ("skills/go", [2.0, 2.0], [["RUNNING", "S_DONE"]]),
    ]
    rows.send()
    assert len(recording.calls) == 2


def test_the_first_row_that_waits_asks_for_a_call() -> None:
    woken: list[int] = []
    rows = RowBuffer(Calls(), "t")
    rows.wake = lambda: woken.append(1)
    for _ in range(2):
        rows.add_state("skills/go", 1.0, "RUNNING")
        rows.add_state("skills/go", 2.0, "")
        rows.send()
    assert woken == [1, 1]


def test_so_many_rows_do_not_wait(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(row_buffer, "MOST_ROWS", 3)
    recording = Calls()
    rows = RowBuffer(recording, "t")
    for number in range(7):
        rows.add_line("log/goal", float(number), "x", "INFO")
    assert [times for _, times, _ in recording.calls] == [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]]
