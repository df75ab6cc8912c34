"""Results of different code are never mixed: what counts as the code of a flight, and runs in which it changes."""

from __future__ import annotations

import importlib
import json
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from types import ModuleType
from typing import Self

import pytest
from msgspec.structs import replace

from skillwing.evaluation.campaign import flight_code as module
from skillwing.evaluation.campaign.flight_code import (
    CodeChangedError,
    FlyingCode,
    claim,
    flight_code,
    flying_files,
)
from skillwing.evaluation.campaign.ledger import LEDGER_FILE, read_results
from skillwing.evaluation.flights.plan import FlightPlan
from skillwing.evaluation.flights.result import End, FlightResult
from skillwing.services.errors import InvalidOptionError

PAPER = Path(__file__).parents[3] / "benchmarks" / "paper"
HOVER = '''"""Stays."""

SECONDS = 2.0
"""So long."""
if SECONDS:
    class Modes:
        def hovers(self, mode: str) -> bool:
            """Says so."""
            return mode not in {"LOITER", "AUTO"}
'''
A_MOMENT = """
import json, sys
from skillwing.evaluation.flights.conditions import Condition
from skillwing.evaluation.judged_flight import fly
from skillwing.evaluation.flights.plan import FlightPlan

fly(FlightPlan(mission="inspection", world="inspection", seed=0, condition=Condition.NONE), longest=0.1)
files = (getattr(module, "__file__", None) for name, module in sys.modules.items() if name.startswith("skillwing."))
print(json.dumps([file for file in files if file]))
"""


@pytest.fixture(autouse=True, scope="module")
def paper() -> Iterator[Path]:
    sys.path.insert(0, str(PAPER))
    yield PAPER
    sys.path.remove(str(PAPER))


