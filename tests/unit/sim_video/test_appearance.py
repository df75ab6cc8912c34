"""Appearance of the world: strips of paving, patterns, and surfaces that have only one side."""

from __future__ import annotations

import numpy as np
import pytest

from skillwing.sim_mujoco.camera.appearance import Appearance
from skillwing.sim_mujoco.camera.ground import GroundPaint
from skillwing.sim_mujoco.camera.shading import Texels, strip_at, texel
from skillwing.sim_mujoco.camera.texture import SIDE, Pattern, texels_of
from skillwing.sim_mujoco.world.kinds import KINDS
from skillwing.sim_mujoco.world.layouts.ground import Strip
from skillwing.sim_mujoco.world.rays import RayScene
from skillwing.sim_mujoco.world.rendering import painted
from skillwing.sim_mujoco.world.world import TERRAIN, World, make_world


@pytest.fixture(scope="module", params=sorted(KINDS))
def world(request: pytest.FixtureRequest) -> World:
    return make_world(1, request.param)


def inside(corners: np.ndarray, rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Random faces (count,) of those with these corners (3, F, 3), and a place (count, 2) on each."""
    faces = rng.integers(corners.shape[1], size=count)
    weights = rng.dirichlet((1.0, 1.0, 1.0), count).T[..., None]
    return faces, (weights * corners[:, faces, :2]).sum(axis=0).astype(np.float32)


def colours_of(ground: GroundPaint, faces: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Colours (count, 3) of places (count, 2) on these faces (count,)."""
    x, y = np.ascontiguousarray(places.T)
    colours = ground.colours[faces] * ground.patches(faces, x, y)[:, None]
    for number, (face, *place) in enumerate(zip(faces, x, y, strict=True)):
        strip = strip_at(ground.paint, int(face), *place)
        colours[number] = colours[number] if strip < 0 else ground.paint.colours[strip]
    return colours


def test_ground_is_painted_as_if_every_strip_were_tried_everywhere(world: World) -> None:
    triangles, grass = world.triangles(), world.colours()
    is_ground = triangles.labels == TERRAIN
    corners = np.stack(triangles.corners())
    ground = GroundPaint(corners, is_ground, grass, world.paving)
    chosen, places = inside(corners[:, is_ground], np.random.default_rng(1), 20_000)
    faces = np.flatnonzero(is_ground)[chosen]
    found = colours_of(ground, faces, places)
    assert np.allclose(found, painted(places, grass[faces], world.paving), atol=1e-6)


def test_of_strips_on_top_of_one_another_the_last_one_shows() -> None:
    """One face, all of it on a road and part of it on a wide yard, with a line across both."""
    corners = np.array([[[0, 0, 0]], [[4, 0, 0]], [[0, 4, 0]]], dtype=np.float32)
    road = Strip((-9.0, 0.0), (9.0, 0.0), 12.0, (0.1, 0.1, 0.1))
    yard = Strip((2.0, 0.0), (9.0, 0.0), 20.0, (0.2, 0.2, 0.2))
    line = Strip((1.0, -5.0), (1.0, 5.0), 0.2, (0.9, 0.9, 0.9))
    grass, all_ground = np.full((1, 3), 0.5, dtype=np.float32), np.array([True])
    x, y = np.array([0.5, 1.0, 2.5], dtype=np.float32), np.full(3, 0.5, dtype=np.float32)
    for paving, wanted in (
        ((road, yard, line), [0.1, 0.9, 0.2]),
        ((line, yard, road), [0.1, 0.1, 0.1]),
        ((line, road, yard), [0.1, 0.1, 0.2]),
    ):
        ground = GroundPaint(corners, all_ground, grass, paving)
        colours = colours_of(ground, np.zeros(3, dtype=np.intp), np.stack([x, y], axis=1))
        assert colours[:, 0] == pytest.approx(wanted)


def test_what_stands_there_is_seen_from_its_front(world: World) -> None:
    look, rays, rng = Appearance(world), RayScene(world.triangles()), np.random.default_rng(2)
    for place in world.route:
        directions = rng.normal(size=(2000, 3)).astype(np.float32)
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        _, faces = rays.faces(np.array(place, dtype=np.float32), directions, 1000.0)
        seen = faces >= 0
        towards = np.einsum("ij,ij->i", look.normals[faces[seen]], directions[seen])
        assert (towards < 0.0).mean() > 0.999


def test_a_pattern_is_repeated_and_fades_into_its_mean() -> None:
    texels = np.random.default_rng(3).uniform(0.5, 1.5, (SIDE, SIDE)).astype(np.float32)
    table = Texels(*texels_of(Pattern(np.ones_like(texels), 1.0), Pattern(texels, 8.0)))
    width = 8.0 / SIDE
    u = np.array([0.5, 3.5, 3.5 + SIDE, 3.5 - SIDE, 6.5, 6.5], dtype=np.float32) * np.float32(width)
    v = np.array([0.5, 7.5, 7.5, 7.5 + 3 * SIDE, 4.5, 4.5], dtype=np.float32) * np.float32(width)
    halvings = np.array([0.0, 0.0, 0.4, 0.0, 1.0, 30.0], dtype=np.float32)
    found = [texel(table, 1, *each) for each in zip(u, v, halvings, strict=True)]
    wanted = [texels[0, 0], *[texels[7, 3]] * 3, texels[4:6, 6:8].mean(), texels.mean()]
    assert found == pytest.approx(wanted, abs=1e-5)
    assert all(texel(table, 0, *each) == 1.0 for each in zip(u, v, halvings, strict=True))
