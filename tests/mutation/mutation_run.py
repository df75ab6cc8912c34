"""Mutants of the managers, and which tests kill them: `make mutation`.

    python tests/mutation/mutation_run.py --seconds 1200 --write docs/reliability.md

mutmut makes the mutants and judges them by the cores' unit tests. What survives is judged a second time, by whole
managers in one process and a hundred runs of the simulation. Both go on where they were interrupted, in a workspace of
their own: mutmut derives a module's name from its path, so that it wants to see `src/skillwing/...`.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from rules import RULES

ROOT = Path(__file__).parents[2]
WORKSPACE = ROOT / "runs" / "mutation"
SERVICES = "src/skillwing/services"
MUTATED = (
    "core/*",
    "managers/lease_watch.py",
    "managers/presence.py",
    "managers/resource_manager.py",
    "managers/standing.py",
    "client/asking.py",
    "client/goal_pursuit.py",
)
"""The cores, and what of the rules stands outside of them."""
JUDGES = (
    "unit/services/test_resource_core.py",
    "unit/services/test_skill_core.py",
    "unit/services/test_laws.py",
    "unit/services/test_leases.py",
    "unit/services/test_data_core.py",
    "unit/services/test_value_sentences.py",
    "unit/services/test_what_a_client_is_told.py",
    "unit/services/test_what_is_on_record.py",
)
"""What mutmut runs for a mutant: those of these tests that come by its function, the fastest first."""
COPIED = ("conftest.py", "unit/services", "integration", "simulation")
BEGIN, END = "<!-- mutation: begin -->", "<!-- mutation: end -->"
NOT_JUDGED, SURVIVED, NO_TEST = None, 0, 33
"""mutmut's exit codes of a mutant; any other is a way of being killed."""


