"""What every world promises, whatever its seed."""

from __future__ import annotations

import math
from hashlib import sha256

import msgspec
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from skillwing.sim_mujoco.world.footprint import Footprint
from skillwing.sim_mujoco.world.kinds import make_site
from skillwing.sim_mujoco.world.layouts.courtyard import ALTITUDE, PASSAGE, make_courtyard
from skillwing.sim_mujoco.world.layouts.plot import HOME, LEG_CLEARANCE, PAD_CLEARANCE, legs_of, passage
from skillwing.sim_mujoco.world.site import Site
from skillwing.sim_mujoco.world.world import BUILDING, OTHER, TERRAIN, make_world

seeds = st.integers(min_value=0, max_value=2**31)
LEGS = legs_of(make_site(0).way)


@given(seeds)
@example(2337)  # a thin pole once stood beside its leg
@settings(max_examples=25, deadline=None)
def test_every_courtyard_blocks_a_leg_and_leaves_a_way_round(seed: int) -> None:
    obstacles = make_courtyard(seed)
    blockers = [o for o in obstacles if o.leg is not None]
    assert blockers
    for blocker in blockers:
        assert blocker.leg is not None
        assert blocker.height > ALTITUDE + 1.0
        assert blocker.footprint.distance_to_segment(*LEGS[blocker.leg]) == 0.0
        assert 2 * max(blocker.footprint.half) <= 6.0
        free = passage(blocker, LEGS, PASSAGE)
        others = [o for o in obstacles if o is not blocker]
        assert min(free.distance_to_footprint(o.footprint) for o in others) > 0.0
        assert free.half[1] - max(blocker.footprint.half) - blocker.footprint.radius >= 3.0


@given(seeds)
@settings(max_examples=25, deadline=None)
def test_everything_else_keeps_clear_of_the_legs_and_the_pad(seed: int) -> None:
    for obstacle in make_courtyard(seed):
        assert obstacle.footprint.distance_to(HOME) >= PAD_CLEARANCE
        if obstacle.leg is None:
            assert min(obstacle.footprint.distance_to_segment(a, b) for a, b in LEGS) >= LEG_CLEARANCE


@given(
    st.tuples(*[st.floats(-20, 20)] * 4),
    st.floats(-3, 3),
    st.floats(0, 2),
    st.tuples(st.floats(0.1, 4), st.floats(0.1, 4)),
)
def test_distance_to_a_segment_is_the_least_distance_to_its_points(
    ends: tuple[float, ...], yaw: float, radius: float, half: tuple[float, float]
) -> None:
    outline = Footprint((1.0, -2.0), half, yaw, radius)
    a, b = (ends[0], ends[1]), (ends[2], ends[3])
    sampled = min(
        outline.distance_to((a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1]))) for s in np.linspace(0, 1, 200)
    )
    step = math.dist(a, b) / 199
    exact = outline.distance_to_segment(a, b)
    assert exact - 1e-9 <= sampled <= exact + step + 1e-9


def test_the_same_seed_gives_the_same_world() -> None:
    first, second, other = make_world(5), make_world(5), make_world(6)
    assert first.obstacles == second.obstacles != other.obstacles
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


def test_an_unknown_kind_of_world_is_refused_by_name() -> None:
    with pytest.raises(ValueError, match="courtyard"):
        make_world(1, "moon")
    with pytest.raises(ValueError, match="scale"):
        make_world(1, "courtyard", 2.0)


@pytest.mark.parametrize(("seed", "digest"), [(1, "bfe5c3f0a884d0b0"), (2337, "1e5e5f76d4871fef")])
def test_courtyards_stay_what_they_were(seed: int, digest: str) -> None:
    """Flights that were published, and figures that were measured, name them by their seeds."""
    triangles = make_world(seed).triangles()
    millimetres = np.rint(triangles.vertices * 1000).astype("<i4")
    assert sha256(millimetres.tobytes() + triangles.faces.astype("<i4").tobytes()).hexdigest()[:16] == digest


def test_a_site_can_be_written_down_and_read_again() -> None:
    site = make_site(4)
    assert msgspec.json.decode(msgspec.json.encode(site), type=Site) == site
    assert site.way[0] == (0.0, 0.0, ALTITUDE)
