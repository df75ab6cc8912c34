"""What became of histories as a table of Markdown, and its place in the documentation."""

from __future__ import annotations

import os
import platform
from argparse import ArgumentTypeError
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path

BEGIN, END = "<!-- histories: begin -->", "<!-- histories: end -->"


@dataclass(frozen=True)
class Judged:
    """A history that was recorded and checked.

    unanswered: operations of which nobody knows whether they have happened. own_words: ends of goals that were never
    granted. steps: of the search for an order.
    """

    seed: int
    operations: int
    kills: int
    unanswered: int
    own_words: int
    steps: int
    linearizable: bool


def table(histories: Sequence[Judged], seconds: float) -> list[str]:
    """One row for those that went undisturbed, one for those whose process was killed. seconds: wall time of all."""
    lines = [
        "| histories | operations | ends by own word | kill -9 | unanswered | steps of the search | linearizable |"
    ]
    lines.append("|---" * 7 + "|")
    for killed in (False, True):
        rows = [each for each in histories if bool(each.kills) is killed]
        if rows:
            sums = (
                sum(each.operations for each in rows),
                sum(each.own_words for each in rows),
                sum(each.kills for each in rows),
                sum(each.unanswered for each in rows),
                sum(each.steps for each in rows),
            )
            lines.append(f"| {' | '.join(f'{number:,}' for number in (len(rows), *sums))} | {_result(rows)} |")
    first, last = histories[0].seed, histories[-1].seed
    machine = f"{platform.machine()}, {os.cpu_count()} cores at a load of {os.getloadavg()[2]:.0f}"
    today = date.today().isoformat()  # noqa: DTZ011
    return [*lines, "", f"Seeds {first:,} to {last:,}, in {seconds / 60:.0f} min; {machine}, {today}."]


def page_with_place(path: str) -> Path:
    """A page of the documentation that can take the table: to be known before anything is recorded.

    Raises argparse.ArgumentTypeError for another.
    """
    page = Path(path)
    text = page.read_text(encoding="utf-8") if page.exists() else ""
    if text.count(BEGIN) != 1 or text.count(END) != 1 or text.index(BEGIN) > text.index(END):
        raise ArgumentTypeError(f"{page} has no place for the figures: write the lines {BEGIN} and {END} into it")
    return page


def put_between(page: Path, lines: Sequence[str]) -> None:
    """Replace what stands between the markers."""
    before, rest = page.read_text(encoding="utf-8").split(BEGIN)
    page.write_text("\n".join([before + BEGIN, *lines, END]) + rest.split(END)[1], encoding="utf-8")


def _result(histories: Sequence[Judged]) -> str:
    broken = [str(each.seed) for each in histories if not each.linearizable]
    return f"**not seed {', '.join(broken)}**" if broken else "all"
