"""Kinds of worlds, and the sites that follow from kind and seed. Loads no physics, for planners on the ground."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import msgspec

from skillwing.services.options import OptionsError
from skillwing.sim_mujoco.world.layouts.courtyard import courtyard_site, courtyard_terrain, make_courtyard
from skillwing.sim_mujoco.world.layouts.ground import Ground
from skillwing.sim_mujoco.world.layouts.industrial import industrial_site, make_industrial
from skillwing.sim_mujoco.world.layouts.inspection import inspection_site, make_inspection
from skillwing.sim_mujoco.world.layouts.street import make_street, street_site
from skillwing.sim_mujoco.world.layouts.village import make_village, village_site
from skillwing.sim_mujoco.world.site import Site


@dataclass(frozen=True, slots=True)
class WorldKind:
    """A kind of world: makers of its site, from seed and scale, and of its ground, from the site."""

    summary: str
    site: Callable[[int, float], Site]
    build: Callable[[Site], Ground]
    scales: tuple[float, float]


KINDS: Final[dict[str, WorldKind]] = {
    "courtyard": WorldKind(
        "a test courtyard with a building, walls, trees, poles and boxes",
        lambda seed, _: courtyard_site(seed),
        lambda site: Ground(courtyard_terrain(site.seed), make_courtyard(site.seed)),
        scales=(1.0, 1.0),
    ),
    "street": WorldKind("an avenue between two rows of houses", street_site, make_street, scales=(0.6, 3.0)),
    "village": WorldKind("houses along winding lanes, round a church", village_site, make_village, scales=(0.8, 2.5)),
    "industrial": WorldKind(
        "halls, tanks, pipes, stacks, a power line", industrial_site, make_industrial, scales=(0.8, 2.0)
    ),
    "inspection": WorldKind("a tall building to fly around", inspection_site, make_inspection, scales=(0.6, 1.5)),
}


def make_site(seed: int, kind: str = "courtyard", scale: float = 1.0) -> Site:
    """The site of the world of this kind, seed and scale.

    Raises ValueError for an unknown kind, a scale that it does not have, or a negative seed.
    """
    if seed < 0:
        raise ValueError(f"a seed is a whole number from 0 on, not {seed}")
    if kind not in KINDS:
        raise ValueError(f"there is no world of kind {kind!r}; known are {', '.join(KINDS)}")
    low, high = KINDS[kind].scales
    if not low <= scale <= high:
        raise ValueError(f"a {kind} has a scale between {low:g} and {high:g}, not {scale:g}")
    return KINDS[kind].site(seed, scale)


class SiteOptions(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A site as an option of a node: `{"seed": 1, "kind": "village"}`, made as the simulator makes its own."""

    seed: int = 1
    kind: str = "courtyard"

    def site(self) -> Site:
        """The site. Raises OptionsError for an unknown kind and a negative seed."""
        try:
            return make_site(self.seed, self.kind)
        except ValueError as error:
            raise OptionsError(str(error)) from error
