"""Promises of every world, for any seed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from hashlib import sha256
from itertools import pairwise

import msgspec
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from benchmark_scripts import script
from skillwing.onboard.frames.extent import Box
from skillwing.sim_mujoco.world.footprint import Footprint
from skillwing.sim_mujoco.world.kinds import KINDS, make_site
from skillwing.sim_mujoco.world.layouts.plot import legs_of
from skillwing.sim_mujoco.world.rays import RayScene
from skillwing.sim_mujoco.world.site import Site
from skillwing.sim_mujoco.world.things.obstacle import Obstacle, ObstacleKind
from skillwing.sim_mujoco.world.triangulation import local_triangles
from skillwing.sim_mujoco.world.world import BUILDING, OTHER, TERRAIN, World, make_world

broken_promises = script("world_promises").broken_promises

seeds = st.integers(min_value=0, max_value=2**31)


@pytest.mark.parametrize("kind", KINDS)
@given(seeds, st.booleans())
@example(2337, False)  # a thin pole once stood beside its leg in the courtyard
@settings(max_examples=6, deadline=None)
def test_no_world_breaks_a_promise(kind: str, seed: int, is_small: bool) -> None:
    """`python benchmarks/worlds.py` tries thousands of seeds, and every scale."""
    site = make_site(seed, kind, KINDS[kind].scales[0] if is_small else 1.0)
    assert broken_promises(site, KINDS[kind].build(site).obstacles) == []


def test_broken_promises_are_noticed() -> None:
    site = make_site(1)
    obstacles = KINDS["courtyard"].build(site).obstacles
    blocker = next(each for each in obstacles if each.leg is not None)
    assert blocker.leg is not None
    start, end = legs_of(site.way)[blocker.leg]
    other = next(each for each in obstacles if each.leg is None)

    def broken(*changed: Obstacle) -> str:
        return "; ".join(broken_promises(site, [*(each for each in obstacles if each.leg is None), *changed]))

    x, y = blocker.footprint.centre
    assert "nothing stands on the route" in broken()
    assert "stands beside its leg" in broken(replace(blocker, footprint=Footprint((x + 1.0, y + 1.0), radius=0.2)))
    assert "hardly higher" in broken(replace(blocker, height=5.0))
    assert "too wide" in broken(replace(blocker, footprint=Footprint((x, y), (4.0, 0.2))))
    assert "too close to the pad" in broken(replace(other, footprint=Footprint((-2.0, -2.0), radius=0.5)))
    halfway = (start[0] + end[0]) / 2, (start[1] + end[1]) / 2
    assert "too close to a leg" in broken(replace(other, footprint=Footprint(halfway, radius=0.1)))
    assert "in the way round" in broken(blocker, replace(other, footprint=Footprint((x + 2.9, y + 2.9), radius=0.3)))
    assert "higher than the ceiling" in broken(replace(other, height=11.0))


def test_sites_that_do_not_fit_together_are_noticed() -> None:
    site = make_site(1)
    obstacles = KINDS["courtyard"].build(site).obstacles

    def broken(**changed: object) -> str:
        return "; ".join(broken_promises(replace(site, **changed), obstacles))

    assert "bounds of the map" in broken(bounds=Box((-5.0, -50.0, -8.0), (80.0, 70.0, 24.0)))
    assert "fence does not hold" in broken(return_height=29.5)
    assert "not over everything" in broken(return_height=9.0)
    assert "area of detours" in broken(area=(-11.0, -11.0, 30.5, 31.0))
    assert "does not end where it began" in broken(route=site.route[:-1])


def test_wires_and_bystanders_of_an_inspection_are_noticed() -> None:
    site = make_site(1, "industrial")
    obstacles = list(KINDS["industrial"].build(site).obstacles)
    wire = next(each for each in obstacles if each.kind is ObstacleKind.WIRE)
    lower = Footprint((wire.footprint.centre[0], wire.footprint.centre[1] - 3.0), wire.footprint.half)
    assert "hangs too close" in "; ".join(broken_promises(site, [*obstacles, replace(wire, footprint=lower)]))
    site = make_site(1, "inspection")
    target, other, *rest = KINDS["inspection"].build(site).obstacles
    assert site.target is not None
    x, y = site.target.centre
    near = Footprint((x, y + site.target.radius + 3.0), radius=0.5)
    assert "circle of the inspection" in "; ".join(
        broken_promises(site, [target, replace(other, footprint=near), *rest])
    )


@pytest.mark.parametrize("kind", KINDS)
def test_no_solid_reaches_beyond_the_outline_and_the_height_of_its_obstacle(kind: str) -> None:
    """Promises speak of outlines and heights: physics and rays must agree with them."""
    world = make_world(4, kind)
    for obstacle, corners in corners_of(world):
        assert obstacle.height - 0.05 < corners[:, 2].max() < obstacle.height + 1e-3, obstacle.name
        assert outside(obstacle.footprint, corners) < 2e-3, obstacle.name


def corners_of(world: World) -> Iterator[tuple[Obstacle, NDArray[np.float64]]]:
    """Each obstacle with the corners (N, 3) of its triangles: solids come in their order, terrain first."""
    model = world.spec().compile()
    names = [model.geom(geom).name for geom in range(model.ngeom)]
    triangles = world.triangles()
    sizes = [len(faces) for _, faces in (local_triangles(model, geom) for geom in range(model.ngeom))]
    ends = np.cumsum(sizes)
    for obstacle in world.obstacles:
        own = [g for g, name in enumerate(names) if name == obstacle.name or name.startswith(f"{obstacle.name}-")]
        assert len(own) == len(obstacle.solids)
        faces = np.concatenate([triangles.faces[ends[geom] - sizes[geom] : ends[geom]] for geom in own])
        yield obstacle, triangles.vertices[faces.ravel()].astype(np.float64)


def outside(outline: Footprint, points: NDArray[np.float64]) -> float:
    """Distance of the farthest of the points (N, 3) outside the outline [m]."""
    away = points[:, :2] - np.array(outline.centre)
    c, s = np.cos(outline.yaw), np.sin(outline.yaw)
    local = np.abs(away @ np.array([(c, -s), (s, c)]))
    return float((np.linalg.norm(np.maximum(local - outline.half, 0.0), axis=1) - outline.radius).max())


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "inspection"])
def test_what_stands_on_a_leg_is_met_by_who_flies_along_it(kind: str) -> None:
    world = make_world(11, kind)
    rays = RayScene(world.triangles())
    for obstacle in world.obstacles:
        if obstacle.leg is None:
            continue
        start, end = (np.array(world.route[obstacle.leg + i], dtype=np.float32) for i in (0, 1))
        length = float(np.linalg.norm(end - start))
        met = float(rays.distances(start, (end - start)[None] / np.float32(length), length)[0])
        assert 0.0 < met < length


@pytest.mark.parametrize("kind", KINDS)
def test_the_air_over_the_route_is_free_up_to_the_height_of_return(kind: str) -> None:
    """The air is free at that height everywhere: a drone may climb from anywhere on its route and fly home."""
    world = make_world(5, kind)
    top = world.triangles().vertices[:, 2].max()
    assert top <= world.site.ceiling < world.site.return_height
    rays = RayScene(world.triangles())
    for a, b in pairwise(world.route):
        places = np.linspace(a, b, 60).astype(np.float32)
        blocked = [o.footprint for o in world.obstacles if o.leg is not None]
        clear = np.array(
            [min((f.distance_to((x, y)) for f in blocked), default=9.0) > 0.0 for x, y, _ in places.tolist()]
        )
        up = np.broadcast_to(np.array([0.0, 0.0, 1.0], np.float32), places.shape)
        assert not rays.distances(places[clear], up[clear], 60.0).any()


@pytest.mark.parametrize("kind", KINDS)
def test_the_ground_is_as_high_as_it_is_met_from_above(kind: str) -> None:
    world = replace(make_world(7, kind), obstacles=())
    terrain, rng = world.terrain, np.random.default_rng(7)
    places = np.array(terrain.centre) + np.array(terrain.half) * rng.uniform(-0.99, 0.99, (200, 2))
    above = np.column_stack([places, np.full(200, 5.0)]).astype(np.float32)
    down = np.broadcast_to(np.array([0.0, 0.0, -1.0], np.float32), above.shape)
    met = 5.0 - RayScene(world.triangles()).distances(above, down, 10.0)
    assert [terrain.height(x, y) for x, y in places.tolist()] == pytest.approx(met.tolist(), abs=0.02)


def test_the_same_seed_gives_the_same_world() -> None:
    for kind in KINDS:
        first, second = make_world(5, kind), make_world(5, kind)
        assert first.obstacles == second.obstacles != make_world(6, kind).obstacles
    assert np.array_equal(first.triangles().vertices, second.triangles().vertices)


def test_triangles_are_labelled_and_the_ground_is_gentle() -> None:
    world = make_world(3)
    triangles = world.triangles()
    points, labels = triangles.sample(0.5, np.random.default_rng(0))
    assert set(labels.tolist()) == {TERRAIN, BUILDING, OTHER}
    ground = points[labels == TERRAIN]
    assert np.abs(ground[:, 2]).max() <= 0.5
    on_pad = np.hypot(ground[:, 0], ground[:, 1]) < 2.0
    assert np.abs(ground[on_pad, 2]).max() < 1e-5
    assert points[labels == BUILDING][:, 2].max() > 5.0


def test_every_triangle_has_a_colour() -> None:
    world = make_world(3, "inspection")
    colours = world.colours()
    assert colours.shape == (len(world.triangles().faces), 3)
    assert len(np.unique(colours, axis=0)) > 6


def test_an_unknown_kind_of_world_or_scale_is_refused_by_name() -> None:
    with pytest.raises(ValueError, match="courtyard"):
        make_world(1, "moon")
    with pytest.raises(ValueError, match="scale"):
        make_world(1, "courtyard", 2.0)
    with pytest.raises(ValueError, match="scale"):
        make_world(1, "village", float("nan"))
    with pytest.raises(ValueError, match="seed"):
        make_world(-1)


@pytest.mark.parametrize(("seed", "digest"), [(1, "bfe5c3f0a884d0b0"), (2337, "1e5e5f76d4871fef")])
def test_courtyards_stay_what_they_were(seed: int, digest: str) -> None:
    """Published flights and measured figures name courtyards by their seeds."""
    triangles = make_world(seed).triangles()
    millimetres = np.rint(triangles.vertices * 1000).astype("<i4")
    assert sha256(millimetres.tobytes() + triangles.faces.astype("<i4").tobytes()).hexdigest()[:16] == digest


@pytest.mark.parametrize("kind", KINDS)
def test_a_site_can_be_written_down_and_read_again(kind: str) -> None:
    site = make_site(4, kind)
    assert msgspec.json.decode(msgspec.json.encode(site), type=Site) == site
    assert site.way[0] == (*site.home, site.route[0][2]) == site.way[-1]
