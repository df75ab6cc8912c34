"""Errors of commands as JSON, and the exit codes that stay the same."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from skillwing.bt_missions.cli import mission
from skillwing.bt_missions.mission.problems import FaultyMissionError, MissionProblem
from skillwing.dsl import SkillsetError, parse
from skillwing.services.core.refusal import RefusedError
from skillwing.services.errors import InvalidInputError, InvalidOptionError, NoReplyError, SeveralSystemsError
from skillwing.services.protocol import ErrorCode, Keys
from skillwing.services.terminal import cli
from skillwing.services.terminal.error_facts import error_facts, wants_json
from skillwing.services.terminal.exit_codes import FAILED, NO_SYSTEM, USAGE, exit_code_of

Failed = Callable[..., tuple[int, str, str]]


@pytest.fixture
def failed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Failed:
    """Exit code, output and error of a command without a running system."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.delenv("SKILLWING_CONNECT", raising=False)

    def run(*words: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["skillwing", *words])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        assert isinstance(ended.value.code, int)
        said = capsys.readouterr()
        return ended.value.code, said.out, said.err

    return run


@pytest.mark.parametrize(
    ("words", "code", "kind", "what"),
    [
        (("status", "--json"), NO_SYSTEM, "no_system", "No system is running."),
        (
            ("start", "takeoff", "--json", "--nope"),
            USAGE,
            "invalid_option",
            "start` has no option `--nope`.",
        ),
        (("start", "--json"), USAGE, "invalid_option", "start` lacks `SKILL` (skill to start)."),
    ],
)
def test_an_error_is_json_if_the_output_would_be(
    words: tuple[str, ...], code: int, kind: str, what: str, failed: Failed
) -> None:
    ended, out, error = failed(*words)
    assert (ended, out) == (code, "")
    (line,) = error.splitlines()
    facts = json.loads(line)["error"]
    assert (facts["kind"], facts["exit_code"]) == (kind, code)
    assert facts["what"].endswith(what)
    assert facts["remedy"]


def test_a_skillset_that_cannot_be_read_is_json_too(tmp_path: Path, failed: Failed) -> None:
    missing, folder = tmp_path / "missing.skillset", tmp_path
    code, out, error = failed("check", "--json", str(missing))
    assert (code, json.loads(out)) == (USAGE, [])
    found = json.loads(error)["error"]
    assert (found["kind"], found["place"], found["exit_code"]) == ("unreadable", str(missing), USAGE)
    assert (found["what"], found["remedy"]) == (
        f"`{missing}` cannot be read: No such file or directory.",
        "Name one that can.",
    )
    *_, error = failed("check", "--json", str(missing), str(folder))
    assert len(json.loads(error)["error"]["problems"]) == 2


@pytest.mark.parametrize("words", [("check", "--json"), ("check", "--json", "--explain", "SW999")])
def test_wrong_usage_of_check_is_json_too(words: tuple[str, ...], failed: Failed) -> None:
    code, out, error = failed(*words)
    assert (code, out) == (USAGE, "")
    assert json.loads(error)["error"]["kind"] == "usage"


@pytest.mark.parametrize("words", [("status",), ("start", "--", "--json")])
def test_any_other_error_is_a_sentence(words: tuple[str, ...], failed: Failed) -> None:
    _, _, error = failed(*words)
    assert error == "No system is running. Start one with `skillwing up`.\n"


def facts(error: Exception) -> dict[str, Any]:
    return error_facts(error, str(error), exit_code_of(error))["error"]


class Silent:
    """A connection to a system in which nothing runs."""

    target = SimpleNamespace(endpoint="tcp/127.0.0.1:1", robot="toy")
    skillset, keys = parse("skillset toy { skill lift { result { DONE } } }", "toy.skillset"), Keys("toy")

    def __enter__(self) -> Silent:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def goal(self, skill: str, goal_id: str | None = None) -> None:
        return None

    def ask(self, key: str, *_: object) -> None:
        raise NoReplyError(key)


@pytest.mark.parametrize(
    ("module", "words", "kind"),
    [
        ("skillwing.services.commands.interrupt", ("interrupt", "lift"), "no_goal"),
        ("skillwing.bt_missions.cli.mission", ("mission", "pause"), "no_mission"),
    ],
)
def test_what_does_not_run_has_a_kind_of_its_own(
    module: str, words: tuple[str, ...], kind: str, failed: Failed, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(f"{module}.connect", lambda *_, **__: Silent())
    monkeypatch.setattr(mission, "robots_with_missions", lambda _: [])
    ended, _, error = failed(*words, "--json")
    assert (ended, json.loads(error)["error"]["kind"]) == (FAILED, kind)


def test_each_wrong_input_is_a_problem_of_its_own() -> None:
    found = facts(InvalidInputError("lift", {"height": "`height` is missing.", "mode": "`mode` is `X`."}))
    assert found["problems"] == {"height": "`height` is missing.", "mode": "`mode` is `X`."}
    assert (found["kind"], found["remedy"]) == ("invalid_input", None)


def test_a_problem_of_a_file_has_its_place() -> None:
    with pytest.raises(SkillsetError) as caught:
        parse("skillset a {\n    skill b { inptu { x: float64 } }\n}", "a.skillset")
    found = facts(caught.value)
    assert found["kind"] == "skillset"
    assert found["place"].startswith("a.skillset:2:")
    assert len(found["problems"]) == len(caught.value.diagnostics)
    assert facts(FileNotFoundError(2, "No such file", "b.skillset"))["place"] == "b.skillset"


def test_each_problem_of_a_mission_is_a_sentence_with_its_place() -> None:
    error = FaultyMissionError([MissionProblem("`land` is missing.", "hop.xml:3"), MissionProblem("It is empty.")])
    found = json.loads(json.dumps(facts(error)))
    assert found["problems"] == ["hop.xml:3: `land` is missing.", "It is empty."]


def test_a_refusal_has_the_words_of_the_process_that_refused() -> None:
    found = facts(RefusedError(ErrorCode.NOT_ALLOWED, "It is off. Always.", help="Switch it on."))
    assert (found["what"], found["remedy"]) == ("It is off. Always.", "Switch it on.")


def test_a_full_stop_in_a_quotation_ends_no_sentence() -> None:
    found = facts(InvalidOptionError("x", "There is no `a. b`. See `skillwing c. d`."))
    assert (found["what"], found["remedy"]) == ("There is no `a. b`.", "See `skillwing c. d`.")
    assert facts(InvalidOptionError("x", "There is none."))["remedy"] is None


def test_a_word_after_two_dashes_is_no_option() -> None:
    assert wants_json(["start", "--json"])
    assert not wants_json(["start", "--", "--json"])


def test_several_systems_are_not_none() -> None:
    assert exit_code_of(SeveralSystemsError("Several systems are running.")) == USAGE
