"""The live view of `skillwing mission watch`."""

from __future__ import annotations

import os
from io import StringIO
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import msgspec
from flights import KEYS, M600, Flight
from rich.console import Console

from skillwing.bt_missions.cli.watch import MissionWatch
from skillwing.services.history.history import History
from skillwing.services.history.report import make_report
from skillwing.services.report.rendering import write_report


def watched(flight: Flight, run_dir: Path | None = None) -> MissionWatch:
    target = SimpleNamespace(run_dir=run_dir)
    system: Any = SimpleNamespace(bus=flight.network.bus("watcher"), keys=KEYS, skillset=M600, target=target)
    return MissionWatch(system)


def seen(watch: MissionWatch, height: int | None = None) -> str:
    text = StringIO()
    Console(width=140, file=text, color_system=None).print(watch.view(height))
    return text.getvalue()


def test_the_view_shows_status_tree_skills_and_reasons_of_branch_switches() -> None:
    flight = Flight()
    watch = watched(flight)
    assert "No mission runs now, and none has left a report here." in seen(watch)
    flight.at(17.0, lambda: flight.drone.set("zed_status", "FAILED"))
    flight.network.run_for(22.0)
    view = seen(watch)
    assert "RUNNING" in view.splitlines()[0]
    assert "▶ LiDAR branch" in view
    assert "· ZED branch" in view
    assert [line for line in view.splitlines() if line.startswith("lidar_mapping") and "█" in line]
    assert [line for line in view.splitlines() if line.startswith("zed_depthmap") and "RI" in line]
    assert [line for line in view.splitlines() if line.startswith("goto ") and "█" in line]
    assert "because  zed_status FAILED -> " in view
    assert not watch.over
    flight.fly()
    assert watch.over
    assert not watch.failed


def test_on_a_small_screen_what_runs_is_shown_first() -> None:
    flight = Flight()
    watch = watched(flight)
    flight.network.run_for(12.0)
    small = seen(watch, 24)
    assert len(small.splitlines()) <= 24
    assert "▶ goto_straight" in small
    assert "· rotate_head" not in small


def test_one_who_comes_late_sees_the_same() -> None:
    flight = Flight()
    flight.fly()
    late = watched(flight)
    flight.network.run_for(1.0)
    assert late.complete
    assert "SUCCEEDED" in seen(late)
    assert "S_LANDED" in seen(late)


def test_where_none_flies_the_last_one_and_its_report_are_named(tmp_path: Path) -> None:
    history = History(M600)
    for place, (name, result) in enumerate({"1-mapping": "success", "2-patrol": "aborted"}.items()):
        report = msgspec.structs.replace(make_report(history, mission=name[2:]), result=result)
        write_report(report, history, tmp_path / name)
        os.utime(tmp_path / name / "report.json", (place, place))
    told = " ".join(seen(watched(Flight(), tmp_path)).split())
    assert "The last one, `patrol`, was aborted" in told
    assert told.replace(" ", "").endswith(f"itsreportisin{tmp_path}/2-patrol.")
