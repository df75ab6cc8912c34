"""Output of the demo in a terminal and in a pipe, on the in-process bus."""

from __future__ import annotations

import io
from pathlib import Path

import pytest
from rich.console import Console

from skillwing.evaluation.demo.command import CALLED_OFF, IN_AIR, Flight, _ending_well
from skillwing.evaluation.demo.flight_deck import FlightDeck
from skillwing.m600.robot import ROBOT
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.history.files import (
    GOALS_FILE,
    TIMELINE_FILE,
    JsonLines,
    read_goals,
    read_records,
)
from skillwing.services.protocol import (
    Ending,
    GoalStatus,
    Keys,
    MissionPhase,
    MissionStatus,
    Record,
    RecordKind,
    State,
    Terminal,
    encode,
)

SKILLSET = ROBOT.load_skillset()
KEYS = Keys(SKILLSET.name)
TITLE = "Mission mapping, world 1, depth camera fails at 45 s"


def record(number: int, kind: RecordKind, subject: str, before: str | None, after: str, text: str = "") -> Record:
    return Record(
        id=f"teller#{number}",
        t=float(number),
        source="teller",
        kind=kind,
        subject=subject,
        before=before,
        after=after,
        text=text,
    )


HEALTH = [
    record(n, RecordKind.HEALTH, "zed", "OK", f"FAILED{n}", "it has sent nothing for as long as one can remember, " * 3)
    for n in range(30)
]
SWITCH = record(40, RecordKind.MISSION, "navigation", "ZED", "LiDAR")
FLYING = record(41, RecordKind.RESOURCE, "flight_status", "ON_GROUND", "IN_AIR")
TAKEOFF = GoalStatus(goal_id="g1", skill="takeoff", state=State.RUNNING, t=1.0)
TURNED = Terminal(ending=Ending.SUCCEEDED, reason="It has turned.", result="ALIGNED", success=True)
ENDED = [
    TAKEOFF,
    GoalStatus(
        goal_id="g1",
        skill="takeoff",
        state=State.TERMINATED,
        t=7.0,
        terminal=Terminal(ending=Ending.SUCCEEDED, reason="It is up.", result="AT_ALTITUDE", success=True),
    ),
    GoalStatus(goal_id="g2", skill="rotate_head", state=State.TERMINATED, t=8.0, terminal=TURNED),
    GoalStatus(goal_id="g3", skill="lidar_mapping", state=State.RUNNING, t=8.0),
]


def fly(*, width: int = 100, height: int = 30, terminal: bool = True) -> tuple[FlightDeck, str]:
    """A deck after all messages above, and its output: on a terminal, its last picture."""
    network = InProcessNetwork()
    bus = network.bus("demo")
    console = Console(file=io.StringIO(), force_terminal=terminal, width=width, height=height, color_system=None)
    deck = FlightDeck(bus, SKILLSET, console, TITLE)
    robot = network.bus("robot")
    timeline = robot.advertise(KEYS.timeline, events=True)
    for each in (*HEALTH, SWITCH, FLYING, SWITCH):
        timeline.put(encode(each))
    for status in ENDED:
        robot.advertise(KEYS.status(status.skill), events=True).put(encode(status))
    flying = MissionStatus(mission="mapping", phase=MissionPhase.RUNNING, t=8.0, text="goto", waypoint=1, waypoints=4)
    robot.advertise(KEYS.mission_status, events=True).put(encode(flying))
    network.run_for(0.1)
    if not terminal:
        assert isinstance(console.file, io.StringIO)
        return deck, console.file.getvalue()
    with console.capture() as captured:
        console.print(deck.picture())
    return deck, captured.get()


def test_a_flight_that_is_called_off_says_whether_the_drone_was_in_the_air() -> None:
    deck, _ = fly()
    flying, waiting = Flight((), deck=deck), Flight(())
    for flight in (flying, waiting):
        with _ending_well(flight):
            raise KeyboardInterrupt
    assert flying.ended_by == f"{CALLED_OFF} {IN_AIR}"
    assert waiting.ended_by == CALLED_OFF


@pytest.mark.parametrize(("width", "height"), [(100, 30), (80, 24), (50, 16), (200, 80)])
def test_the_panel_fits_the_screen_and_ends_with_the_latest_event(width: int, height: int) -> None:
    _, panel = fly(width=width, height=height)
    lines = panel.splitlines()
    assert len(lines) < height
    assert max(map(len, lines)) <= width
    assert "rotate_head" not in panel
    assert "lidar_mapping" in panel
    assert "7.0 s takeoff S_AT_ALTITUDE" in lines[-1]


def test_the_panel_says_where_the_mission_is_and_which_resources_are_not_at_rest() -> None:
    _, panel = fly()
    title, progress, skills, resources, *_ = panel.splitlines()
    assert title.strip() == TITLE
    assert progress.split("   ")[1:] == ["RUNNING", "waypoint 2 of 4"]
    assert skills.startswith("lidar_mapping")
    assert "flight_status IN_AIR" in resources
    assert "axes_authority" not in resources


def test_in_a_pipe_each_event_is_a_line() -> None:
    _, printed = fly(width=300, terminal=False)
    lines = printed.splitlines()
    assert len(lines) == len(HEALTH) + 2
    assert lines[0].startswith("    0.0 s  zed FAILED0: it has sent nothing")
    assert lines[-2:] == ["   40.0 s  ZED -> LiDAR", "    7.0 s  takeoff S_AT_ALTITUDE  It is up."]


def test_what_the_recorder_did_not_live_to_write_is_written(tmp_path: Path) -> None:
    """The recorder's last line may be incomplete."""
    deck, _ = fly()
    with JsonLines[Record](tmp_path / TIMELINE_FILE) as file:
        for each in HEALTH[:3]:
            file.write(each)
    with (tmp_path / TIMELINE_FILE).open("ab") as broken:
        broken.write(b'{"v":2,"id":"tel')
    deck.complete_journal(tmp_path)
    deck.complete_journal(tmp_path)
    assert read_records(tmp_path) == [*HEALTH, SWITCH, FLYING]
    assert read_goals(tmp_path) == ENDED
    assert {path.name for path in tmp_path.iterdir()} == {TIMELINE_FILE, GOALS_FILE}
