"""Selection of the runs that are deleted. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from skillwing.services.runs.runs import Run


@dataclass(frozen=True, kw_only=True)
class RunLimits:
    """RunLimits for the runs that stay; None for no limit.

    size: bytes of all of them. count: their number. oldest: Unix time of the begin of the oldest one.
    """

    size: int | None = None
    count: int | None = None
    oldest: float | None = None


def runs_to_delete(runs: Sequence[Run], limits: RunLimits) -> list[Run]:
    """The runs to delete, oldest first. An active run is never deleted, but counts. runs: oldest first."""
    chosen: list[Run] = []
    size, count = sum(run.size for run in runs), len(runs)
    for run in runs:
        too_old = limits.oldest is not None and run.begun < limits.oldest
        too_many = limits.count is not None and count > limits.count
        too_large = limits.size is not None and size > limits.size
        if not run.active and (too_old or too_many or too_large):
            chosen.append(run)
            size, count = size - run.size, count - 1
    return chosen
