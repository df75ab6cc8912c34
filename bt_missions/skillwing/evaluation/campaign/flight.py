"""One flight of the robot's whole process table, physics and sensors among them, and the judgement of it.

In one process and virtual time the same plan is the same flight, bit by bit, and takes what its callbacks take.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from skillwing.evaluation.campaign.conditions import Condition
from skillwing.evaluation.campaign.course import in_process, over_zenoh
from skillwing.evaluation.campaign.plan import FlightPlan, Network, planned_circle, planned_way
from skillwing.evaluation.campaign.price import PriceMeter
from skillwing.evaluation.campaign.result import FlightResult
from skillwing.evaluation.campaign.witness import Witness
from skillwing.evaluation.judge.map_coverage import judge_map
from skillwing.m600.robot import ROBOT
from skillwing.services.processes.run_options import AS_FAST_AS_POSSIBLE
from skillwing.services.robot import ProcessSpec
from skillwing.sim_mujoco.world.world import make_world

MAPPING = "mapping"
"""The mission whose map is judged."""
LONGEST = 1200.0
"""Robot seconds after which a flight that does not end is given up."""


def fly(plan: FlightPlan, run_dir: Path | None = None, *, longest: float = LONGEST) -> FlightResult:
    """Fly a plan to its end and judge it.

    run_dir: an empty directory, in which the flight is recorded and its report written, as `skillwing demo` does.
    longest: robot seconds after which it is given up. What breaks the flight off is told in the result.
    """
    begun = _processor_time()
    meter = PriceMeter(planned_circle(plan.site(), plan.mission))
    terrain = make_world(plan.seed, plan.world).terrain
    pilot_returns = plan.condition is Condition.PILOT_RETURNS
    witness = Witness(ROBOT.skillset.stem, terrain, pilot_returns=pilot_returns, meter=meter)
    options = plan.robot_options()
    if run_dir is not None:
        options["run_dir"] = str(run_dir)
    if plan.network is Network.IN_PROCESS:
        course = in_process(witness, processes(plan, options), longest)
    else:
        options["speed"] = AS_FAST_AS_POSSIBLE
        course = over_zenoh(witness, processes(plan, options), longest, run_dir)
    mission = witness.mission
    return FlightResult(
        plan=plan,
        end=course.end,
        phase=mission.phase if mission is not None else "",
        text=mission.text if mission is not None else "",
        failsafes=tuple(witness.failsafes),
        collisions=witness.collisions,
        breaches=witness.breaches,
        clearance=None if witness.clearance is None else round(witness.clearance, 3),
        coverage=_coverage(plan, witness, run_dir),
        end_time=round(course.end_time, 3),
        digest=witness.digest,
        processor_time=round(_processor_time() - begun, 2),
        error=course.error,
        deaths=course.deaths,
        price=meter.price,
    )


def processes(plan: FlightPlan, options: dict[str, Any]) -> tuple[ProcessSpec, ...]:
    """The robot's processes and the mission's; who only looks on comes first, and the mission last."""
    mission = ProcessSpec(
        "mission",
        "skillwing.bt_missions.running.runner:make_mission",
        {"mission": plan.flown, "skillset": str(ROBOT.skillset), **plan.mission_options()},
        extra="missions",
        restart="never",
    )
    return (*ROBOT.observers(options), *ROBOT.functional_layer(options), *ROBOT.managers(options), mission)


def _coverage(plan: FlightPlan, witness: Witness, run_dir: Path | None) -> float | None:
    """The share that was mapped of what can be seen from the route, after a flight that came to its end.

    With a run directory the report is written as well.
    """
    if run_dir is not None:
        from skillwing.evaluation.judge.evaluation import evaluate  # noqa: PLC0415 - loads what draws pictures

        way = planned_way(plan.site(), plan.mission)
        skillset = ROBOT.load_skillset()
        report = evaluate(run_dir, skillset, mission=plan.mission, seed=plan.seed, world=plan.world, route=way)
        return report.coverage.all if plan.mission == MAPPING else None
    if plan.mission != MAPPING or witness.map is None or not witness.over:
        return None
    world = make_world(plan.seed, plan.world)
    return judge_map(world, world.site.way, witness.map).all


def _processor_time() -> float:
    """Of this process and of those that it has started and that have ended [s]."""
    return sum(os.times()[:4])
