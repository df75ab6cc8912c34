"""Run of the conformance suite on every stage and layout of processes, counted: `make conformance`.

    python tests/conformance/conformance_run.py [--write PAGE]

Ends with 1 if a case fails.
"""

from __future__ import annotations

import argparse
import ast
import os
import platform
import subprocess
import sys
import tempfile
from collections import Counter
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from xml.etree import ElementTree

from skillwing.services.terminal.doc_sections import Marks, page_with

FOLDER = Path(__file__).parent
MARKS = Marks.named("conformance")
LAYOUT = "CONFORMANCE_LAYOUT"
RUNS = {
    "hooks": ("hooks", "own"),
    "mocks": ("mocks", "own"),
    "processes": ("processes", "own"),
    "colocated": ("processes", "colocated"),
    "mesh": ("processes", "mesh"),
}
"""Stage and layout of the processes, by column of the table."""


@dataclass
class Count:
    """Cases of each file of the suite, and those that passed. failures: names of the others."""

    cases: Counter[str] = field(default_factory=Counter[str])
    passed: Counter[str] = field(default_factory=Counter[str])
    failures: list[str] = field(default_factory=list[str])

    def text(self, file: str) -> str:
        """A cell of the table."""
        return f"{self.passed[file]} of {self.cases[file]}"


def run(stage: str, layout: str) -> Count:
    """Run all cases on one stage."""
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.xml"
        words = ["-q", "-n0", "-p", "no:cacheprovider", "-k", f"[{stage}", f"--junitxml={report}", str(FOLDER)]
        subprocess.run([sys.executable, "-m", "pytest", *words], env=os.environ | {LAYOUT: layout}, check=False)
        return read(report)


def read(report: Path) -> Count:
    """The count of a JUnit report."""
    count = Count()
    for case in ElementTree.parse(report).iter("testcase"):
        file = case.attrib["classname"].rpartition(".")[2]
        count.cases[file] += 1
        if len(case):
            count.failures.append(f"{file}: {case.attrib['name']}")
        else:
            count.passed[file] += 1
    return count


def subject(file: str) -> str:
    """First sentence of a file of the suite."""
    text = ast.get_docstring(ast.parse((FOLDER / f"{file}.py").read_text(encoding="utf-8"))) or file
    return text.splitlines()[0].removesuffix(".")


def table(counts: dict[str, Count]) -> str:
    """Lines of the page."""
    files = sorted({file for count in counts.values() for file in count.cases})
    lines = [f"| cases on | {' | '.join(counts)} |", f"|---|{'---|' * len(counts)}"]
    lines += [f"| {subject(file)} | {' | '.join(count.text(file) for count in counts.values())} |" for file in files]
    failed = [f"- {column}: {name}" for column, count in counts.items() for name in count.failures]
    machine = f"Python {platform.python_version()}, {platform.machine()}, {os.cpu_count()} cores"
    return "\n".join([*lines, "", *failed, *([""] if failed else []), f"{machine}, {datetime.now(UTC):%Y-%m-%d}."])


def main() -> int:
    parser = argparse.ArgumentParser(description="Run the conformance suite on every stage, and count.")
    parser.add_argument("--write", type=page_with(MARKS), metavar="PAGE", help="document that gets the table")
    given = parser.parse_args()
    counts = {column: run(*how) for column, how in RUNS.items()}
    text = table(counts)
    sys.stdout.write(f"{text}\n")
    if given.write is not None:
        MARKS.replace(given.write, text)
    return 1 if any(count.failures for count in counts.values()) else 0


if __name__ == "__main__":
    sys.exit(main())
