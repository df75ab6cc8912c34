"""The judge of a finished flight: from what its recorder left in the run directory to pictures and a report.

Only the judge knows the true world, and only after the flight. It works with whatever is there: a run in which the
recorder or the simulator died still gets a report, with the figures that can be had.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from msgspec.structs import replace as replaced

from skillwing.dsl.model import Skillset
from skillwing.evaluation.flights.coverage import MapCoverage, judge_map
from skillwing.evaluation.flights.plan import planned_way
from skillwing.evaluation.flights.saved_map import SavedMap
from skillwing.evaluation.judge.flight_log import read_flight, read_map
from skillwing.evaluation.judge.flight_map import map_scene
from skillwing.evaluation.judge.map_picture import draw_map
from skillwing.evaluation.judge.ply import write_ply
from skillwing.onboard.topics.common import Vector3
from skillwing.onboard.topics.truth import Truth
from skillwing.services.history.history import History
from skillwing.services.history.report import JudgedFigure, MissionReport, ProcessEntry
from skillwing.services.report.mission_report import ReportedMission, Verdict, report_mission
from skillwing.sim_mujoco.world.world import make_world

MAP_PICTURE = "map.png"
MAP_CLOUD = "map.ply"
MAPPING, MAPPER = "mapping", "lidar_mapping"
"""The mission, and the skill, that leave a map which can be judged."""
PLANNED = (MAPPING, "inspection")
"""Missions whose way is known; of others the site's route only says what there is to be seen."""
COURTYARD = "courtyard"
"""Default world."""
TRUTHFUL = "Collisions and clearance come from the simulator's ground truth, which the robot never sees."
NOT_MAPPED = f"Nothing was to be mapped. {TRUTHFUL}"
UNKNOWN = "not known"
TRUTH_GAP = 2.0
"""Robot seconds without ground truth before the end of a flight, by which it is not known whether anything was hit."""


def evaluate(
    run_dir: Path,
    skillset: Skillset,
    *,
    mission: str,
    seed: int,
    world: str = "courtyard",
    route: Sequence[Vector3] | None = None,
    wall_time_s: float | None = None,
    processes: Iterable[ProcessEntry] = (),
    notes: Sequence[str] = (),
) -> MissionReport:
    """Report the one flight of `run_dir` there, with `map.png` and `map.ply`.

    world: its kind. route: planned waypoints, by which coverage is judged; by default those of the world. The others
    are as in `ReportedMission`.
    """
    flown = ReportedMission(
        mission=mission,
        run_dir=run_dir,
        folder=run_dir,
        options={"seed": seed, "world": world, "route": route},
        wall_time_s=wall_time_s,
        processes=tuple(processes),
        notes=tuple(notes),
    )
    return report_mission(flown, skillset, judge)


def judge(flown: ReportedMission, history: History, title: str) -> Verdict:
    """Judge a flight by ground truth and draw its map.

    Of the run's options it takes `seed`, `world` and `route`, planned waypoints, by default those of the mission there.
    """
    scene = make_world(flown.options.get("seed", 1), flown.options.get("world") or COURTYARD)
    planned = tuple(flown.options.get("route") or planned_way(scene.site, flown.mission))
    has_plan = flown.options.get("route") is not None or flown.mission in PLANNED
    flight = _since(flown.begin, flown.end, read_flight(flown.run_dir, flown.begin, flown.end))
    was_mapped = flown.mission == MAPPING or any(bar.skill == MAPPER for bar in history.bars)
    saved = read_map(flown.run_dir) if was_mapped else None
    seen_to_the_end = bool(flight) and flight[-1].t > history.end - TRUTH_GAP
    collisions = max((truth.collisions for truth in flight), default=0)
    coverage = judge_map(scene, planned, saved)
    if saved is not None:
        write_ply(flown.folder / MAP_CLOUD, saved.centres, saved.voxel_size, saved.pose_source)
    if saved is not None or flight:
        picture = map_scene(scene, planned if has_plan else (), history, flight, saved)
        draw_map(flown.folder / MAP_PICTURE, picture, title + _share(coverage))
    return Verdict(
        figures=_figures(
            collisions if collisions or seen_to_the_end else None,
            min(truth.clearance for truth in flight) if seen_to_the_end else None,
            coverage,
            _separation(flight) if seen_to_the_end else None,
        ),
        notes=tuple(_notes(saved) if was_mapped else [NOT_MAPPED]),
    )


def _separation(flight: Sequence[Truth]) -> float | None:
    """Least distance to another drone, tip to tip [m]; None for a drone that is alone in its world."""
    return min((truth.separation for truth in flight if truth.separation is not None), default=None)


def _figures(
    collisions: int | None, clearance: float | None, coverage: MapCoverage, separation: float | None
) -> tuple[JudgedFigure, ...]:
    """Figures of a flight. clearance: least distance from an obstacle to the sphere around the vehicle, in metres.
    separation: the same from another drone's sphere; its figure is left out if there is no other drone.

    Clearance and collisions are None without recorded truth, coverage is without a map.
    """
    least = None if clearance is None else round(clearance, 3)
    shares = {
        "coverage": ("coverage", coverage.all),
        "coverage_buildings": ("  of buildings", coverage.buildings),
        "coverage_terrain": ("  of terrain", coverage.terrain),
    }
    hits = UNKNOWN if collisions is None else str(collisions)
    distance = UNKNOWN if least is None else f"{least:.2f} m"
    return (
        JudgedFigure(key="collisions", name="collisions", value=collisions, text=hits, is_problem=bool(collisions)),
        JudgedFigure(key="min_clearance_m", name="least clearance", value=least, text=distance),
        *_figure_of(separation),
        *(
            JudgedFigure(key=key, name=name, value=share, text=UNKNOWN if share is None else f"{100 * share:.1f} %")
            for key, (name, share) in shares.items()
        ),
    )


def _figure_of(separation: float | None) -> tuple[JudgedFigure, ...]:
    if separation is None:
        return ()
    least = round(separation, 3)
    name = "least distance to another drone"
    return (JudgedFigure(key="min_separation_m", name=name, value=least, text=f"{least:.2f} m"),)


def _since(begin: float, end: float, flight: Sequence[Truth]) -> list[Truth]:
    """The truth of one flight, in seconds since its beginning, with what was hit in it."""
    earlier = max((truth.collisions for truth in flight if truth.t < begin), default=0)
    return [
        replaced(truth, t=truth.t - begin, collisions=truth.collisions - earlier)
        for truth in flight
        if begin <= truth.t <= end
    ]


def _share(coverage: MapCoverage) -> str:
    return "" if coverage.all is None else f", {100 * coverage.all:.1f} % mapped"


def _notes(saved: SavedMap | None) -> list[str]:
    if saved is None:
        return ["No map was recorded."]
    return [
        f"Poses of the map: {saved.pose_source or 'not told'}. Coverage is the share of the surface in line of sight "
        "within 25 m of the planned route that lies in, or next to, an occupied voxel; it does not depend on what was "
        f"flown. {TRUTHFUL}"
    ]
