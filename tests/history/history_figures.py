"""Outcomes of histories as a table of Markdown, and its place in the documentation."""

from __future__ import annotations

import os
import platform
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date

from skillwing.services.terminal.doc_sections import Marks

MARKS = Marks.named("histories")


@dataclass(frozen=True)
class Judged:
    """A history that was recorded and checked.

    unanswered: operations that may or may not have happened. local_outcomes: ends of goals that were never granted.
    steps: of the search for an order. published: steps of the resource manager that the observer heard. unsent: steps
    that were stored and not sent when a process was killed. ordered: steps, replies and journal agree.
    """

    seed: int
    operations: int
    kills: int
    unanswered: int
    local_outcomes: int
    steps: int
    linearizable: bool
    published: int
    unsent: int
    ordered: bool
    statuses: int
    followed: bool

    @property
    def passed(self) -> bool:
        return self.linearizable and self.ordered and self.followed


def table(histories: Sequence[Judged], seconds: float) -> list[str]:
    """One row for those that went undisturbed, one for those whose process was killed. seconds: wall time of all."""
    lines = ["| histories | operations | local outcomes | kill -9 | unanswered | steps of the search | linearizable |"]
    lines.append("|---" * 7 + "|")
    for killed in (False, True):
        rows = [each for each in histories if bool(each.kills) is killed]
        if rows:
            sums = (
                sum(each.operations for each in rows),
                sum(each.local_outcomes for each in rows),
                sum(each.kills for each in rows),
                sum(each.unanswered for each in rows),
                sum(each.steps for each in rows),
            )
            lines.append(f"| {' | '.join(f'{number:,}' for number in (len(rows), *sums))} | {_result(rows)} |")
    first, last = histories[0].seed, histories[-1].seed
    machine = f"{platform.machine()}, {os.cpu_count()} cores at a load of {os.getloadavg()[2]:.0f}"
    today = date.today().isoformat()  # noqa: DTZ011
    seeds = f"Seeds {first:,} to {last:,}, in {seconds / 60:.0f} min; {machine}, {today}."
    return [*lines, "", _order(histories), "", seeds]


def _order(histories: Sequence[Judged]) -> str:
    """Sentences on the published steps and statuses."""
    published, unsent = sum(each.published for each in histories), sum(each.unsent for each in histories)
    steps = _seeds("out of order", [each for each in histories if not each.ordered]) or "all in order"
    statuses = _seeds("out of order", [each for each in histories if not each.followed]) or "all after their steps"
    return (
        f"An observer heard {published:,} steps, {steps}. Kills left {unsent:,} stored steps unsent. "
        f"Another heard {sum(each.statuses for each in histories):,} statuses of a real skill manager, {statuses}."
    )


def _seeds(problem: str, broken: Sequence[Judged]) -> str:
    return f"**{problem} in seed {', '.join(str(each.seed) for each in broken)}**" if broken else ""


def _result(histories: Sequence[Judged]) -> str:
    broken = [str(each.seed) for each in histories if not each.linearizable]
    return f"**not seed {', '.join(broken)}**" if broken else "all"
