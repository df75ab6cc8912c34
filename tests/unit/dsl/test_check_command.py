"""`skillwing check`: its formats, and the pages it shows."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
import typer
from command_runner import CommandRunner
from typer.testing import Result

from skillwing.dsl.checking.reachability import parts
from skillwing.dsl.commands.check import check
from skillwing.dsl.diagnostics.codes import CODES, page_on

CASES = Path(__file__).parent / "cases"
BAD = str(CASES / "invalid" / "duplicates.skillset")
LEAKY = str(CASES / "valid" / "paper.skillset")
GOOD = str(CASES / "valid" / "everything.skillset")


def run(*arguments: str, text: str | None = None) -> Result:
    application = typer.Typer()
    application.command()(check)
    return CommandRunner().invoke(application, arguments, input=text)


def test_a_file_too_large_to_be_played_through_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    note = "too large to be played through"
    assert note not in run(GOOD).stdout
    monkeypatch.setattr(parts, "MOST_SKILLS", 0)
    assert f"{GOOD}: {note}" in run(GOOD).stdout


# --- SARIF: the properties that the specification requires, by its section numbers


def sarif(*files: str) -> dict[str, Any]:
    result = run("--format", "sarif", *files)
    assert result.exit_code in {0, 1}
    return json.loads(result.stdout)


@pytest.fixture(scope="module")
def log() -> dict[str, Any]:
    return sarif(BAD, LEAKY, GOOD)


def test_the_log_is_one_run_of_a_named_tool(log: dict[str, Any]) -> None:
    assert log["version"] == "2.1.0"  # 3.13.2
    assert log["$schema"].endswith("sarif-schema-2.1.0.json")
    (run_object,) = log["runs"]  # 3.13.4
    assert run_object["tool"]["driver"]["name"] == "skillwing"  # 3.14.6, 3.18.2, 3.19.8
    assert run_object["columnKind"] == "unicodeCodePoints"  # 3.14.17, since columns count characters


def test_every_rule_is_described(log: dict[str, Any]) -> None:
    rules = log["runs"][0]["tool"]["driver"]["rules"]
    assert [rule["id"] for rule in rules] == ["SW016", "SW080"]  # 3.49.3, no two alike
    for rule in rules:
        code = CODES[rule["id"]]
        assert rule["shortDescription"] == {"text": code.title}  # 3.49.9, 3.12.3: a text
        assert rule["help"]["text"] == page_on(code.name)  # 3.49.13; markdown needs a text beside it
        assert rule["defaultConfiguration"]["level"] == code.severity  # 3.49.14, 3.50.3


def test_every_result_names_its_rule_and_its_place(log: dict[str, Any]) -> None:
    run_object = log["runs"][0]
    results = run_object["results"]  # 3.14.23: present, or nothing was looked for
    assert len(results) == 8
    for result in results:
        rule = run_object["tool"]["driver"]["rules"][result["ruleIndex"]]  # 3.27.6
        assert result["ruleId"] == rule["id"]  # 3.27.5
        assert result["level"] in {"none", "note", "warning", "error"}  # 3.27.10
        assert result["message"]["text"].endswith(".")  # 3.27.11, 3.11.8
        for location in (*result["locations"], *result.get("relatedLocations", ())):
            place = location["physicalLocation"]
            assert Path(place["artifactLocation"]["uri"].removeprefix("file://")).is_file()  # 3.4.3
            region = place["region"]
            assert 1 <= region["startLine"] <= region["endLine"]  # 3.30.5
            assert 1 <= region["startColumn"] <= region["endColumn"]  # 3.30.6
        for related in result.get("relatedLocations", ()):
            assert isinstance(related["id"], int)  # 3.28.2
            assert related["message"]["text"] == "first declared here"


def test_a_clean_file_gives_an_empty_list_of_results() -> None:
    assert sarif(GOOD)["runs"][0]["results"] == []


def test_a_relative_path_becomes_a_relative_uri(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "my robot.skillset").write_text("skillset s { skill lambda { } }")
    monkeypatch.chdir(tmp_path)
    (result,) = sarif("my robot.skillset")["runs"][0]["results"]
    assert result["locations"][0]["physicalLocation"]["artifactLocation"] == {"uri": "my%20robot.skillset"}


# --- the other formats


def test_json_is_short_for_the_format() -> None:
    assert run("--json", BAD).stdout == run("--format", "json", BAD).stdout


def test_json_tells_the_related_place() -> None:
    first = json.loads(run("--json", BAD).stdout)[0]
    assert first["related"]["message"] == "first declared here"
    assert (first["related"]["line"], first["line"]) == (3, 3)
    assert first["related"]["column"] < first["column"]


def test_standard_input_has_a_name() -> None:
    result = run("-", text="skillset s { skill lambda { } }")
    assert result.exit_code == 1
    assert "--> <stdin>:1:20" in result.stdout
    assert "<stdin>: 1 error" in result.stdout


def test_several_files_are_shown_in_one_run() -> None:
    result = run(BAD, GOOD, LEAKY)
    assert [line for line in result.stdout.splitlines() if line.startswith(str(CASES))] == [
        f"{BAD}: 7 errors",
        f"{GOOD}: no problem",
        f"{LEAKY}: 1 warning",
    ]


# --- the pages


@pytest.mark.parametrize("code", ["SW042", "sw042"])
def test_explain_shows_the_page(code: str) -> None:
    result = run("--explain", code)
    assert result.exit_code == 0
    assert result.stdout == page_on("SW042")


def test_an_unknown_code_is_one_sentence() -> None:
    result = run("--explain", "SW42")
    assert result.exit_code == 2
    assert result.stderr == "There is no code `SW42`. Did you mean `SW042`?\n"


def test_nothing_to_check_is_one_sentence() -> None:
    result = run()
    assert result.exit_code == 2
    assert result.stderr == "Name the files to check, or `-` for standard input.\n"
