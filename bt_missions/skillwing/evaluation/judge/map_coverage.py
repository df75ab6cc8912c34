"""How much of the true world a flight's map holds."""

from __future__ import annotations

from collections.abc import Sequence

from skillwing.evaluation.judge.coverage import Judge
from skillwing.evaluation.judge.flight_log import SavedMap
from skillwing.onboard.topics import Vector3
from skillwing.services.history.report import MapCoverage
from skillwing.sim_mujoco.world.world import World


def judge_map(world: World, route: Sequence[Vector3], saved: SavedMap | None) -> MapCoverage:
    """How much of what could be seen from the route is in the map."""
    if saved is None:
        return MapCoverage()
    judged = Judge(world, route).coverage(saved.centres, saved.voxel_size)
    return MapCoverage(all=_rounded(judged.all), buildings=_rounded(judged.buildings), terrain=_rounded(judged.terrain))


def _rounded(share: float | None) -> float | None:
    return None if share is None else round(share, 4)
