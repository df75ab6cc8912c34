"""Throw bad input at the whole m600 for a while: in one process, then at all its real processes over Zenoh.

    python tests/fuzz/fuzz_run.py --payloads 10000

Prints what came of it, and ends with 1 if anything raised, died, fell silent or grew.
"""

from __future__ import annotations

import argparse
import logging
import sys
import tempfile
import time
from pathlib import Path
from random import Random

from endpoints import PUBLICATIONS, QUERIES
from fuzz_processes import Thrower, everything, fuzz
from fuzz_stage import MOCKED, REAL, FuzzStage, nodes_of_the_m600, nodes_of_the_mocked_m600

from skillwing.sim_mujoco import topics

ROOM = 120.0
"""MB that a process may take in all: the recorder and the map grow while the drone stands there, too."""


def in_process(payloads: int, seed: int, run_dir: Path) -> bool:
    """Returns whether nothing was found."""
    started = time.monotonic()
    stage = FuzzStage({REAL: nodes_of_the_m600(run_dir), MOCKED: nodes_of_the_mocked_m600()})
    random = Random(seed)
    endpoints = [endpoint for endpoint in (*QUERIES, *PUBLICATIONS) if endpoint.key != topics.CLOCK]
    for number in range(payloads):
        stage.throw(random, endpoints[number % len(endpoints)])
    stage.run(3.0)
    seconds = time.monotonic() - started
    say(
        f"in one process: {stage.thrown} payloads at {len(endpoints)} keys in {seconds:.0f} s, "
        f"{stage.refused} refused, {len(stage.findings)} callbacks raised, {len(stage.silent)} questions unanswered, "
        f"{len(stage.internal)} answered by INTERNAL"
    )
    for finding in (*stage.findings[:3], *stage.silent[:3], *stage.internal[:3]):
        say(f"    {finding}")
    well = stage.answers_well(REAL) and stage.answers_well(MOCKED)
    return well and not (stage.findings or stage.silent or stage.internal)


def over_zenoh(payloads: int, flood: int, seed: int, run_dir: Path) -> bool:
    """Returns whether nothing was found."""

    def act(thrower: Thrower) -> None:
        thrower.throw(payloads)
        thrower.throw_huge()
        thrower.flood(flood)

    started = time.monotonic()
    specs = everything(run_dir)
    outcome = fuzz(specs, run_dir, act, seed=seed)
    seconds = time.monotonic() - started
    say(
        f"{len(specs)} processes: {outcome.thrown} payloads in {seconds:.0f} s, {outcome.answered} answered, "
        f"{outcome.refused} refused, {len(outcome.silent)} unanswered, died: {', '.join(outcome.died) or 'none'}, "
        f"deaf: {', '.join(outcome.deaf) or 'none'}"
    )
    for name, (before, after) in (outcome.memory or {}).items():
        say(f"    {name:<24} {before:6.0f} MB before, {after:6.0f} MB after")
    for silent in outcome.silent[:5]:
        say(f"    unanswered: {silent}")
    return not (outcome.died or outcome.deaf or outcome.silent) and outcome.growth < ROOM


def say(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def main(arguments: list[str] | None = None) -> int:
    """Run both; returns the exit code."""
    parser = argparse.ArgumentParser(description="Throw bad input at everything that runs when the m600 flies.")
    parser.add_argument("--payloads", type=int, default=5000, help="for each of the two (default: %(default)s)")
    parser.add_argument("--flood", type=int, default=2000, help="ids that nobody has seen (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=int(time.time()), help="of the payloads")
    wanted = parser.parse_args(arguments)
    logging.disable(logging.CRITICAL)
    say(f"seed {wanted.seed}")
    with tempfile.TemporaryDirectory() as folder:
        inside = in_process(wanted.payloads, wanted.seed, Path(folder) / "in_process")
        outside = over_zenoh(wanted.payloads, wanted.flood, wanted.seed, Path(folder) / "processes")
    return 0 if inside and outside else 1


if __name__ == "__main__":
    sys.exit(main())
