"""Packets of rays against single ones."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from single_rays import SingleRays

from skillwing.sim_mujoco import compiled as compilation
from skillwing.sim_mujoco.world.kinds import KINDS
from skillwing.sim_mujoco.world.rays import RayScene
from skillwing.sim_mujoco.world.triangles import Triangles
from skillwing.sim_mujoco.world.world import make_world

F = TypeVar("F")
SEEDS = st.integers(0, 2**32 - 1)


def soup(rng: np.random.Generator, count: int) -> Triangles:
    """Triangles of about a metre in a cube of ten metres."""
    centres = rng.uniform(-5.0, 5.0, (count, 1, 3))
    corners = (centres + rng.normal(0.0, 0.7, (count, 3, 3))).reshape(-1, 3).astype(np.float32)
    return Triangles(corners, np.arange(3 * count, dtype=np.int32).reshape(-1, 3), np.zeros(count, dtype=np.int8))


def unit(rng: np.random.Generator, count: int) -> np.ndarray:
    directions = rng.normal(size=(count, 3)).astype(np.float32)
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)


@given(SEEDS, st.integers(1, 60), st.integers(1, 5), st.integers(0, 9), st.sampled_from([2.0, 8.0, 1000.0]))
def test_packets_find_what_single_rays_find(seed: int, triangles: int, origins: int, each: int, reach: float) -> None:
    """Up to the last bit, for any number of rays from any number of origins."""
    rng = np.random.default_rng(seed)
    scene = soup(rng, triangles)
    rays, single = RayScene(scene), SingleRays(scene)
    starts = rng.uniform(-5.0, 5.0, (origins, 3)).astype(np.float32)
    directions, repeated = unit(rng, origins * each), np.repeat(starts, each, axis=0)
    wanted = single.distances(repeated, directions, reach, np.inf)
    assert np.array_equal(rays.distances(starts, directions, reach, np.inf), wanted)
    assert np.array_equal(rays.blocked(starts, directions, reach), np.isfinite(wanted))
    for ours, theirs in (
        (rays.faces(starts, directions, reach), single.faces(repeated, directions, reach)),
        (rays.hits(starts, directions, reach), single.hits(repeated, directions, reach)),
    ):
        assert all(map(np.array_equal, ours, theirs))


def test_one_origin_may_be_a_single_row() -> None:
    rng = np.random.default_rng(1)
    rays, start, directions = RayScene(soup(rng, 40)), np.zeros(3, dtype=np.float32), unit(rng, 19)
    assert np.array_equal(rays.distances(start, directions, 9.0), rays.distances(start[None], directions, 9.0))


@pytest.mark.parametrize("kind", sorted(KINDS))
def test_in_a_world_a_ray_in_a_hundred_thousand_ends_elsewhere(kind: str) -> None:
    """A ray along an edge, or at two faces in one plane, has more than one answer: it depends on the order of tests."""
    world, rng = make_world(1, kind), np.random.default_rng(1)
    rays, single = RayScene(world.triangles()), SingleRays(world.triangles())
    starts = np.repeat(np.array(world.route, dtype=np.float32), 20_000, axis=0)
    directions = unit(rng, len(starts))
    ours, theirs = rays.hits(starts, directions, 60.0), single.hits(starts, directions, 60.0)
    other = (ours[0] != theirs[0]) | (ours[1] != theirs[1])
    assert np.count_nonzero(theirs[0]) > 0.3 * len(starts)
    assert np.count_nonzero(other) <= 1 + 1e-5 * len(starts)


def test_a_function_is_compiled_also_where_no_folder_can_hold_it(monkeypatch: pytest.MonkeyPatch) -> None:
    tried = []

    def loop() -> None: ...

    def njit(*, cache: bool = False, **_: str) -> Callable[[F], F]:
        tried.append(cache)
        if cache:
            raise RuntimeError("cannot cache function: no locator available")
        return lambda function: function

    monkeypatch.setattr("numba.njit", njit)
    assert compilation.compiled(loop) is loop
    assert tried == [True, False]
