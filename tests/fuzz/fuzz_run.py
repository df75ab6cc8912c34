"""Send bad input to the whole m600: in one process, then to all its real processes over Zenoh.

    python tests/fuzz/fuzz_run.py --payloads 10000 --write docs/reliability.md

Prints what came of it, and ends with 1 if anything raised, died, fell silent or grew.
"""

from __future__ import annotations

import argparse
import logging
import shutil
import sys
import tempfile
import time
from pathlib import Path
from random import Random

from endpoints import PUBLICATIONS, QUERIES
from fuzz_figures import MARKS, Fuzzed, table
from fuzz_processes import Thrower, everything, fuzz
from fuzz_stage import MOCKED, REAL, FuzzStage, nodes_of_the_m600, nodes_of_the_mocked_m600

from skillwing.services.protocol import CLOCK_KEY
from skillwing.services.terminal.doc_sections import page_with

TOLD = 5
"""Findings of a kind that are printed in full."""


def in_process(payloads: int, seed: int, run_dir: Path) -> Fuzzed:
    """The real and the mocked m600, side by side in virtual time."""
    started = time.monotonic()
    stage = FuzzStage({REAL: nodes_of_the_m600(run_dir), MOCKED: nodes_of_the_mocked_m600()})
    random = Random(seed)
    endpoints = [endpoint for endpoint in (*QUERIES, *PUBLICATIONS) if endpoint.key != CLOCK_KEY]
    for number in range(payloads):
        stage.throw(random, endpoints[number % len(endpoints)])
    for endpoint in endpoints:
        stage.throw_huge(random, endpoint)
    stage.run(3.0)
    return Fuzzed(
        where=f"whole m600 and its mocks in one process, {len(endpoints)} keys",
        thrown=stage.thrown,
        refused=stage.refused,
        fallen=[str(finding) for finding in stage.findings],
        silent=stage.silent,
        internal=stage.internal,
        deaf=[robot for robot in (REAL, MOCKED) if not stage.answers_well(robot)],
        growth=None,
        seconds=time.monotonic() - started,
    )


def over_zenoh(payloads: int, flood: int, seed: int, run_dir: Path) -> Fuzzed:
    """All processes of a flying m600, except the mission."""

    def act(thrower: Thrower) -> None:
        thrower.throw(payloads)
        thrower.throw_huge()
        thrower.flood(flood)

    started = time.monotonic()
    specs = everything(run_dir)
    outcome = fuzz(specs, run_dir, act, seed=seed)
    for name, (before, after) in (outcome.memory or {}).items():
        say(f"    {name:<24} {before:6.0f} MB before, {after:6.0f} MB after")
    return Fuzzed(
        where=f"its {len(specs)} processes over Zenoh",
        thrown=outcome.thrown,
        refused=outcome.refused,
        fallen=outcome.died,
        silent=outcome.silent,
        internal=outcome.internal,
        deaf=outcome.deaf,
        growth=outcome.growth,
        seconds=time.monotonic() - started,
    )


def say(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def main(arguments: list[str] | None = None) -> int:
    """Run both; returns the exit code."""
    parser = argparse.ArgumentParser(description="Throw bad input at everything that runs when the m600 flies.")
    parser.add_argument("--payloads", type=int, default=5000, help="for each of the two (default: %(default)s)")
    parser.add_argument("--flood", type=int, default=2000, help="ids that nobody has seen (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=int(time.time()), help="of the payloads")
    parser.add_argument("--write", type=page_with(MARKS), metavar="FILE", help="document that gets the table")
    wanted = parser.parse_args(arguments)
    logging.disable(logging.CRITICAL)
    say(f"seed {wanted.seed}")
    folder = Path(tempfile.mkdtemp(prefix="fuzz-"))
    runs = [
        in_process(wanted.payloads, wanted.seed, folder / "in_process"),
        over_zenoh(wanted.payloads, wanted.flood, wanted.seed, folder / "processes"),
    ]
    for run in runs:
        for what in ("fallen", "silent", "internal", "deaf"):
            for finding in getattr(run, what)[:TOLD]:
                say(f"{run.where}, {what}: {finding}")
    figures = "\n".join(table(runs, seed=wanted.seed))
    say(figures)
    if wanted.write is not None:
        MARKS.replace(wanted.write, figures)
    if not all(run.well for run in runs):
        say(f"See why in the logs in {folder / 'processes'}.")
        return 1
    shutil.rmtree(folder)
    return 0


if __name__ == "__main__":
    sys.exit(main())
