"""Compiled loops of the RGB camera against NumPy, up to the last bit."""

from __future__ import annotations

import numpy as np
import numpy_camera
import pytest
from hypothesis import given
from hypothesis import strategies as st

from skillwing.sim_mujoco.camera import appearance
from skillwing.sim_mujoco.camera.appearance import Appearance
from skillwing.sim_mujoco.camera.camera import _fill
from skillwing.sim_mujoco.camera.shading import placed, rays_to_sun, rows_at
from skillwing.sim_mujoco.world.kinds import KINDS
from skillwing.sim_mujoco.world.rendering import painted
from skillwing.sim_mujoco.world.world import World, make_world

SEEDS = st.integers(0, 2**32 - 1)


@pytest.fixture(scope="module", params=sorted(KINDS))
def world(request: pytest.FixtureRequest) -> World:
    return make_world(1, request.param)


@pytest.fixture(scope="module")
def look(world: World) -> Appearance:
    return Appearance(world)


@given(SEEDS, st.integers(1, 8), st.integers(1, 12), st.booleans())
def test_rows_are_filled_as_by_numpy(seed: int, rows: int, columns: int, turned: bool) -> None:
    rng = np.random.default_rng(seed)
    shape = (columns, 2 * rows) if turned else (2 * rows, columns)
    inverse, face = rng.random(shape).astype(np.float32), rng.integers(-1, 4, shape).astype(np.int32)
    pixels, surface_of = np.arange(face.size).reshape(shape), np.array([0, 1, 1, 2, -1], dtype=np.int32)
    ours, theirs = ([inverse.copy(), face.copy(), pixels] for _ in range(2))
    if turned:
        ours, theirs = [each.T for each in ours], [each.T for each in theirs]
    chosen = _fill(*ours, surface_of)
    assert np.array_equal(chosen, theirs[2][1::2][numpy_camera.trace(theirs[0], theirs[1], surface_of)])
    assert np.array_equal(ours[0][:-1], theirs[0][:-1])
    assert np.array_equal(ours[1], theirs[1])


@given(SEEDS)
def test_places_and_rays_to_the_sun_are_those_of_numpy(seed: int) -> None:
    rng = np.random.default_rng(seed)
    height, width = 6, 8
    faces = rng.integers(-1, 4, (height, width)).astype(np.int32)
    facing, normals = np.array([0.0, 0.5, 0.0, 1.0, 0.0], dtype=np.float32), rng.normal(size=(5, 3)).astype(np.float32)
    directions, inverse = rng.normal(size=(3, 48)).astype(np.float32), rng.uniform(-0.1, 1.0, 48).astype(np.float32)
    length, origin = rng.uniform(1.0, 2.0, 48).astype(np.float32), rng.normal(size=3).astype(np.float32)
    nearest, close = np.float32(1e-3), np.float32(0.02)
    places, away = placed(inverse, directions, length, origin, nearest)
    assert np.array_equal(away, length / np.maximum(inverse, nearest))
    assert np.array_equal(places, directions * away + origin[:, None])

    every_other = faces[::2, ::2].ravel()
    asked = np.flatnonzero(facing.take(every_other))
    wanted = places.reshape(3, height, width)[:, ::2, ::2].reshape(3, -1).take(asked, axis=1).T
    starts, numbers = rays_to_sun(faces, places, facing, normals, close)
    assert np.array_equal(numbers, asked)
    assert np.array_equal(starts, wanted + close * normals.take(every_other.take(asked), axis=0))
    assert np.array_equal(rows_at(places, asked), places.take(asked, axis=1).T)


@pytest.mark.parametrize("seed", range(3))
def test_a_picture_has_the_levels_of_numpy(world: World, look: Appearance, seed: int) -> None:
    """Places on random faces of a world, on its paving as well, and in the sky."""
    rng = np.random.default_rng(seed)
    triangles = world.triangles()
    height, width = 40, 50
    faces = rng.integers(-1, len(triangles.faces), height * width).astype(np.int32)
    weights = rng.dirichlet((1.0, 1.0, 1.0), len(faces)).T[..., None]
    places = (weights * np.stack(triangles.corners())[:, faces]).sum(axis=0).T.astype(np.float32)
    directions, away = rng.normal(size=(3, len(faces))), rng.gamma(2.0, 30.0, len(faces)).astype(np.float32)
    directions = (directions / np.linalg.norm(directions, axis=0)).astype(np.float32)
    sunny = (rng.random((height // 2, width // 2)) < 0.5).astype(np.float32)

    picture = look.picture(faces.reshape(height, width), places, directions, away, sunny, 0.006)
    levels = numpy_camera.levels(
        look._tables,
        look._texels,
        appearance._LIGHTS,
        _painted(look, world, faces, places),
        faces,
        places,
        directions,
        away,
        np.repeat(np.repeat(sunny, 2, axis=0), 2, axis=1).ravel(),
        0.006,
    )
    assert np.array_equal(picture.reshape(-1, 3).T, appearance._GREY.take(levels))


def _painted(look: Appearance, world: World, faces: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Colours (3, N), with the strips of each face's set."""
    paint, colours = look._ground.paint, look._tables.colours.take(faces, axis=1)
    sets = paint.set_of.take(faces)
    for number in range(len(paint.first) - 1):
        here = np.flatnonzero(sets == number)
        strips = [world.paving[k] for k in paint.members[paint.first[number] : paint.first[number + 1]]]
        colours[:, here] = painted(places[:2].T[here], colours[:, here].T, strips).T
    return colours
