"""The timeline picture shows what the history says, in the colours it says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread
from synthetic_mission import MISSION, SKILLSET, tell

from skillwing.services.history.history import History
from skillwing.services.protocol import Ending, GoalStatus, State, Terminal
from skillwing.services.recording import palette
from skillwing.services.report import mission_report as flight_report
from skillwing.services.report.mission_report import ReportedMission, report_mission
from skillwing.services.report.timeline_picture import HEIGHT, MISSION_TIME, ROBOT_TIME, WIDTH, draw_timeline

DONE = Terminal(ending=Ending.SUCCEEDED, reason="arrived", result="ARRIVED", success=True)
LOST = Terminal(ending=Ending.LOST, reason="its manager was killed")


def drawn(history: History, path: Path, clock: str = ROBOT_TIME) -> np.ndarray:
    draw_timeline(history, path, title="mapping: success", resources=SKILLSET.resources, clock=clock)
    return (imread(path)[:, :, :3] * 255).round().astype(int)


def share(picture: np.ndarray, colour: str) -> float:
    rgb = list(bytes.fromhex(colour.lstrip("#")))
    return float((picture == rgb).all(axis=2).mean())


def test_a_mission_is_drawn_in_all_its_colours(tmp_path: Path) -> None:
    story = tell()
    picture = drawn(History.of(story.records, story.statuses, SKILLSET), tmp_path / "timeline.png")
    assert picture.shape[:2] == (HEIGHT, WIDTH)
    for colour in (palette.GREEN, palette.RED, palette.GREY):
        assert share(picture, colour) > 0.005


def test_a_long_run_shows_its_bars_and_the_one_failure_among_thousands(tmp_path: Path) -> None:
    spans = [(f"g{number}", 10.0 * number, number != 3000) for number in range(5000)]
    statuses = [
        status
        for goal, t, well in spans
        for status in (
            GoalStatus(goal_id=goal, skill="goto", state=State.RUNNING, t=t),
            GoalStatus(goal_id=goal, skill="goto", state=State.TERMINATED, t=t + 9.0, terminal=DONE if well else LOST),
        )
    ]
    picture = drawn(History.of([], statuses, SKILLSET), tmp_path / "timeline.png")[round(0.1 * HEIGHT) :]
    assert share(picture, "#ffffff") < 0.8, "edges do not cover the bars"
    assert np.logical_and(picture[:, :, 0] > 190, picture[:, :, 1] < 100).sum() > 0.1 * HEIGHT, "the failure is red"


def test_what_still_runs_is_blue(tmp_path: Path) -> None:
    story = tell()
    running = [status for status in story.statuses if status.terminal is None]
    picture = drawn(History.of(story.records, running, SKILLSET), tmp_path / "timeline.png")
    assert share(picture, palette.BLUE) > 0.02


def test_the_colours_of_resources_are_explained_below_them(tmp_path: Path) -> None:
    story = tell()
    below = slice(round(0.93 * HEIGHT), HEIGHT)
    legend = drawn(History.of(story.records, story.statuses, SKILLSET), tmp_path / "all.png")[below]
    for colour in (palette.NEUTRAL, palette.AMBER, palette.RED):
        assert share(legend, colour) > 0.001
    states = [record for record in story.records if record.subject in ("axes_authority", "depthmap_source")]
    harmless = drawn(History.of(states, [], SKILLSET), tmp_path / "harmless.png")[below]
    assert share(harmless, palette.NEUTRAL) > 0.001
    assert share(harmless, palette.AMBER) == share(harmless, palette.RED) == 0.0


@pytest.mark.parametrize(("begin", "clock"), [(0.0, ROBOT_TIME), (20.0, MISSION_TIME)])
def test_the_axis_says_from_when_its_time_counts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, begin: float, clock: str
) -> None:
    story, said = tell(), list[str]()

    def draw(history: History, path: Path, *, clock: str, **_: object) -> None:
        said.append(clock)

    monkeypatch.setattr(flight_report, "draw_timeline", draw)
    flown = ReportedMission(mission=MISSION, run_dir=tmp_path, folder=tmp_path, begin=begin)
    report_mission(flown, SKILLSET, history=History.of(story.records, story.statuses, SKILLSET))
    assert said == [clock]


def test_another_clock_is_another_picture(tmp_path: Path) -> None:
    robot, mission = (drawn(History(), tmp_path / f"{clock}.png", clock) for clock in (ROBOT_TIME, MISSION_TIME))
    assert (robot != mission).any()


def test_a_run_in_which_nothing_happened_has_a_picture(tmp_path: Path) -> None:
    assert drawn(History(), tmp_path / "timeline.png").std() > 0
