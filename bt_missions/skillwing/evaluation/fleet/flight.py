"""One flight of two drones in one world, with all processes of both and of the yard in this process, and its verdict.

A repeated plan gives the same flight, bit by bit.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np

from skillwing.evaluation.fleet import survey
from skillwing.evaluation.fleet.plan import ROBOTS, WORLD, FleetPlan
from skillwing.evaluation.fleet.result import FleetResult, RobotResult
from skillwing.evaluation.fleet.session import DroneFlight, FleetFlight, together
from skillwing.evaluation.fleet.yard import YARD, YardWitness, yard_processes
from skillwing.evaluation.flights.coverage import judge_map
from skillwing.evaluation.flights.observer import FlightObserver
from skillwing.evaluation.flights.saved_map import SavedMap
from skillwing.evaluation.flights.session import SessionEnd
from skillwing.evaluation.judged_flight import LONGEST, processor_time
from skillwing.m600.robot import ROBOT
from skillwing.services.bus.inprocess import SentMessage
from skillwing.services.processes.launcher_node import mission_on_board
from skillwing.services.robot import ProcessSpec
from skillwing.sim_mujoco.world.world import World, make_world


def fly_fleet(
    plan: FleetPlan,
    run_dir: Path | None = None,
    *,
    longest: float = LONGEST,
    tap: Callable[[SentMessage], None] | None = None,
) -> FleetResult:
    """Fly a plan to its end and judge the flight.

    run_dir: an empty directory for recordings, in a folder for each robot. longest: limit of the flight [robot s].
    tap: receives every message.
    """
    begun = processor_time()
    with tempfile.TemporaryDirectory() as journal:
        flight = flight_of(plan, run_dir, run_dir or Path(journal))
        result = judged(plan, flight, together(flight, longest, tap))
    return msgspec.structs.replace(result, processor_time=round(processor_time() - begun, 2))


def flight_of(plan: FleetPlan, run_dir: Path | None, journal: Path, *, speed: float | None = None) -> FleetFlight:
    """All parts of a flight. journal: folder for that of the yard. speed: robot seconds per second, for real
    processes."""
    terrain = make_world(plan.seed, WORLD).terrain
    return FleetFlight(
        drones={
            robot: DroneFlight(FlightObserver(ROBOT.skillset.stem, terrain), processes(plan, robot, run_dir, speed))
            for robot in ROBOTS
        },
        yard=yard_processes(journal / YARD),
        witness=YardWitness(ROBOTS),
        missions={robot: mission(plan, robot) for robot in ROBOTS},
        kill=plan.kill(),
    )


def judged(plan: FleetPlan, flight: FleetFlight, sessions: Mapping[str, SessionEnd]) -> FleetResult:
    """Result of a flight by what its observers have seen."""
    observers = {robot: drone.observer for robot, drone in flight.drones.items()}
    first = sessions[ROBOTS[0]]
    distances = [round(each.separation, 3) for each in observers.values() if each.separation is not None]
    maps = [each.map for each in observers.values()]
    return FleetResult(
        plan=plan,
        robots={robot: _result(observers[robot], session) for robot, session in sessions.items()},
        separation=min(distances) if distances else None,
        coverage=None if first.error else coverage(make_world(plan.seed, WORLD), plan, maps),
        met=len(flight.witness.met),
        visits=dict(flight.witness.visits),
        held_at_kill=flight.witness.held_at_kill,
        end_time=round(first.end_time, 3),
        error=first.error,
    )


def processes(plan: FleetPlan, robot: str, run_dir: Path | None, speed: float | None = None) -> tuple[ProcessSpec, ...]:
    """Processes of one drone, without a mission: observers first."""
    table, options = replace(ROBOT, name=robot), plan.robot_options(robot)
    if speed is not None:
        options["speed"] = speed
    if run_dir is not None:
        (run_dir / robot).mkdir(parents=True, exist_ok=True)
        options["run_dir"] = str(run_dir / robot)
    return (*table.observers(options), *table.functional_layer(options), *table.managers(options))


def mission(plan: FleetPlan, robot: str) -> ProcessSpec:
    """The mission of one drone, as its launcher starts it."""
    robots = {survey.DRONE: robot, survey.YARD: YARD}
    return mission_on_board(
        replace(ROBOT, name=robot), str(survey.__file__), plan.mission_options(robot), robots=robots
    )


def coverage(world: World, plan: FleetPlan, maps: list[SavedMap | None]) -> float | None:
    """Share of the surface in view of both ways that the maps together have; None without any map."""
    found = [each for each in maps if each is not None]
    if not found:
        return None
    ways = tuple(place for robot in ROBOTS for place in plan.way(robot))
    both = SavedMap(np.concatenate([each.centres for each in found]), found[0].voxel_size, found[0].pose_source)
    return judge_map(world, ways, both).all


def _result(observer: FlightObserver, session: SessionEnd) -> RobotResult:
    mission = observer.mission
    return RobotResult(
        end=session.end,
        phase=mission.phase if mission is not None else "",
        text=mission.text if mission is not None else "",
        failsafes=tuple(observer.failsafes),
        collisions=observer.collisions,
        breaches=observer.breaches,
        clearance=None if observer.clearance is None else round(observer.clearance, 3),
        digest=observer.digest,
        map_voxels=0 if observer.map is None else len(observer.map.centres),
    )
