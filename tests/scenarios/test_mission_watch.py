"""The live view of `skillwing mission watch`."""

from __future__ import annotations

from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import msgspec
from flights import KEYS, M600, Flight
from msgspec.structs import replace
from rich.console import Console

from faulty_network import FaultyNetwork
from skillwing.bt_missions.cli.on_board import NEWS_WAIT, OnBoardWatch
from skillwing.bt_missions.cli.watch import MissionWatch
from skillwing.m600.robot import ROBOT
from skillwing.services.bus import Bus
from skillwing.services.history.files import TIMELINE_FILE, JsonLines
from skillwing.services.history.history import History
from skillwing.services.history.report import make_report
from skillwing.services.processes.launcher_node import LauncherNode
from skillwing.services.processes.process_state import ProcessState
from skillwing.services.protocol import MissionPhase, MissionStatus, Record, RecordKind, StartMission, encode
from skillwing.services.report.rendering import write_report
from skillwing.services.robot import ProcessSpec


def watched(flight: Flight, run_dir: Path | None = None, *, shared: bool = False) -> MissionWatch:
    return watch_on(flight.network.bus("watcher"), run_dir, shared=shared)


def watch_on(bus: Bus, run_dir: Path | None = None, *, shared: bool = False) -> MissionWatch:
    endpoint, without_goals = "tcp/elsewhere:7447", "It holds its position."
    target = SimpleNamespace(run_dir=run_dir, endpoint=endpoint, without_goals=without_goals, shared=shared)
    system: Any = SimpleNamespace(bus=bus, keys=KEYS, skillset=M600, target=target, addressed=str)
    return MissionWatch(system)


def seen(watch: MissionWatch, height: int | None = None) -> str:
    text = StringIO()
    Console(width=140, file=text, color_system=None).print(watch.view(height))
    return text.getvalue()


def test_the_view_shows_status_tree_skills_and_reasons_of_branch_switches() -> None:
    flight = Flight()
    watch = watched(flight)
    assert "No mission runs now, and none has run here." in seen(watch)
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
    """The report of a mission comes seconds after its end; until then the one before is not called the last."""
    record(tmp_path, "mapping", "SUCCEEDED", 10.0)
    report(tmp_path / "1-mapping", "mapping", "success")
    told = last_one(tmp_path)
    assert "The last one, `mapping`, succeeded" in told
    assert told.replace(" ", "").endswith(f"itsreportisin{tmp_path}/1-mapping.")
    record(tmp_path, "patrol", "ABORTED", 30.0)
    assert last_one(tmp_path).endswith("The last one, `patrol`, was aborted; its report is not written yet.")
    report(tmp_path / "2-patrol", "patrol", "aborted")
    assert last_one(tmp_path).replace(" ", "").endswith(f"itsreportisin{tmp_path}/2-patrol.")


def test_the_report_may_know_an_end_that_is_not_recorded(tmp_path: Path) -> None:
    record(tmp_path, "mapping", None, 10.0)
    assert "`mapping`, was cut short" in last_one(tmp_path)
    report(tmp_path / "1-mapping", "mapping", "failure")
    assert "`mapping`, failed" in last_one(tmp_path)


def test_at_a_shared_robot_the_report_is_said_to_be_in_the_run_of_another(tmp_path: Path) -> None:
    record(tmp_path, "righty", None, 10.0)
    assert "`righty`, runs, or was cut short; its report is in the run of the robot" in last_one(tmp_path, shared=True)
    record(tmp_path, "lefty", "SUCCEEDED", 20.0)
    told = last_one(tmp_path, shared=True)
    assert told.startswith("No mission occupies this robot")
    assert "`lefty`, succeeded; its report is in the run of the robot that it occupies." in told


def record(run_dir: Path, mission: str, end: str | None, t: float) -> None:
    """Record the phases of a mission; end: None for an end that the recorder missed."""
    phases = [("IDLE", "RUNNING"), *([] if end is None else [("RUNNING", end)])]
    with JsonLines[Record](run_dir / TIMELINE_FILE) as file:
        for number, (before, after) in enumerate(phases):
            file.write(
                Record(
                    id=f"{mission}#{number}",
                    t=t + number,
                    source="mission",
                    kind=RecordKind.MISSION,
                    subject=mission,
                    before=before,
                    after=after,
                )
            )


def report(folder: Path, mission: str, result: str) -> None:
    history = History(M600)
    write_report(msgspec.structs.replace(make_report(history, mission=mission), result=result), history, folder)


def last_one(run_dir: Path, *, shared: bool = False) -> str:
    return " ".join(seen(watched(Flight(), run_dir, shared=shared)).split())


@dataclass
class NoLauncher:
    """A launcher that starts nothing."""

    run_dir: Path = Path("run")
    states: tuple[ProcessState, ...] = ()

    def launch(self, spec: ProcessSpec, log: str) -> None:
        raise AssertionError(f"{spec.name} is not to be started, with the log {log}")

    def forget(self, name: str) -> None:
        raise AssertionError(f"{name} is not to be forgotten")


def test_a_view_on_a_cut_link_that_has_heard_of_no_mission_does_not_say_that_none_runs() -> None:
    network = FaultyNetwork()
    bus = network.join("watcher")
    watch = watch_on(bus)
    network.run_for(1.0)
    assert seen(watch).startswith("No mission runs now")
    network.cut(bus)
    network.run_for(3.0)
    warning, rest = seen(watch).splitlines()
    assert warning.startswith("tcp/elsewhere:7447 has not answered since ")
    assert rest == "Until then, nothing was heard of a mission here."
    network.reconnect(bus)
    network.run_for(3.0)
    assert seen(watch).startswith("No mission runs now")


def test_a_station_learns_that_another_launcher_does_not_know_its_mission() -> None:
    network = FaultyNetwork()
    network.attach(LauncherNode(NoLauncher(), ROBOT, M600.name, {}))
    begun = MissionStatus(mission="patrol", phase=MissionPhase.IDLE, t=0.0, text="", request_id="1")
    target = SimpleNamespace(endpoint="tcp/elsewhere:7447", without_goals="")
    system: Any = SimpleNamespace(
        bus=network.join("station"), keys=KEYS, target=target, ask=lambda key, message, reply: begun
    )
    shown: list[MissionStatus] = []
    station = OnBoardWatch(system, shown.append)
    station.start(StartMission(request_id="1", mission="patrol", client="cli"))
    of_another = network.bus("mission").advertise(KEYS.mission_status, events=True)
    of_another.put(encode(replace(begun, mission="mapping", request_id="2", phase=MissionPhase.FAILED)))
    network.run_for(NEWS_WAIT + 1.0)
    assert shown == []
    assert not station.over
    assert station.forgotten


def test_a_watcher_whose_link_was_away_learns_of_the_end_from_the_launcher() -> None:
    network = FaultyNetwork()
    flight = Flight(network=network)
    network.attach(LauncherNode(NoLauncher(), ROBOT, M600.name, {}))
    bus = network.join("watcher")
    watch = watch_on(bus)
    network.run_for(10.0)
    assert watch.status is not None
    network.cut(bus)
    network.run_for(3.0)
    assert "tcp/elsewhere:7447 has not answered since " in seen(watch)
    assert "A mission on board goes on. It holds its position." in seen(watch)
    flight.until(lambda: flight.node.over)
    network.run_for(1.0)
    flight.buses["mission"].close()
    assert not watch.over
    network.reconnect(bus)
    network.run_for(5.0)
    assert watch.over
    assert watch.status == flight.node.status
    assert "has not answered" not in seen(watch)