def prepare() -> None:
    """Bring the workspace up to date; what mutmut has found out about functions that are the same stays."""
    for source, target in (
        (ROOT / "services" / "skillwing" / "services", WORKSPACE / "src" / "skillwing" / "services"),
        *((ROOT / "tests" / name, WORKSPACE / "tests" / name) for name in COPIED),
    ):
        if source.is_dir():
            shutil.rmtree(target, ignore_errors=True)
            shutil.copytree(source, target, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(source, target)
    selection = json.dumps([f"tests/{judge}" for judge in JUDGES])
    (WORKSPACE / "pyproject.toml").write_text(
        f"""
[tool.pytest.ini_options]
testpaths = ["tests"]
timeout = 300
markers = ["slow: real processes or long simulations"]

[tool.mutmut]
source_paths = ["src"]
only_mutate = {json.dumps([f"{SERVICES}/{each}" for each in MUTATED])}
do_not_mutate = ["*/__init__.py"]
pytest_add_cli_args = ["-p", "no:cacheprovider", "-q"]
pytest_add_cli_args_test_selection = {selection}
track_dependencies = false
use_git_change_detection = false
"""
    )


def make_and_judge(jobs: int, seconds: float, names: Sequence[str] = ()) -> None:
    """Have mutmut judge what it has not judged yet, or these mutants once more."""
    command = [sys.executable, "-m", "mutmut", "run", "--max-children", str(jobs), *names]
    with (WORKSPACE / "mutmut.log").open("wb") as log:
        run = subprocess.Popen(command, cwd=WORKSPACE, stdout=log, stderr=subprocess.STDOUT)
        try:
            run.wait(timeout=seconds)
        except subprocess.TimeoutExpired:
            run.send_signal(signal.SIGINT)
            run.wait()
        else:
            if run.returncode != 0:
                raise SystemExit(
                    f"mutmut could not begin. {log.name} says why: the tests have to pass without mutants."
                )


def of_rules(codes: Mapping[str, int | None]) -> list[str]:
    """The mutants of rules that have not been judged yet; patterns of all of them before anything is known."""
    functions = [function for each in RULES.values() for function in each]
    if codes:
        return [name for name, code in codes.items() if code is NOT_JUDGED and function_of(name) in functions]
    return [f"*.{mangled(function)}__mutmut_*" for function in functions]


def exit_codes() -> dict[str, int | None]:
    """mutmut's verdict on each mutant."""
    codes: dict[str, int | None] = {}
    for meta in sorted((WORKSPACE / "mutants" / SERVICES).rglob("*.meta")):
        codes |= json.loads(meta.read_text())["exit_code_by_key"]
    return codes


class SecondOpinions:
    """What killed the mutants that the unit tests did not; "" for a survivor. Kept in a file."""

    def __init__(self) -> None:
        self._path = WORKSPACE / "second_bench.json"
        self.by_name: dict[str, str] = json.loads(self._path.read_text()) if self._path.exists() else {}

    def forget(self, names: Iterable[str]) -> None:
        """Have these judged once more."""
        for name in names:
            self.by_name.pop(name, None)

    def ask(self, names: Iterable[str], seconds: float) -> None:
        """Judge those that have not been judged yet, for at most so long."""
        unknown = [name for name in names if name not in self.by_name]
        environment = os.environ | {"PYTHONPATH": f"{WORKSPACE / 'mutants' / 'src'}:{WORKSPACE / 'tests'}"}
        command = [sys.executable, str(Path(__file__).with_name("second_bench.py"))]
        (WORKSPACE / "asked").write_text("".join(f"{name}\n" for name in unknown))
        deadline = time.monotonic() + seconds
        with (
            (WORKSPACE / "asked").open() as asked,
            subprocess.Popen(
                command, cwd=WORKSPACE, env=environment, stdin=asked, stdout=subprocess.PIPE, text=True
            ) as bench,
        ):
            assert bench.stdout is not None
            for line in bench.stdout:
                name, killer = line.rstrip("\n").split("\t")
                self.by_name[name] = killer
                self._path.write_text(json.dumps(self.by_name, indent=0))
                if time.monotonic() > deadline:
                    bench.terminate()
                    break


# --- what came of it -------------------------------------------------------------------------------------------------


def mangled(function: str) -> str:
    """mutmut's name of a function or method."""
    return f"xǁ{function.replace('.', 'ǁ')}" if "." in function else f"x_{function}"


def function_of(name: str) -> str:
    """`SkillCore.start` for `skillwing.services.core.skill_core.xǁSkillCoreǁstart__mutmut_3`."""
    told = name.rsplit(".", 1)[1].split("__mutmut_", maxsplit=1)[0]
    return told.removeprefix("xǁ").replace("ǁ", ".") if "ǁ" in told else told.removeprefix("x_")


def module_of(name: str) -> str:
    return name.rsplit(".", 2)[1]


class Verdicts:
    """All mutants, by what came of them."""

    def __init__(self, codes: dict[str, int | None], second: dict[str, str]) -> None:
        self._codes = codes
        self._second = second

    def fate(self, name: str) -> str:
        code = self._codes[name]
        if code is NOT_JUDGED:
            return "not judged"
        if code not in (SURVIVED, NO_TEST):
            return "unit tests"
        killer = self._second.get(name)
        if killer is None:
            return "not judged"
        if not killer:
            return "survives"
        if killer.startswith("tests/unit/"):
            return "unit tests"
        return "simulation" if "test_promises_are_kept" in killer else "managers"

    def row(self, label: str, names: Sequence[str]) -> str:
        fates = [self.fate(name) for name in names]
        columns = ("unit tests", "managers", "simulation", "survives", "not judged")
        return f"| {label} | {len(names)} | {' | '.join(str(fates.count(each)) for each in columns)} |"

    def section(self) -> str:
        """Tables for the documentation: what is known, and how much is not."""
        names = list(self._codes)
        head = "mutants | killed by unit tests | by managers in one process | by simulation | survive | not judged |"
        lines = [self._summary(), "", f"| of | {head}", "|---|---|---|---|---|---|---|"]
        for module in sorted({module_of(name) for name in names}):
            lines.append(self.row(f"`{module}.py`", [name for name in names if module_of(name) == module]))
        lines += [self.row("all", names), "", f"| rule | {head}", "|---|---|---|---|---|---|---|"]
        for rule, functions in RULES.items():
            lines.append(self.row(rule, [name for name in names if function_of(name) in functions]))
        return "\n".join([*lines, *self._told_survivors()])

    def _summary(self) -> str:
        fates = [self.fate(name) for name in self._codes]
        judged = len(fates) - fates.count("not judged")
        where = f"{platform.machine()}, Python {platform.python_version()}, {time.strftime('%Y-%m-%d')}"
        told = f"{judged:,} of {len(fates):,} mutants are judged, {fates.count('survives')} survive; {where}."
        if judged == len(fates):
            return told
        waiting = sum(self.fate(name) == "not judged" for name in unjudged(self._codes))
        return (
            f"{told} **The run is not over: {waiting} more have outlived the unit tests, and wait for whole managers.**"
        )

    def _told_survivors(self) -> list[str]:
        """A line for each function with survivors, by their numbers."""
        numbers: dict[str, list[str]] = {}
        for name in self.survivors():
            of = f"`{module_of(name)}.py`, `{function_of(name)}`"
            numbers.setdefault(of, []).append(name.rpartition("__mutmut_")[2])
        lines = [f"- {of}: {', '.join(each)}" for of, each in numbers.items()]
        return ["", "Survivors, by function and mutmut's numbers:", "", *lines] if lines else []

    def survivors(self) -> list[str]:
        return [name for name in self._codes if self.fate(name) == "survives"]


def page_with_place(path: str) -> Path:
    """A page of the documentation that can take the tables: to be known before the hours that they take.

    Raises argparse.ArgumentTypeError for another.
    """
    page = Path(path)
    text = page.read_text(encoding="utf-8") if page.exists() else ""
    if text.count(BEGIN) != 1 or text.count(END) != 1 or text.index(BEGIN) > text.index(END):
        raise argparse.ArgumentTypeError(
            f"{page} has no place for the tables: write the lines {BEGIN} and {END} into it"
        )
    return page


def write_section(page: Path, section: str) -> None:
    """Put the tables between their marks."""
    head, rest = page.read_text(encoding="utf-8").split(BEGIN)
    page.write_text(f"{head}{BEGIN}\n{section}\n{END}{rest.split(END)[1]}", encoding="utf-8")


def unjudged(codes: dict[str, int | None]) -> list[str]:
    return [name for name, code in codes.items() if code in (SURVIVED, NO_TEST)]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=3600.0, help="wall time for each of the two benches")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument(
        "--again", action="store_true", help="judge once more what has survived, for there are new tests"
    )
    parser.add_argument("--report", action="store_true", help="only tell what is known")
    parser.add_argument("--write", type=page_with_place, help="write the tables into this page of the documentation")
    arguments = parser.parse_args()
    second = SecondOpinions()
    if not arguments.report:
        prepare()
        deadline = time.monotonic() + arguments.seconds
        survivors = Verdicts(exit_codes(), second.by_name).survivors() if arguments.again else []
        second.forget(survivors)
        for names in (survivors or of_rules(exit_codes()), ()):
            if time.monotonic() < deadline and names != []:
                make_and_judge(arguments.jobs, deadline - time.monotonic(), names)
        second.ask(unjudged(exit_codes()), arguments.seconds)
    verdicts = Verdicts(exit_codes(), second.by_name)
    section = verdicts.section()
    sys.stdout.write(section + "\n\n" + "\n".join(verdicts.survivors()) + "\n")
    if arguments.write is not None:
        write_section(arguments.write, section)
    return 0


if __name__ == "__main__":
    sys.exit(main())
