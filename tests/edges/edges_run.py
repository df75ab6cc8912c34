"""Count of the edges of the goal table that tests, simulated runs and flown missions take: `make edges`.

    python tests/edges/edges_run.py [--runs N] [--flights MISSION:CONDITION ...] [--table] [--write PAGE]

--write: the page that gets the diagram, the table and the counts. --table: only diagram and table, without a count.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

import edge_counter
from goal_table import Edge, all_edges, page_text

from skillwing.services.terminal.doc_sections import Marks, page_with

ROOT = Path(__file__).parents[2]
TABLE = Marks.named("goal table")
COUNT = Marks.named("goal edges")
TESTS = (
    "tests/unit/services",
    "tests/unit/client",
    "tests/unit/mocking",
    "tests/unit/testing",
    "tests/conformance",
    "tests/integration/test_managers_in_process.py",
    "tests/integration/test_leases_and_owners.py",
    "tests/integration/test_others_mistakes.py",
    "tests/integration/test_resource_manager_restart.py",
)
CONDITIONS = ("none", "camera", "both", "battery", "pilot", "pilot-returns")
FLIGHTS = (*(f"mapping:{condition}" for condition in CONDITIONS), "inspection:none")


def count_tests(file: Path) -> Counter[Edge]:
    """Edges that the tests take."""
    environment = os.environ | {edge_counter.FILE: str(file), "PYTHONPATH": str(Path(__file__).parent)}
    command = [sys.executable, "-m", "pytest", "-q", "-n0", "-p", "edge_counter", *TESTS]
    subprocess.run(command, cwd=ROOT, env=environment, check=True)
    return edge_counter.load(file)


def count_runs(runs: int) -> Counter[Edge]:
    """Edges that simulated runs take."""
    sys.path.insert(0, str(ROOT / "tests"))
    from simulation.run import simulate  # noqa: PLC0415 - its folder is not a package of the product

    edge_counter.COUNTS.clear()
    for seed in range(runs):
        simulate(seed)
    return edge_counter.COUNTS.copy()


def count_flights(flights: Sequence[str]) -> Counter[Edge]:
    """Edges that missions take, flown in this process in virtual time."""
    from skillwing.evaluation.flights.conditions import Condition  # noqa: PLC0415 - loads physics
    from skillwing.evaluation.flights.plan import FlightPlan, usual_world  # noqa: PLC0415
    from skillwing.evaluation.judged_flight import fly  # noqa: PLC0415

    edge_counter.COUNTS.clear()
    for flight in flights:
        mission, _, condition = flight.partition(":")
        result = fly(FlightPlan(mission=mission, world=usual_world(mission), seed=0, condition=Condition(condition)))
        sys.stdout.write(f"{flight}: {result.phase or result.error}\n")
        sys.stdout.flush()
    return edge_counter.COUNTS.copy()


def report(counts: Mapping[str, Counter[Edge]]) -> str:
    """The counts in Markdown. Raises ValueError for an edge that the table does not have."""
    edges = all_edges()
    if strangers := {edge.text for taken in counts.values() for edge in taken} - {edge.text for edge in edges}:
        raise ValueError(f"the table lacks edges: {sorted(strangers)}; add an example to goal_table.py")
    everything = sum(counts.values(), Counter[Edge]())
    lines = ["| taken by | edges | times |", "|---|---|---|"]
    for name, taken in {**counts, "any of them": everything}.items():
        lines.append(f"| {name} | {len(taken)} of {len(edges)} | {taken.total():,} |")
    never = [edge for edge in edges if edge not in everything]
    lines += ["", "Never taken:" if never else "Every edge is taken by one of them at least."]
    lines += [f"- {edge.text}" for edge in never]
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=2000, help="simulated runs (default: 2000)")
    parser.add_argument("--flights", nargs="*", default=FLIGHTS, help="missions, each with its condition")
    parser.add_argument("--table", action="store_true", help="write the table only, without a count")
    parser.add_argument("--write", type=page_with(TABLE, COUNT), help="the page that gets table and counts")
    arguments = parser.parse_args()
    if arguments.write is not None:
        TABLE.replace(arguments.write, page_text())
    if arguments.table:
        return
    with tempfile.TemporaryDirectory() as folder:
        counts = {"tests of the managers": count_tests(Path(folder) / "edges.json")}
    edge_counter.install()
    counts[f"simulation, {arguments.runs:,} runs"] = count_runs(arguments.runs)
    counts[f"missions, {len(arguments.flights)} flights"] = count_flights(arguments.flights)
    text = report(counts)
    sys.stdout.write(text + "\n")
    if arguments.write is not None:
        COUNT.replace(arguments.write, text)


if __name__ == "__main__":
    main()
