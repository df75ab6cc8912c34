"""One flight of the robot's whole process table, with physics and sensors, and its evaluation.

In one process and virtual time a repeated plan gives the same flight, bit by bit. It takes the time of its callbacks.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from skillwing.bt_missions.running.process import mission_process
from skillwing.evaluation.flights.conditions import Condition
from skillwing.evaluation.flights.cost import CostMeter
from skillwing.evaluation.flights.coverage import judge_map
from skillwing.evaluation.flights.observer import FlightObserver
from skillwing.evaluation.flights.plan import FlightNetwork, FlightPlan, planned_circle, planned_way
from skillwing.evaluation.flights.result import FlightResult
from skillwing.evaluation.flights.session import in_process, over_zenoh
from skillwing.m600.robot import ROBOT
from skillwing.services.processes.run_options import AS_FAST_AS_POSSIBLE
from skillwing.services.robot import ProcessSpec
from skillwing.sim_mujoco.world.world import make_world

MAPPING = "mapping"
"""Name of the mission whose map is evaluated."""
LONGEST = 1200.0
"""Longest flight; after it the flight is broken off [robot s]."""


def fly(plan: FlightPlan, run_dir: Path | None = None, *, longest: float = LONGEST) -> FlightResult:
    """Fly a plan to its end and evaluate the flight.

    run_dir: an empty directory for recording and report, as of `skillwing demo`. longest: limit of the flight [robot
    s]. The result has the reason if the flight is broken off.
    """
    begun = processor_time()
    meter = CostMeter(planned_circle(plan.site(), plan.mission))
    terrain = make_world(plan.seed, plan.world).terrain
    pilot_returns = plan.condition is Condition.PILOT_RETURNS
    observer = FlightObserver(ROBOT.skillset.stem, terrain, pilot_returns=pilot_returns, meter=meter)
    options = plan.robot_options()
    if run_dir is not None:
        options["run_dir"] = str(run_dir)
    if plan.network is FlightNetwork.IN_PROCESS:
        session = in_process(observer, processes(plan, options), longest)
    else:
        options["speed"] = AS_FAST_AS_POSSIBLE
        session = over_zenoh(observer, processes(plan, options), longest, run_dir)
    mission = observer.mission
    return FlightResult(
        plan=plan,
        end=session.end,
        phase=mission.phase if mission is not None else "",
        text=mission.text if mission is not None else "",
        failsafes=tuple(observer.failsafes),
        collisions=observer.collisions,
        breaches=observer.breaches,
        clearance=None if observer.clearance is None else round(observer.clearance, 3),
        coverage=_coverage(plan, observer, run_dir),
        end_time=round(session.end_time, 3),
        digest=observer.digest,
        processor_time=round(processor_time() - begun, 2),
        error=session.error,
        deaths=session.deaths,
        cost=meter.cost,
    )


def processes(plan: FlightPlan, options: dict[str, Any]) -> tuple[ProcessSpec, ...]:
    """Processes of the robot and the mission: observers first, the mission last."""
    mission = mission_process(ROBOT, plan.flown, plan.mission_options())
    return (*ROBOT.observers(options), *ROBOT.functional_layer(options), *ROBOT.managers(options), mission)


def _coverage(plan: FlightPlan, observer: FlightObserver, run_dir: Path | None) -> float | None:
    """Mapped share of the surfaces visible from the route, after a complete flight.

    With a run directory the report is written, too.
    """
    if run_dir is not None:
        from skillwing.evaluation.judge.evaluation import evaluate  # noqa: PLC0415 - loads what draws pictures

        way = planned_way(plan.site(), plan.mission)
        skillset = ROBOT.load_skillset()
        report = evaluate(run_dir, skillset, mission=plan.mission, seed=plan.seed, world=plan.world, route=way)
        return report.judged_value("coverage") if plan.mission == MAPPING else None
    if plan.mission != MAPPING or observer.map is None or not observer.over:
        return None
    world = make_world(plan.seed, plan.world)
    return judge_map(world, world.site.way, observer.map).all


def processor_time() -> float:
    """Processor time of this process and of its ended child processes [s]."""
    return sum(os.times()[:4])
