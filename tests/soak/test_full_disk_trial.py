"""The trial of full disks itself, with one short outage, and its table. `make full-disk` runs it."""

from __future__ import annotations

from pathlib import Path

import pytest
from full_disk_figures import MissionOutage, Outage, table
from full_disk_mocks import MockedSystem

from small_disk import mounted, obstacle


def test_an_outage_in_which_the_resource_manager_is_killed_is_over_with_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if (reason := obstacle()) is not None:
        pytest.skip(reason)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    with mounted(tmp_path / "disk", 64 << 20) as disk, MockedSystem(disk, tmp_path) as system:
        system.work(1.0)
        outage = system.suffer(8.0, "resource_manager", 1.0)
        assert outage.problems == [], outage
        assert min(outage.goals, outage.unrecorded, outage.lost) > 0
        assert system.end() == []


def test_a_broken_promise_stands_out_in_the_table() -> None:
    outage = Outage(seconds=60.0, killed="recorder", goals=500, unrecorded=480, lost=7000, back=0.4)
    flight = MissionOutage(begin=31.0, seconds=60.0, code=0, result="success", missing=["Much."], same=True)
    text = table([outage], flight)
    assert "| recorder | 60 | 500 | 0 | 480 | 7000 | 0.4 s |" in text
    assert "full for 60 s from 31 s on" in text
    assert "Its report says: Much." in text
    assert "**" not in text
    outage.back, outage.problems = None, ["No goal ended."]
    assert "| **never** **No goal ended.** |" in table([outage], None)
