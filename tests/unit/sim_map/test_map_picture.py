"""The picture shows what was mapped and flown: judged by the colours in it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.image import imread

from skillwing.sim_mujoco.judge.map_picture import BRANCH_COLOURS, Flown, MapScene, draw_map

ROUTE = ((0.0, 0.0, 4.0), (30.0, 0.0, 4.0), (30.0, 20.0, 4.0))


def share_of(colour: str, picture: np.ndarray) -> float:
    return float((np.abs(picture[:, :, :3] - to_rgb(colour)).max(axis=2) < 0.02).mean())


def test_branches_are_told_apart_by_colour(tmp_path: Path) -> None:
    x, y = np.meshgrid(np.arange(0.2, 30.0, 0.4), np.arange(0.2, 20.0, 0.4))
    ground = np.stack([x, y, 0.2 + 0.0 * x], axis=-1).reshape(-1, 3).astype(np.float32)
    flown = [Flown("zed", np.array(ROUTE[:2])), Flown("lidar", np.array(ROUTE[1:]))]
    draw_map(tmp_path / "map.png", MapScene(ground, 0.4, ROUTE, flown, [(30.0, 10.0, 4.0)]), "Two branches")
    both = imread(tmp_path / "map.png")
    draw_map(tmp_path / "one.png", MapScene(ground, 0.4, ROUTE, flown[:1]), "One branch")
    one = imread(tmp_path / "one.png")
    assert share_of(BRANCH_COLOURS["zed"], both) > 1e-3
    assert share_of(BRANCH_COLOURS["lidar"], both) > 1e-3
    assert share_of(BRANCH_COLOURS["zed"], one) > 1e-3
    assert share_of(BRANCH_COLOURS["lidar"], one) == 0.0


def test_a_run_that_never_took_off_leaves_a_picture_too(tmp_path: Path) -> None:
    nothing = np.empty((0, 3), dtype=np.float32)
    draw_map(tmp_path / "map.png", MapScene(nothing, 0.4, ROUTE, []), "Nothing flown")
    assert imread(tmp_path / "map.png").shape[2] == 4


def test_the_legend_stands_clear_of_the_axis_label(tmp_path: Path) -> None:
    nothing = np.empty((0, 3), dtype=np.float32)
    draw_map(tmp_path / "map.png", MapScene(nothing, 0.4, ROUTE, []), "Nothing flown")
    left_half = np.array_split(imread(tmp_path / "map.png")[:, :, :3], 2, axis=1)[0]
    inked = np.flatnonzero((left_half < 0.98).any(axis=(1, 2)))
    legend_top = inked[np.flatnonzero(np.diff(inked) > 1)[-1] + 1]
    assert legend_top - inked[inked < legend_top].max() > 15, "white rows between them"
