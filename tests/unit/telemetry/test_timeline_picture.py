"""The timeline picture shows what the history says, in the colours it says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.image import imread
from synthetic_mission import SKILLSET, tell

from skillwing.services.telemetry import palette
from skillwing.services.telemetry.history import History
from skillwing.services.telemetry.timeline_picture import HEIGHT, WIDTH, draw_timeline


def drawn(history: History, path: Path) -> np.ndarray:
    draw_timeline(history, path, title="mapping: success", resources=SKILLSET.resources)
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


def test_what_still_runs_is_blue(tmp_path: Path) -> None:
    story = tell()
    running = [status for status in story.statuses if status.terminal is None]
    picture = drawn(History.of(story.records, running, SKILLSET), tmp_path / "timeline.png")
    assert share(picture, palette.BLUE) > 0.02


def test_a_run_in_which_nothing_happened_has_a_picture(tmp_path: Path) -> None:
    assert drawn(History(), tmp_path / "timeline.png").std() > 0
