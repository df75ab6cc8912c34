"""The demonstration of two drones in one world, by real processes: `make fleet`.

    python -m skillwing.evaluation.fleet.demo [--seed 1] [--condition camera] [--speed max] [--run-dir runs/fleet]

Each drone maps one half of a courtyard, and then lands on the pad that both share. The run directory gets a folder for
each robot, as of `skillwing demo`, and the picture `fleet.png` of both flights.
"""

from __future__ import annotations

import sys
from argparse import ArgumentParser
from pathlib import Path
from textwrap import fill

from skillwing.evaluation.fleet.flight import coverage, flight_of, judged
from skillwing.evaluation.fleet.over_zenoh import Systems
from skillwing.evaluation.fleet.picture import Drawn, draw_fleet
from skillwing.evaluation.fleet.plan import ROBOTS, WORLD, FleetCondition, FleetPlan
from skillwing.evaluation.fleet.result import FleetResult
from skillwing.evaluation.judge.evaluation import evaluate
from skillwing.evaluation.judge.flight_log import read_flight, read_map
from skillwing.evaluation.judged_flight import LONGEST
from skillwing.m600.robot import ROBOT
from skillwing.services.errors import SkillwingError
from skillwing.services.history.files import TIMELINE_FILE
from skillwing.services.processes.run_options import speed
from skillwing.services.terminal.output import make_console
from skillwing.sim_mujoco.world.world import make_world

PICTURE = "fleet.png"
TITLE_WIDTH = 110
"""Characters in a line of the picture's title."""
PATIENCE = 1800.0
"""Wall seconds after which the processes are taken for hung."""


def draw(plan: FleetPlan, run_dir: Path, result: FleetResult) -> None:
    """Judge the recording of each robot, and draw both flights into `fleet.png`."""
    world, skillset = make_world(plan.seed, WORLD), ROBOT.load_skillset()
    for robot in ROBOTS:
        evaluate(run_dir / robot, skillset, mission="mapping", seed=plan.seed, world=WORLD, route=plan.way(robot))
    drawn = {
        robot: Drawn(read_flight(run_dir / robot), read_map(run_dir / robot), home)
        for robot, home in plan.homes().items()
    }
    saved = coverage(world, plan, [each.saved for each in drawn.values()])
    share = "" if saved is None else f"\n{100 * saved:.1f} % mapped by both together"
    told = fill(sentence(result), TITLE_WIDTH)
    title = f"Two drones, courtyard {plan.seed}: {plan.condition.summary}\n{told}{share}"
    draw_fleet(run_dir / PICTURE, world, drawn, title)


def sentence(result: FleetResult) -> str:
    """Summary of a flight in a line."""
    collisions = sum(each.collisions for each in result.robots.values())
    ends = "; ".join(
        f"{robot} {each.phase or 'without a mission'}, {each.end}" for robot, each in result.robots.items()
    )
    least = "" if result.separation is None else f", least distance {result.separation:.1f} m"
    met = "both drones in one place" if result.met else "never both drones in one place"
    return f"{collisions} collisions{least}; {sum(result.visits.values())} landings on the pad, {met}; {ends}"


def main() -> int:
    """Fly once; exit code 0 if the promise was kept and nothing broke off."""
    parser = ArgumentParser(prog="fleet", description="Fly two drones in one world, and judge them.")
    parser.add_argument("--seed", type=int, default=1, help="of the world (default 1)")
    parser.add_argument("--condition", type=FleetCondition, choices=list(FleetCondition), default=FleetCondition.NONE)
    parser.add_argument("--speed", type=speed, default=1.0, metavar="FACTOR|max", help="robot seconds per second")
    parser.add_argument("--run-dir", type=Path, default=Path("runs/fleet"), metavar="DIR")
    given = parser.parse_args()
    run_dir: Path = given.run_dir.absolute()
    if any((run_dir / robot / TIMELINE_FILE).exists() for robot in ROBOTS):
        parser.error(f"{given.run_dir} holds a run already; choose another directory")
    plan = FleetPlan(seed=given.seed, condition=given.condition)
    flight, console = flight_of(plan, run_dir, run_dir, speed=given.speed), make_console()
    try:
        with Systems(flight, run_dir) as systems:
            console.print(f"Two robots fly at {systems.endpoint}: {plan.condition.summary}.")
            sessions = systems.follow(LONGEST, PATIENCE, console.print)
    except SkillwingError as error:
        sys.stderr.write(f"{error}\n")
        return 1
    result = judged(plan, flight, sessions)
    draw(plan, run_dir, result)
    console.print(f"{sentence(result)}\nRecordings and pictures: {given.run_dir}", soft_wrap=True)
    return 0 if result.kept and not result.error else 1


if __name__ == "__main__":
    raise SystemExit(main())
