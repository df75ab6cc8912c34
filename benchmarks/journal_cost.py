"""Cost of the journal and of step files: for one goal (begin and end) and one extern transition.

python benchmarks/journal_cost.py [--repeats N] [--write docs/journal.md]

Ratios to the core alone in the same run; the journal lies in the temporary directory. `--write` puts the table between
its markers in a document.
"""

from __future__ import annotations

import argparse
import platform
import sys
import tempfile
import time
from datetime import date
from pathlib import Path
from statistics import median, quantiles
from typing import Any

from skillwing.dsl import parse
from skillwing.services.core.events import Event
from skillwing.services.core.resource_core import ResourceCore
from skillwing.services.core.snapshot import EMPTY_SNAPSHOT
from skillwing.services.ids import RecordIds
from skillwing.services.journal.journal import Journal
from skillwing.services.journal.schema import Identity
from skillwing.services.protocol import BeginGoal, EndGoal, EndKind, FireExtern, Granted, Record
from skillwing.services.replay.files import StepWriter
from skillwing.services.replay.recorded_core import RecordedCore
from skillwing.services.replay.steps import FORMAT, Head, Made
from skillwing.services.terminal.doc_sections import Marks, page_with

SOURCE = """
    skillset digger {
        resource engine { initial ON  extern ON -> OFF  extern OFF -> ON }
        resource arm { initial FREE  FREE -> USED  USED -> FREE }
        skill dig {
            effect { take: arm -> USED  free: arm -> FREE }
            precondition { free: resource=(arm == FREE)  success take }
            invariant { engine: resource=(engine == ON or arm == USED) violation=free }
            interrupt { apply=free }
            result { success DONE: apply=free }
        }
    }
"""
DIGGER = parse(SOURCE, "digger.skillset")
MARKS = Marks.named("journal cost")


class Manager:
    """A core, with a journal and a record of its steps if given; takes the time of every step."""

    def __init__(self, journal: Journal | None, steps: StepWriter | None = None) -> None:
        self._journal = journal
        core = ResourceCore(DIGGER, source="rm", new_record_id=RecordIds("rm"))
        made = Made(0.0, None, EMPTY_SNAPSHOT, same_data=False)
        self._core = core if steps is None else RecordedCore(core, made, steps, lambda: None)
        self.times: list[float] = []
        if journal is not None:
            journal.write(core.initial_entries(), (), 0.0, 0)

    def take(self, event: Event, now: float) -> Any:
        begun = time.perf_counter()
        step = self._core.step(event, now)
        if self._journal is not None:
            records = [each for each in step.publications if isinstance(each, Record)]
            self._journal.write(step.entries, records, now, step.number)
        self.times.append(time.perf_counter() - begun)
        return step.reply

    def fly(self, repeats: int) -> None:
        """Take goals that begin and end, and an extern transition between any two of them."""
        for number in range(repeats):
            now, goal = float(number), f"01890000-0000-7000-8000-{number:012d}"
            begin = BeginGoal(
                goal_id=goal, skill="dig", inputs={}, manager="skill/dig", owner="bench", schema=DIGGER.schema_hash
            )
            granted = self.take(begin, now)
            assert isinstance(granted, Granted)
            end = EndGoal(goal_id=goal, skill="dig", token=granted.token, how=EndKind.RESULT, result="DONE")
            self.take(end, now)
            self.take(FireExtern(resource="engine", target=("OFF", "ON")[number % 2], source="bench"), now)


def measure(repeats: int) -> list[str]:
    """The table, as lines of Markdown."""
    identity = Identity("bench", DIGGER.name, DIGGER.schema_hash)
    alone = Manager(None)
    alone.fly(repeats)
    base = median(alone.times)
    rows = [("the core alone", alone.times, repeats)]
    with tempfile.TemporaryDirectory() as folder:
        head = Head(FORMAT, "bench", DIGGER.name, DIGGER.schema_hash, "digger.skillset", SOURCE)
        steps = Path(folder) / "steps"
        recorded = Manager(None, StepWriter(steps, head))
        recorded.fly(repeats)
        rows.append(("with its steps recorded", recorded.times, repeats))
        step_bytes = sum(file.stat().st_size for file in steps.iterdir()) / len(recorded.times)
        for name, durable, count in (
            ("with the journal", False, repeats),
            ("`--durable`: an fsync for each change", True, repeats // 4),
        ):
            path = Path(folder) / f"{durable}.sqlite"
            manager = Manager(Journal(path, identity, durable=durable))
            manager.fly(count)
            rows.append((name, manager.times, count))
            size = sum(file.stat().st_size for file in Path(folder).glob(f"{path.name}*")) / 2**20
    lines = ["| | p50 | p99 | ratio of p50 |", "|---|---|---|---|"]
    for name, times, _ in rows:
        p99 = quantiles(times, n=100)[-1]
        lines.append(f"| {name} | {median(times) * 1e6:.0f} us | {p99 * 1e6:.0f} us | {median(times) / base:.1f} |")
    machine = f"{platform.machine()}, Python {platform.python_version()}, {date.today().isoformat()}"  # noqa: DTZ011
    return [
        *lines,
        "",
        f"{3 * repeats} changes, {size:.1f} MB on the disk and {step_bytes:.0f} bytes a step, {machine}. By "
        "`benchmarks/journal_cost.py`.",
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description="Cost of the resource manager's journal.")
    parser.add_argument("--repeats", type=int, default=3000, help="goals")
    parser.add_argument("--write", type=page_with(MARKS), metavar="FILE", help="document that gets the table")
    options = parser.parse_args()
    lines = measure(options.repeats)
    sys.stdout.write("\n".join(lines) + "\n")
    if options.write is not None:
        MARKS.replace(options.write, "\n".join(lines))


if __name__ == "__main__":
    main()
