"""Mutants of the managers, and which tests kill them: `make mutation`.

    python tests/mutation/mutation_run.py --seconds 1200 --write docs/reliability.md

mutmut makes the mutants, and `bench.py` runs the unit tests on them. Survivors in functions of a rule meet whole
managers in one process and a hundred runs of the simulation. An interrupted run continues, functions of rules
first. A function that has changed is tested again.
"""

from __future__ import annotations

import argparse
import os
import platform
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import islice
from pathlib import Path

import msgspec
from mutants import WORKSPACE, function_of, is_of_rule, make_mutants, module_of
from rules import RULES

from skillwing.services.terminal.doc_sections import Marks, page_with

UNIT_TESTS = (
    "tests/unit/client/test_causal_feed.py",
    "tests/unit/client/test_causal_view.py",
    "tests/unit/client/test_goal_tracker.py",
    "tests/unit/client/test_lost_goals.py",
    "tests/unit/services/test_retry.py",
    "tests/unit/services/test_attribution.py",
    "tests/unit/services/test_changes_from_outside.py",
    "tests/unit/services/test_data_core.py",
    "tests/unit/services/test_going_on.py",
    "tests/unit/services/test_guards.py",
    "tests/unit/services/test_holding_a_grant.py",
    "tests/unit/services/test_interrupting.py",
    "tests/unit/services/test_laws.py",
    "tests/unit/services/test_leases.py",
    "tests/unit/services/test_local_outcome.py",
    "tests/unit/services/test_modifying.py",
    "tests/unit/services/test_processes_of_a_manager.py",
    "tests/unit/services/test_ready_report.py",
    "tests/unit/services/test_refusal_causes.py",
    "tests/unit/services/test_refusals_in_full.py",
    "tests/unit/services/test_requests_that_do_not_fit.py",
    "tests/unit/services/test_resource_core.py",
    "tests/unit/services/test_skill_core.py",
    "tests/unit/services/test_skill_memory.py",
    "tests/unit/services/test_skill_records.py",
    "tests/unit/services/test_registration.py",
    "tests/unit/services/test_value_sentences.py",
    "tests/unit/services/test_what_a_client_is_told.py",
    "tests/unit/services/test_what_is_on_record.py",
)
WHOLE_MANAGERS = (
    "tests/integration/test_managers_in_process.py",
    "tests/integration/test_leases_and_owners.py",
    "tests/integration/test_resource_manager_restart.py",
    "tests/simulation/test_simulation.py::test_promises_are_kept[0]",
    "tests/simulation/test_simulation.py::test_found_mistakes_stay_fixed",
)
BENCHES = (UNIT_TESTS, WHOLE_MANAGERS)
BATCH = 10
"""Number of mutants that are judged between two looks at the clock, with their results written afterwards."""
MARKS = Marks.named("mutation")
COLUMNS = ("unit tests", "managers", "simulation", "survives", "not judged")


class Judgement(msgspec.Struct):
    """Fate of a mutant. fingerprint: that of its function; benches: number of benches that it has to meet; killers: a
    test for each bench so far, "" for none."""

    fingerprint: str
    benches: int = len(BENCHES)
    killers: list[str] = []

    @property
    def fate(self) -> str:
        killer = next((killer for killer in self.killers if killer), None)
        if killer is None:
            return "survives" if len(self.killers) >= self.benches else "not judged"
        if self.killers.index(killer) == 0:
            return "unit tests"
        return "simulation" if "tests/simulation" in killer else "managers"


# --- judging ---------------------------------------------------------------------------------------------------------


