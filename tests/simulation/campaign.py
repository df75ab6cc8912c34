"""Many runs: on all cores, with what came of them; and how to make a failing one small."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace

from faulty_network import NetworkConditions
from simulation.plan import Plan
from simulation.run import Run, simulate

CHUNK = 50
"""Seeds that a process carries out before it reports."""


@dataclass
class Campaign:
    """Outcome of a campaign. failures: the first broken promise by seed.

    seconds: of wall time for a campaign, of one processor for a part of it.
    """

    runs: int = 0
    messages: int = 0
    seconds: float = 0.0
    failures: dict[int, str] = field(default_factory=dict)

    def text(self) -> str:
        lines = [
            f"{self.runs:,} runs, {self.messages:,} messages, {self.seconds:.0f} s "
            f"({self.runs / max(self.seconds, 1e-9):.0f} runs/s): {len(self.failures)} with a broken promise"
        ]
        for seed, text in sorted(self.failures.items())[:20]:
            lines.append(f"  seed {seed}: {text}")
        if self.failures:
            seed = min(self.failures)
            lines.append(f"Its story: make simulate SEED={seed}")
        return "\n".join(lines)


def run_campaign(
    first: int,
    runs: int,
    *,
    jobs: int = 1,
    seconds: float | None = None,
    on_part: Callable[[int, Campaign], None] = lambda first, part: None,
) -> Campaign:
    """Carry out `runs` seeds from `first` on, or as many as `seconds` of wall time allow.

    on_part: is told of each part that is done, in order, with its first seed.
    """
    campaign, began = Campaign(), time.monotonic()
    for part in _parts(first, runs, jobs):
        on_part(first + campaign.runs, part)
        campaign.runs += part.runs
        campaign.messages += part.messages
        campaign.failures |= part.failures
        campaign.seconds = time.monotonic() - began
        if seconds is not None and campaign.seconds > seconds:
            break
    return campaign


def _parts(first: int, runs: int, jobs: int) -> Iterator[Campaign]:
    chunks = [range(start, min(start + CHUNK, first + runs)) for start in range(first, first + runs, CHUNK)]
    if jobs == 1:
        yield from map(_carry_out, chunks)
        return
    with ProcessPoolExecutor(jobs) as pool:
        try:
            yield from pool.map(_carry_out, chunks)
        finally:
            pool.shutdown(cancel_futures=True)


def _carry_out(seeds: range) -> Campaign:
    part, began = Campaign(), time.process_time()
    for seed in seeds:
        outcome = simulate(seed)
        part.runs += 1
        part.messages += outcome.messages
        if outcome.problems:
            part.failures[seed] = str(outcome.problems[0])
    part.seconds = time.process_time() - began
    return part


def shrink(plan: Plan) -> Plan:
    """A plan with fewer acts and better conditions that still breaks the same promise."""
    law = _first_law(plan)
    if law is None:
        return plan
    smaller = True
    while smaller:
        smaller = False
        for candidate in _simpler(plan):
            if _first_law(candidate) == law:
                plan, smaller = candidate, True
                break
    return plan


def _simpler(plan: Plan) -> Iterator[Plan]:
    if plan.conditions != NetworkConditions():
        yield replace(plan, conditions=NetworkConditions())
        for name in ("loss", "duplication", "slow", "gaps"):
            if getattr(plan.conditions, name):
                yield replace(plan, conditions=replace(plan.conditions, **{name: 0.0}))
    for index in range(len(plan.acts)):
        yield plan.without(index)


def _first_law(plan: Plan) -> str | None:
    problems = Run(plan).carry_out().problems
    return problems[0].law if problems else None
