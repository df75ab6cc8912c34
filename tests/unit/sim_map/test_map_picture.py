"""Map pictures show the mapped points and the flown path: checks of their colours."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.image import imread

from skillwing.evaluation.judge.map_picture import (
    BRANCH_COLOURS,
    END,
    FENCE,
    TROUBLE,
    UNSEEN,
    Flown,
    Happening,
    MapScene,
    draw_map,
)
from skillwing.evaluation.judge.obstacle_shapes import OBSTACLE_COLOUR
from skillwing.onboard.frames.extent import Box
from skillwing.sim_mujoco.world.footprint import Footprint
from skillwing.sim_mujoco.world.things.obstacle import Obstacle, ObstacleKind

ROUTE = ((0.0, 0.0, 4.0), (30.0, 0.0, 4.0), (30.0, 20.0, 4.0))
NOTHING = np.empty((0, 3), dtype=np.float32)


def ground(east: float) -> np.ndarray:
    """Points on the ground of the whole shown area, up to `east` [m]."""
    x, y = np.meshgrid(np.arange(-8.2, east, 0.4), np.arange(-8.2, 29.0, 0.4))
    return np.stack([x, y, 0.2 + 0.0 * x], axis=-1).reshape(-1, 3).astype(np.float32)


def drawn(file: Path, scene: MapScene) -> np.ndarray:
    draw_map(file, scene, "As it was")
    return imread(file)


def share_of(colour: str, picture: np.ndarray) -> float:
    red, green, blue = (np.abs(picture[:, :, at] - share) < 0.02 for at, share in enumerate(to_rgb(colour)))
    return float((red & green & blue).mean())


def test_branches_have_different_colours(tmp_path: Path) -> None:
    seen = ground(30.0)
    flown = [Flown("zed", np.array(ROUTE[:2])), Flown("lidar", np.array(ROUTE[1:]))]
    draw_map(tmp_path / "map.png", MapScene(seen, 0.4, ROUTE, flown, [(30.0, 10.0, 4.0)]), "Two branches")
    both = imread(tmp_path / "map.png")
    draw_map(tmp_path / "one.png", MapScene(seen, 0.4, ROUTE, flown[:1]), "One branch")
    one = imread(tmp_path / "one.png")
    assert share_of(BRANCH_COLOURS["zed"], both) > 5e-4
    assert share_of(BRANCH_COLOURS["lidar"], both) > 5e-4
    assert share_of(BRANCH_COLOURS["zed"], one) > 5e-4
    assert share_of(BRANCH_COLOURS["lidar"], one) == 0.0


def test_a_run_that_never_took_off_leaves_a_picture_too(tmp_path: Path) -> None:
    draw_map(tmp_path / "map.png", MapScene(NOTHING, 0.4, ROUTE, []), "Nothing flown")
    assert imread(tmp_path / "map.png").shape[2] == 4


def test_the_legend_stands_clear_of_the_axis_label(tmp_path: Path) -> None:
    draw_map(tmp_path / "map.png", MapScene(NOTHING, 0.4, ROUTE, []), "Nothing flown")
    left_half = np.array_split(imread(tmp_path / "map.png")[:, :, :3], 2, axis=1)[0]
    inked = np.flatnonzero((left_half < 0.98).any(axis=(1, 2)))
    legend_top = inked[np.flatnonzero(np.diff(inked) > 1)[-1] + 1]
    assert legend_top - inked[inked < legend_top].max() > 15, "white rows between them"


def test_what_was_never_seen_looks_unlike_what_was(tmp_path: Path) -> None:
    seen, half, unmapped = (
        share_of(UNSEEN, drawn(tmp_path / "map.png", MapScene(centres, 0.4, ROUTE, [])))
        for centres in (ground(38.0), ground(15.0), NOTHING)
    )
    assert half > seen + 0.05
    assert unmapped == 0.0, "where there is no map it says so in words"


def test_a_leg_there_and_back_is_drawn_as_one(tmp_path: Path) -> None:
    ways = (ROUTE, (*ROUTE, ROUTE[1], ROUTE[0]))
    there, back = (drawn(tmp_path / "map.png", MapScene(NOTHING, 0.4, way, [])) for way in ways)
    assert (there == back).all()


def test_a_drone_that_stayed_where_it_was_is_not_drawn_as_flown(tmp_path: Path) -> None:
    settling = MapScene(NOTHING, 0.4, ROUTE, [Flown("zed", np.array([(0.0, 0.0, 0.4), (0.01, 0.0, 0.3)]))])
    assert settling.caveats == "No map was built: what stands here is not drawn. Nothing was flown."
    picture = drawn(tmp_path / "map.png", settling)
    assert share_of(BRANCH_COLOURS["zed"], picture) == share_of(END, picture) == 0.0


def test_the_place_where_a_flight_ended_is_marked(tmp_path: Path) -> None:
    flown = MapScene(ground(38.0), 0.4, ROUTE, [Flown("zed", np.array(ROUTE))])
    assert flown.caveats == ""
    assert share_of(END, drawn(tmp_path / "map.png", flown)) > 1e-4


def test_a_picture_without_path_gives_the_reason() -> None:
    assert MapScene(ground(38.0), 0.4, ROUTE, []).caveats == "No flown path was recorded."


@pytest.mark.parametrize("aside", [0.0, 0.1, 0.2, 0.3])
def test_ground_that_was_seen_has_no_stripes_wherever_its_voxels_lie(tmp_path: Path, aside: float) -> None:
    seen = ground(39.0) + np.float32(aside)
    hatched = share_of(UNSEEN, drawn(tmp_path / "map.png", MapScene(seen, 0.4, ROUTE, [])))
    assert hatched < 3e-4, "in the legend only"


def test_what_failed_and_the_fence_are_marked(tmp_path: Path) -> None:
    plain = MapScene(ground(45.0), 0.4, ROUTE, [Flown("zed", np.array(ROUTE))])
    happened = [Happening((30.0, 10.0, 4.0), "zed_status FAILED at 9.0 s")]
    told = replace(plain, troubles=happened, switches=happened, fence=Box((-12.0, -12.0, -1.0), (42.0, 32.0, 30.0)))
    before, after = drawn(tmp_path / "plain.png", plain), drawn(tmp_path / "told.png", told)
    for colour in (TROUBLE, FENCE):
        assert share_of(colour, before) == 0.0 < share_of(colour, after)
    darker = (share_of("#1a1a1a", picture) for picture in (before, after))
    assert next(darker) < next(darker), "the number of the switch, on ink"


@pytest.mark.parametrize("footprint", [Footprint((20.0, 10.0), (5.0, 4.0), 0.3), Footprint((20.0, 10.0), radius=4.0)])
def test_what_stands_there_is_drawn_where_no_map_was_built(tmp_path: Path, footprint: Footprint) -> None:
    building = Obstacle("building-0", ObstacleKind.BUILDING, footprint, 8.0)
    blind = MapScene(NOTHING, 0.4, ROUTE, [Flown("lidar", np.array(ROUTE))], obstacles=[building])
    assert blind.caveats == "No map was built: what stands here is drawn as the simulator knows it."
    assert share_of(OBSTACLE_COLOUR, drawn(tmp_path / "blind.png", blind)) > 0.005
    mapped = replace(blind, centres=ground(38.0))
    assert share_of(OBSTACLE_COLOUR, drawn(tmp_path / "mapped.png", mapped)) < 1e-4, "the map is the robot's own"