class Judgements:
    """Fates of all existing mutants by name, stored in a file. Stored fates of changed functions are dropped."""

    def __init__(self, mutants: Mapping[str, str], path: Path) -> None:
        self._path = path
        known = msgspec.json.decode(path.read_bytes(), type=dict[str, Judgement]) if path.exists() else {}
        self.by_name = {
            name: Judgement(fingerprint, benches=len(BENCHES) if is_of_rule(name) else 1)
            for name, fingerprint in mutants.items()
        }
        for name, judgement in self.by_name.items():
            if name in known and known[name].fingerprint == judgement.fingerprint:
                judgement.killers = known[name].killers

    def forget_survivors(self) -> None:
        """Forget the fates of survivors, so that they are judged again."""
        for judgement in self.by_name.values():
            if not any(judgement.killers):
                judgement.killers = []

    def write(self) -> None:
        self._path.write_bytes(msgspec.json.encode(self.by_name))

    def waiting_for(self, bench: int) -> list[str]:
        """Names of the mutants that have survived all benches before this one, functions of rules first."""
        names = [
            name
            for name, judgement in self.by_name.items()
            if bench == len(judgement.killers) < judgement.benches and not any(judgement.killers)
        ]
        return sorted(names, key=lambda name: not is_of_rule(name))

    def judge(self, bench: int, *, jobs: int, deadline: float) -> None:
        """Judge all mutants that wait for this bench, until `deadline`, a time of `time.monotonic` [s]."""
        waiting = self.waiting_for(bench)
        with ThreadPoolExecutor(jobs) as pool:
            for part in pool.map(lambda job: self._judge_part(bench, waiting[job::jobs], deadline), range(jobs)):
                del part

    def _judge_part(self, bench: int, names: Sequence[str], deadline: float) -> None:
        if not names or time.monotonic() > deadline:
            return
        rest = iter(names)
        command = [sys.executable, str(Path(__file__).with_name("bench.py")), *BENCHES[bench]]
        environment = os.environ | {"PYTHONPATH": f"{WORKSPACE / 'src'}:{WORKSPACE / 'tests'}"}
        pipe = subprocess.PIPE
        with subprocess.Popen(command, cwd=WORKSPACE, env=environment, stdin=pipe, stdout=pipe, text=True) as judge:
            assert judge.stdin is not None
            assert judge.stdout is not None
            while (batch := list(islice(rest, BATCH))) and time.monotonic() < deadline:
                judge.stdin.write("".join(f"{name}\n" for name in batch))
                judge.stdin.flush()
                for name, killer in _told(judge.stdout, len(batch)):
                    self.by_name[name].killers.append(killer)
                self.write()
            judge.stdin.close()
        if judge.returncode:
            raise SystemExit("The bench has failed; its tests have to pass without mutants.")


def _told(lines: Iterator[str], count: int) -> Iterator[tuple[str, str]]:
    for line in islice(lines, count):
        name, _, killer = line.rstrip("\n").partition("\t")
        yield name, killer


# --- results ---------------------------------------------------------------------------------------------------------


def section(judgements: Mapping[str, Judgement]) -> str:
    """Tables for the documentation: fates of the judged mutants, and the number of others."""
    names = list(judgements)

    def row(label: str, those: Sequence[str]) -> str:
        fates = [judgements[name].fate for name in those]
        return f"| {label} | {len(those)} | {' | '.join(str(fates.count(each)) for each in COLUMNS)} |"

    head = "mutants | killed by unit tests | by managers in one process | by simulation | survive | not judged |"
    lines = [_summary(judgements), "", f"| of | {head}", "|---|---|---|---|---|---|---|"]
    for module in sorted({module_of(name) for name in names}):
        lines.append(row(f"`{module}.py`", [name for name in names if module_of(name) == module]))
    lines += [row("all", names), "", f"| rule | {head}", "|---|---|---|---|---|---|---|"]
    for rule, functions in RULES.items():
        lines.append(row(rule, [name for name in names if function_of(name) in functions]))
    return "\n".join([*lines, *_told_survivors(judgements)])


def _summary(judgements: Mapping[str, Judgement]) -> str:
    fates = [each.fate for each in judgements.values()]
    judged = len(fates) - fates.count("not judged")
    where = f"{platform.machine()}, Python {platform.python_version()}, {time.strftime('%Y-%m-%d')}"
    told = f"{judged:,} of {len(fates):,} mutants are judged, {fates.count('survives')} survive; {where}."
    if judged == len(fates):
        return told
    waiting = sum(len(each.killers) == 1 and each.fate == "not judged" for each in judgements.values())
    return f"{told} **The run is not over: {waiting} more have outlived the unit tests, and wait for whole managers.**"


def _told_survivors(judgements: Mapping[str, Judgement]) -> list[str]:
    """A line for each function with survivors, by their numbers."""
    numbers: dict[str, list[str]] = {}
    for name in survivors(judgements):
        of = f"`{module_of(name)}.py`, `{function_of(name)}`"
        numbers.setdefault(of, []).append(name.rpartition("__mutmut_")[2])
    lines = [f"- {of}: {', '.join(each)}" for of, each in numbers.items()]
    return ["", "Survivors, by function and mutmut's numbers:", "", *lines] if lines else []


def survivors(judgements: Mapping[str, Judgement]) -> list[str]:
    return [name for name, judgement in judgements.items() if judgement.fate == "survives"]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=7200.0, help="wall time after which it stops")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument(
        "--again", action="store_true", help="judge once more what has survived, for there are new tests"
    )
    parser.add_argument("--report", action="store_true", help="only tell what is known")
    parser.add_argument("--write", type=page_with(MARKS), help="write the tables into this page of the documentation")
    arguments = parser.parse_args()
    deadline = time.monotonic() + arguments.seconds
    judgements = Judgements(make_mutants(), WORKSPACE / "judgements.json")
    if arguments.again:
        judgements.forget_survivors()
    for bench in () if arguments.report else range(len(BENCHES)):
        judgements.judge(bench, jobs=arguments.jobs, deadline=deadline)
    text = section(judgements.by_name)
    sys.stdout.write(text + "\n\n" + "\n".join(survivors(judgements.by_name)) + "\n")
    if arguments.write is not None:
        MARKS.replace(arguments.write, text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
