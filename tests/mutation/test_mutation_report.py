"""Reports of the mutation bench: survivors by name, and whether the run is finished."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

from mutants import COPIED, ROOT, function_of
from mutation_run import BENCHES, Judgement, Judgements, section
from rules import RULES

from skillwing.services import client, core, managers

BEGIN_GOAL = "skillwing.services.core.resource_core.xǁResourceCoreǁbegin__mutmut_"
SEED = "tests/simulation/test_simulation.py::test_promises_are_kept[0]"
JUDGED = {
    f"{BEGIN_GOAL}1": Judgement("f", killers=["tests/unit/services/test_laws.py::TestManagers::runTest"]),
    f"{BEGIN_GOAL}2": Judgement("f", killers=["", ""]),
    f"{BEGIN_GOAL}3": Judgement("f", killers=[""]),
    f"{BEGIN_GOAL}4": Judgement("f"),
}


def test_what_is_known_so_far_says_so_and_names_survivors() -> None:
    text = section(JUDGED)
    assert "2 of 4 mutants are judged, 1 survive" in text
    assert "not over: 1 more have outlived the unit tests" in text
    assert "| `resource_core.py` | 4 | 1 | 0 | 0 | 1 | 2 |" in text
    assert "- `resource_core.py`, `ResourceCore.begin`: 2" in text.splitlines()


def test_a_run_that_is_over_does_not_excuse_itself() -> None:
    told = section(
        {
            f"{BEGIN_GOAL}1": Judgement("f", killers=["", SEED]),
            f"{BEGIN_GOAL}2": Judgement("f", killers=["", ""]),
            "skillwing.services.core.values.x_by_path__mutmut_1": Judgement("f", benches=1, killers=[""]),
        }
    )
    assert "3 of 3 mutants are judged, 2 survive" in told
    assert "not over" not in told
    assert "| `resource_core.py` | 2 | 0 | 0 | 1 | 1 | 0 |" in told
    assert "| `values.py` | 1 | 0 | 0 | 0 | 1 | 0 |" in told


def test_a_changed_function_is_tested_again_and_survivors_on_demand(tmp_path: Path) -> None:
    file = tmp_path / "judgements.json"
    mutants = {f"{BEGIN_GOAL}1": "as it was", f"{BEGIN_GOAL}2": "as it was", "skillwing.m.x_other__mutmut_1": "new"}
    first = Judgements(mutants, file)
    for judgement in first.by_name.values():
        judgement.killers = ["", ""]
    first.by_name[f"{BEGIN_GOAL}2"].killers = ["a test"]
    first.write()
    second = Judgements(mutants | {f"{BEGIN_GOAL}1": "is now"}, file)
    assert second.waiting_for(0) == [f"{BEGIN_GOAL}1"]
    second.forget_survivors()
    assert second.waiting_for(0) == [f"{BEGIN_GOAL}1", "skillwing.m.x_other__mutmut_1"], "where rules stand first"


TRAMPOLINED = """
from mutmut.mutation.trampoline import wrap_in_trampoline
mutants = {}
@wrap_in_trampoline(mutants)
def x_double(x): return 2 * x
def right(x): return 2 * x
def wrong(x): return 3 * x
mutants |= {"_mutmut_orig": right, "x_double__mutmut_1": wrong, "x_double__mutmut_2": right}
right.__name__ = "x_double__mutmut_orig"
"""
TESTS = """
from subject import x_double
def test_of_something_else(): assert True
def test_zero(): assert x_double(0) == 0
def test_one(): assert x_double(1) == 2
"""


def test_the_bench_tells_which_test_kills_a_mutant(tmp_path: Path) -> None:
    (tmp_path / "subject.py").write_text(TRAMPOLINED, encoding="utf-8")
    (tmp_path / "test_subject.py").write_text(TESTS, encoding="utf-8")
    (tmp_path / "pyproject.toml").write_text("[tool.pytest.ini_options]\n", encoding="utf-8")
    names = [f"subject.x_double__mutmut_{number}" for number in (1, 2)] + ["subject.x_unknown__mutmut_1"]
    bench = [sys.executable, str(Path(__file__).with_name("bench.py")), "test_subject.py"]
    told = subprocess.run(bench, cwd=tmp_path, input="\n".join(names), capture_output=True, text=True, check=True)
    assert told.stdout.splitlines() == [
        f"{names[0]}\ttest_subject.py::test_one",
        f"{names[1]}\t",
        f"{names[2]}\t",
    ]


def test_a_bench_whose_tests_fail_without_mutants_judges_nothing(tmp_path: Path) -> None:
    (tmp_path / "test_subject.py").write_text("def test_wrong(): assert False", encoding="utf-8")
    bench = [sys.executable, str(Path(__file__).with_name("bench.py")), "test_subject.py"]
    told = subprocess.run(bench, cwd=tmp_path, input="a.x_b__mutmut_1\n", capture_output=True, text=True, check=False)
    assert told.returncode != 0
    assert told.stdout == ""


def test_rules_name_functions_that_exist() -> None:
    """A function that was renamed would fall out of its rule without a word."""
    files = [
        file for package in (core, managers, client) for path in package.__path__ for file in Path(path).glob("*.py")
    ]
    code = "\n".join(file.read_text(encoding="utf-8") for file in files)
    for functions in RULES.values():
        for function in functions:
            name = function.rpartition(".")[2]
            assert f"def {name}(" in code, function
            assert f"class {function.rpartition('.')[0]}" in code or "." not in function, function


def test_helpers_that_the_tests_import_are_in_the_workspace() -> None:
    """A helper that moves would end a long run at the first test that needs it."""
    tests = ROOT / "tests"
    helpers = {file.stem for file in tests.glob("*.py")}
    copied = {name.removesuffix(".py") for name in COPIED}
    benches = {tests / test.removeprefix("tests/").partition("::")[0] for bench in BENCHES for test in bench}
    for file in {*benches, *(tests / "simulation").glob("*.py"), tests / "conftest.py"}:
        imported = set(re.findall(r"^(?:from|import) (\w+)", file.read_text(encoding="utf-8"), re.MULTILINE))
        assert imported & helpers <= copied, file


def test_names_of_mutants_tell_their_function() -> None:
    assert function_of(f"{BEGIN_GOAL}1") == "ResourceCore.begin"
    assert function_of("skillwing.services.core.grants.x_check_fence__mutmut_2") == "check_fence"
