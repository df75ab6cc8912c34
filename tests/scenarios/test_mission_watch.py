"""What somebody sees who watches a mission."""

from __future__ import annotations

from io import StringIO
from types import SimpleNamespace
from typing import Any

from flights import KEYS, M600, Flight
from rich.console import Console

from skillwing.bt_missions.watching import MissionWatch


def watched(flight: Flight) -> MissionWatch:
    system: Any = SimpleNamespace(bus=flight.network.bus("watcher"), keys=KEYS, skillset=M600)
    return MissionWatch(system)


def seen(watch: MissionWatch, height: int | None = None) -> str:
    console = Console(width=140, file=StringIO(), color_system=None)
    console.print(watch.picture(height))
    return console.file.getvalue()


def test_the_picture_shows_status_tree_skills_and_why_branches_were_changed() -> None:
    flight = Flight()
    watch = watched(flight)
    assert "No mission has flown here yet" in seen(watch)
    flight.at(17.0, lambda: flight.drone.set("zed_status", "FAILED"))
    flight.network.run_for(22.0)
    picture = seen(watch)
    assert "RUNNING" in picture.splitlines()[0]
    assert "▶ LiDAR branch" in picture
    assert "· ZED branch" in picture
    assert [line for line in picture.splitlines() if line.startswith("lidar_mapping") and "█" in line]
    assert [line for line in picture.splitlines() if line.startswith("zed_depthmap") and "RI" in line]
    assert [line for line in picture.splitlines() if line.startswith("goto ") and "█" in line]
    assert "because  zed_status FAILED -> " in picture
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
