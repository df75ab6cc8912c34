"""The kinds of worlds there are. No physics is loaded here: a mission planner may ask for a site without it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from skillwing.sim_mujoco.world.layouts.courtyard import courtyard_site, courtyard_terrain, make_courtyard
from skillwing.sim_mujoco.world.site import Site
from skillwing.sim_mujoco.world.terrain import Terrain
from skillwing.sim_mujoco.world.things.obstacle import Obstacle


@dataclass(frozen=True, slots=True)
class Ground:
    """What a seed makes of a site: terrain, obstacles, and paved strips that only pictures show."""

    terrain: Terrain
    obstacles: tuple[Obstacle, ...]


@dataclass(frozen=True, slots=True)
class WorldKind:
    """How a kind of world is made: what is known of it, from seed and scale, and what there is."""

    summary: str
    site: Callable[[int, float], Site]
    build: Callable[[Site], Ground]
    scales: tuple[float, float] = (0.5, 3.0)


KINDS: Final[dict[str, WorldKind]] = {
    "courtyard": WorldKind(
        "a test courtyard with a building, walls, trees, poles and boxes",
        lambda seed, _: courtyard_site(seed),
        lambda site: Ground(courtyard_terrain(site.seed), make_courtyard(site.seed)),
        scales=(1.0, 1.0),
    ),
}


def make_site(seed: int, kind: str = "courtyard", scale: float = 1.0) -> Site:
    """What is known beforehand of the world of this kind, seed and scale.

    Raises ValueError for a kind that there is not, or a scale that it does not have.
    """
    if kind not in KINDS:
        raise ValueError(f"there is no world of kind {kind!r}; known are {', '.join(KINDS)}")
    low, high = KINDS[kind].scales
    if not low <= scale <= high:
        raise ValueError(f"a {kind} has a scale between {low:g} and {high:g}, not {scale:g}")
    return KINDS[kind].site(seed, scale)
