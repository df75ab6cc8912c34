"""Results of fuzzing as a table of Markdown, and its place in the documentation."""

from __future__ import annotations

import os
import platform
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date

from skillwing.services.terminal.doc_sections import Marks

MARKS = Marks.named("bad input")
ROOM = 120.0
"""MB by which a process may grow. The recorder and the map also grow while the drone stands still."""


@dataclass(frozen=True)
class Fuzzed:
    """Result of fuzzing one system.

    where: what it was. fallen: callbacks that raised, or processes that died. silent: questions that nobody answered.
    internal: such as had an unforeseen error for an answer. deaf: who did not answer good questions afterwards.
    growth: the most by which the memory of a process grew, in MB; None where it was not looked at. seconds: wall time.
    """

    where: str
    thrown: int
    refused: int
    fallen: Sequence[str]
    silent: Sequence[str]
    internal: Sequence[str]
    deaf: Sequence[str]
    growth: float | None
    seconds: float

    @property
    def well(self) -> bool:
        """True if nothing was found."""
        findings = (self.fallen, self.silent, self.internal, self.deaf)
        return not any(findings) and (self.growth is None or self.growth < ROOM)


def table(runs: Sequence[Fuzzed], *, seed: int) -> list[str]:
    """A row for each system. seed: of the payloads."""
    lines = ["| where | payloads | refused | raised or died | unanswered | `INTERNAL` | deaf afterwards | memory |"]
    lines.append("|---" * 8 + "|")
    for each in runs:
        counts = [_count(findings) for findings in (each.fallen, each.silent, each.internal, each.deaf)]
        memory = "–" if each.growth is None else f"{each.growth:+.0f} MB"
        lines.append(f"| {' | '.join([each.where, f'{each.thrown:,}', f'{each.refused:,}', *counts, memory])} |")
    minutes = sum(each.seconds for each in runs) / 60
    machine = f"{platform.machine()}, {os.cpu_count()} cores at a load of {os.getloadavg()[2]:.0f}"
    today = date.today().isoformat()  # noqa: DTZ011
    return [*lines, "", f"Seed {seed}, in {minutes:.0f} min; {machine}, {today}."]


def _count(findings: Sequence[str]) -> str:
    return f"**{len(findings)}**" if findings else "none"