def script(name: str) -> ModuleType:
    return importlib.import_module(name)


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A small one that has a file of each kind."""
    for name, text in {
        "m600/skills/hover.py": HOVER,
        "m600/m600.skillset": "skillset m600 {}\n",
        "evaluation/dashboard/scene.py": "COLOUR = 1\n",
        "evaluation/flights/alternatives/mapping.py": "",
    }.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


@pytest.mark.parametrize(
    ("file", "text", "other"),
    [
        ("m600/skills/hover.py", "# For now.\n" + HOVER.replace("Stays.", "Holds its place."), False),
        ("m600/skills/hover.py", HOVER.replace("So long.", "Not longer."), False),
        ("m600/skills/hover.py", HOVER.replace("Says so.", "Says it.\n"), False),
        ("m600/skills/hover.py", HOVER.replace("2.0", "2.5"), True),
        ("m600/skills/hover.py", HOVER.replace("2.0", "2"), True),
        ("m600/skills/hover.py", HOVER.replace('"LOITER"', '"HOLD"'), True),
        ("m600/skills/hover.py", HOVER.replace("mode: str", "mode: bytes"), True),
        ("m600/skills/hover.py", HOVER.replace("not in", "in"), True),
        ("m600/m600.skillset", "skillset m600 { resource r { initial A } }\n", True),
        ("evaluation/dashboard/scene.py", "COLOUR = 2\n", False),
        ("m600/skills/more.py", "", True),
    ],
)
def test_code_is_another_one_when_what_flies_is(package: Path, file: str, text: str, other: bool) -> None:
    before = flight_code([package])
    (package / file).write_text(text, encoding="utf-8")
    after = flight_code([package])
    assert (after.digest != before.digest) is other
    assert before.changes(after) == ([file] if other else [])


@pytest.mark.timeout(300)  # A process of its own that loads everything, beside others that do.
def test_all_that_a_flight_loads_counts() -> None:
    told = subprocess.run([sys.executable, "-c", A_MOMENT], capture_output=True, text=True, check=True)
    loaded = {Path(file) for file in json.loads(told.stdout.splitlines()[-1])}
    assert len(loaded) > 100
    assert loaded <= set(flying_files().values())


class PaperPool:
    """Flies nothing, and says that all went well."""

    def __init__(self, jobs: int) -> None:
        pass

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        pass

    def fly(self, plans: Sequence[FlightPlan], run_dir: Callable[[FlightPlan], Path | None]) -> Iterator[FlightResult]:
        for plan in plans:
            run_dir(plan)
            yield FlightResult(plan=plan, end=End.HOME)


def test_a_run_goes_on_with_flights_of_its_own_code(
    tmp_path: Path, package: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run, flying = script("run"), FlyingCode([package])
    monkeypatch.setattr(run, "WorkerPool", PaperPool)
    plans = script("paper_flights").paper_plans(range(1))
    assert len(run.fly(plans[:3], tmp_path / "runs", 1, flying)) == 3
    changed = replace(plans[2], happens={"faults": []})
    run.fly([*plans, changed], tmp_path / "runs", 1, flying)
    assert [each.plan for each in read_results(tmp_path / "runs" / LEDGER_FILE)] == [*plans, changed]


def test_a_flight_of_which_the_page_has_a_picture_is_flown_again_if_it_was_not_recorded(
    tmp_path: Path, package: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    runs = tmp_path / "runs"
    run, flying = script("run"), FlyingCode([package])
    monkeypatch.setattr(run, "WorkerPool", PaperPool)
    plans = script("paper_flights").paper_plans(range(2))
    run.fly(plans, runs, 1, flying)
    assert {path.name for path in runs.iterdir() if path.is_dir()} == {
        f"mapping-courtyard-none-0-{label}" for label in ("nominal", "recovery", "none")
    } | {f"inspection-inspection-none-0-{label}" for label in ("recovery", "abort", "home", "none")}
    again = run.fly([plan for plan in plans if plan.seed == 1], runs, 1, flying)[len(plans) :]
    assert [each.plan.label for each in again] == ["nominal", "recovery", "none", "recovery", "abort", "home", "none"]
    assert all((runs / each.plan.name).is_dir() for each in again)


def test_a_flight_by_code_that_changed_meanwhile_is_not_kept(
    tmp_path: Path, package: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = script("run")
    monkeypatch.setattr(run, "WorkerPool", PaperPool)
    plans = script("paper_flights").paper_plans(range(1))
    flying = FlyingCode([package])
    run.fly(plans[:1], tmp_path / "runs", 1, flying)
    (package / "m600" / "m600.skillset").write_text("", encoding="utf-8")
    with pytest.raises(CodeChangedError, match=r"while it flew: m600/m600\.skillset"):
        run.fly(plans, tmp_path / "runs", 1, flying)
    assert len(read_results(tmp_path / "runs" / LEDGER_FILE)) == 1


def test_flights_are_kept_while_files_are_touched_that_stay_what_they_are(package: Path) -> None:
    flying, hover = FlyingCode([package]), package / "m600" / "skills" / "hover.py"
    hover.write_text(f"# For now.\n{HOVER}", encoding="utf-8")
    assert list(flying.kept([1, 2])) == [1, 2]
    hover.write_text("SECONDS = 2.0 +", encoding="utf-8")
    flights = flying.kept([3])
    with pytest.raises(CodeChangedError, match=r"while it flew: m600/skills/hover\.py\."):
        next(flights)


def test_flight_code_is_hashed_again_only_if_a_file_changed(package: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    flying = FlyingCode([package])
    monkeypatch.setattr(module, "flight_code", lambda package: pytest.fail("Nothing has changed."))
    assert list(flying.kept([1, 2])) == [1, 2]


def test_a_folder_is_of_one_code(tmp_path: Path, package: Path) -> None:
    folder = tmp_path / "flights"
    claim(folder, flight_code([package]))
    claim(folder, flight_code([package]))
    (package / "m600" / "m600.skillset").write_text("", encoding="utf-8")
    with pytest.raises(InvalidOptionError, match=r"m600\.skillset\. Start in another folder"):
        claim(folder, flight_code([package]))


def test_a_flight_by_code_that_somebody_deletes_is_not_kept(package: Path) -> None:
    flying = FlyingCode([package])
    (package / "evaluation/flights/alternatives/mapping.py").unlink()
    with pytest.raises(CodeChangedError, match=r"alternatives/mapping\.py"):
        next(flying.kept([1]))


def test_flights_of_unknown_code_are_not_gone_on_with(tmp_path: Path, package: Path) -> None:
    with pytest.raises(InvalidOptionError, match=r"does not name the code of its flights\. Choose another folder"):
        claim(tmp_path / "flights", flight_code([package]), begun=True)
