"""One flight in one process and virtual time: the robot's whole process table, physics and sensors among them.

The same plan is the same flight, bit by bit, and takes what its callbacks take.
"""

from __future__ import annotations

import subprocess
import time
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

from skillwing.m600.campaign.conditions import Condition
from skillwing.m600.campaign.plan import FlightPlan
from skillwing.m600.campaign.result import End, FlightResult
from skillwing.m600.campaign.witness import Witness
from skillwing.m600.judge.evaluation import evaluate, judge_map
from skillwing.m600.robot import ROBOT
from skillwing.services.processes.in_process import RobotInProcess
from skillwing.services.robot import ProcessSpec
from skillwing.sim_mujoco.world.world import make_world

LONGEST = 1200.0
"""Robot seconds after which a flight that does not end is given up."""
LAST_WORDS = 3.0
"""Robot seconds after the end, for the last records and the map."""


def fly(plan: FlightPlan, run_dir: Path | None = None, *, longest: float = LONGEST) -> FlightResult:
    """Fly a plan to its end and judge it.

    run_dir: an empty directory, in which the flight is recorded and its report written, as `skillwing demo` does.
    longest: robot seconds after which it is given up. Whatever goes wrong in a node breaks the flight off and is told
    in the result.
    """
    begun = time.process_time()
    witness = Witness(ROBOT.skillset.stem, pilot_returns=plan.condition is Condition.PILOT_RETURNS)
    options = plan.robot_options()
    if run_dir is not None:
        options["run_dir"] = str(run_dir)
    error = ""
    with RobotInProcess(ROBOT) as robot:
        robot.attach(witness)
        try:
            robot.start(processes(plan, options))
            robot.network.run_until(lambda: witness.over, longest)
            end, end_time = witness.end, robot.network.now()
            witness.ask_for_map()
            robot.network.run_for(LAST_WORDS)
        except Exception as failure:  # noqa: BLE001 - a campaign goes on, whatever a node does
            error = f"{type(failure).__name__}: {failure}"
            end, end_time = End.BROKE_OFF, robot.network.now()
    mission = witness.mission
    return FlightResult(
        plan=plan,
        end=end,
        phase=mission.phase if mission is not None else "",
        text=mission.text if mission is not None else "",
        failsafes=tuple(witness.failsafes),
        collisions=witness.collisions,
        breaches=witness.breaches,
        clearance=None if witness.clearance is None else round(witness.clearance, 3),
        coverage=_coverage(plan, witness, run_dir),
        end_time=round(end_time, 3),
        digest=witness.digest,
        processor_time=round(time.process_time() - begun, 2),
        error=error,
        version=code_version(),
    )


def processes(plan: FlightPlan, options: dict[str, Any]) -> tuple[ProcessSpec, ...]:
    """The robot's processes and the mission's; who only looks on comes first, and the mission last."""
    mission = ProcessSpec(
        "mission",
        "skillwing.bt_missions.running.runner:make_mission",
        {"mission": plan.mission, "skillset": str(ROBOT.skillset), **plan.mission_options()},
        extra="missions",
        restart="never",
    )
    return (*ROBOT.observers(options), *ROBOT.functional_layer(options), *ROBOT.managers(options), mission)


def _coverage(plan: FlightPlan, witness: Witness, run_dir: Path | None) -> float | None:
    """The share that was mapped of what can be seen from the route, after a flight that came to its end.

    With a run directory the report is written as well.
    """
    if run_dir is not None:
        report = evaluate(run_dir, ROBOT.load_skillset(), mission=plan.mission, seed=plan.seed, world=plan.world)
        return report.coverage.all
    if witness.map is None or not witness.over:
        return None
    world = make_world(plan.seed, plan.world)
    return judge_map(world, world.site.way, witness.map).all


@cache
def code_version() -> str:
    """The package's version, and the commit where it runs from a repository; `+` where that was changed since."""
    here = Path(__file__).parent
    commit = subprocess.run(
        ["git", "describe", "--always", "--dirty=+", "--exclude=*"],
        cwd=here,
        capture_output=True,
        text=True,
        check=False,
    )
    name = version("skillwing")
    return f"{name}-{commit.stdout.strip()}" if commit.returncode == 0 else name
