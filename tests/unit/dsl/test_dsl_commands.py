from __future__ import annotations

import json
import tomllib
from pathlib import Path

import pytest
import typer
from command_runner import CommandRunner

from skillwing.dsl import load
from skillwing.dsl.commands.check import check
from skillwing.dsl.commands.generate import generate

CASES = Path(__file__).parent / "cases"
GOOD = str(CASES / "valid" / "everything.skillset")
LEAKY = str(CASES / "valid" / "paper.skillset")
BAD = str(CASES / "invalid" / "unknown_names.skillset")


@pytest.fixture
def app() -> typer.Typer:
    application = typer.Typer()
    application.command("check")(check)
    application.command("generate")(generate)
    return application


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        ([GOOD], 0),
        ([LEAKY], 0),
        ([LEAKY, "--strict"], 1),
        ([BAD], 1),
        ([GOOD, BAD], 1),
        (["nowhere.skillset"], 2),
        ([str(CASES)], 2),
        ([], 2),
    ],
)
def test_exit_codes_of_check(app: typer.Typer, arguments: list[str], code: int) -> None:
    assert CommandRunner().invoke(app, ["check", *arguments]).exit_code == code


def test_check_shows_every_problem_and_a_count(app: typer.Typer) -> None:
    output = CommandRunner().invoke(app, ["check", GOOD, BAD]).output
    assert output.count("error[SW012]") == 3
    assert f"{GOOD}: no problem" in output
    assert f"{BAD}: 9 errors" in output


def test_a_missing_file_is_one_sentence(app: typer.Typer) -> None:
    result = CommandRunner().invoke(app, ["check", "nowhere.skillset"])
    assert result.output.strip() == "`nowhere.skillset` cannot be read: No such file or directory. Name one that can."


def test_a_missing_file_hides_nothing_in_the_others(app: typer.Typer) -> None:
    result = CommandRunner().invoke(app, ["check", GOOD, "nowhere.skillset", str(CASES), BAD])
    assert result.exit_code == 2
    assert f"{GOOD}: no problem" in result.output
    assert f"{BAD}: 9 errors" in result.output
    assert result.stderr.splitlines() == [
        "`nowhere.skillset` cannot be read: No such file or directory. Name one that can.",
        f"`{CASES}` is a folder. Name a file in it.",
    ]


def test_a_binary_file_is_one_sentence(app: typer.Typer, tmp_path: Path) -> None:
    (tmp_path / "x.skillset").write_bytes(b"\xff\xfe\x00")
    result = CommandRunner().invoke(app, ["check", str(tmp_path / "x.skillset")])
    assert result.exit_code == 2
    assert "it is not text in UTF-8, from byte" in result.output


def test_json_has_place_and_help(app: typer.Typer) -> None:
    report = json.loads(CommandRunner().invoke(app, ["check", "--json", LEAKY]).stdout)
    assert [(item["code"], item["severity"], item["line"], item["column"]) for item in report] == [
        ("SW080", "warning", 18, 7)
    ]
    assert report[0]["help"]
    assert json.loads(CommandRunner().invoke(app, ["check", "--json", GOOD]).stdout) == []


def test_generate_does_not_take_nothing_for_the_current_folder(
    app: typer.Typer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    result = CommandRunner().invoke(app, ["generate", GOOD, "-o", ""])
    assert result.exit_code == 2
    assert "it is empty" in result.output
    assert list(tmp_path.iterdir()) == []


def test_generate_and_its_check(app: typer.Typer, tmp_path: Path) -> None:
    target = str(tmp_path / "robot")
    assert CommandRunner().invoke(app, ["generate", GOOD, "-o", target, "--check"]).exit_code == 1
    assert not (tmp_path / "robot").exists()
    assert CommandRunner().invoke(app, ["generate", GOOD, "-o", target]).exit_code == 0
    assert CommandRunner().invoke(app, ["generate", GOOD, "-o", target, "--check"]).exit_code == 0
    (tmp_path / "robot" / "skills" / "move.py").write_text("mine = 1\n")
    (tmp_path / "robot" / "generated" / "types.py").write_text("edited")
    result = CommandRunner().invoke(app, ["generate", GOOD, "-o", target, "--check"])
    assert result.exit_code == 1
    assert "types.py" in result.output
    assert "move.py" not in result.output


def test_generate_copies_the_script_of_the_mocks_with_the_skillset(app: typer.Typer, tmp_path: Path) -> None:
    source, script, package = (tmp_path / name for name in ("robot.skillset", "robot.mock.toml", "package"))
    source.write_text(Path(GOOD).read_text())
    script.write_text("seed = 3\n")
    words = ["generate", str(source), "-o", str(package)]
    assert CommandRunner().invoke(app, words).exit_code == 0
    (copy,) = (package / "generated").glob("*.mock.toml")
    assert (copy.stem, tomllib.loads(copy.read_text())) == (f"{load(source).name}.mock", {"seed": 3})
    script.write_text("seed = 4\n")
    assert copy.name in CommandRunner().invoke(app, [*words, "--check"]).output
    script.unlink()
    assert CommandRunner().invoke(app, words).exit_code == 0
    assert not copy.exists()


def test_generate_says_what_was_written_once_and_then_leaves_it(app: typer.Typer, tmp_path: Path) -> None:
    first = CommandRunner().invoke(app, ["generate", GOOD, "-o", str(tmp_path / "robot")])
    again = CommandRunner().invoke(app, ["generate", GOOD, "-o", str(tmp_path / "robot")])
    assert "robot.py" in first.output
    assert "yours" not in again.output


def test_generate_without_skeletons(app: typer.Typer, tmp_path: Path) -> None:
    target = tmp_path / "robot"
    assert CommandRunner().invoke(app, ["generate", GOOD, "-o", str(target), "--no-skeletons"]).exit_code == 0
    assert [path.name for path in target.iterdir()] == ["generated"]
    assert CommandRunner().invoke(app, ["generate", GOOD, "-o", str(target), "--check"]).exit_code == 0


def test_generate_refuses_a_skillset_with_errors(app: typer.Typer, tmp_path: Path) -> None:
    result = CommandRunner().invoke(app, ["generate", BAD, "-o", str(tmp_path / "robot")])
    assert result.exit_code == 1
    assert "nothing was generated" in result.output
    assert not (tmp_path / "robot").exists()


@pytest.mark.parametrize(
    ("name", "advice"),
    [("my-robot", "my_robot"), ("2wheels", "robot_2wheels"), ("json", "json_robot"), ("class", "class_robot")],
)
def test_generate_refuses_a_folder_that_cannot_be_imported(
    app: typer.Typer, tmp_path: Path, name: str, advice: str
) -> None:
    refused = CommandRunner().invoke(app, ["generate", GOOD, "-o", str(tmp_path / name)])
    assert refused.exit_code == 2
    assert f"{advice}`" in refused.stderr
    assert list(tmp_path.iterdir()) == []


def test_generate_refuses_the_generated_part_of_a_package(app: typer.Typer, tmp_path: Path) -> None:
    target = tmp_path / "robot"
    CommandRunner().invoke(app, ["generate", GOOD, "-o", str(target)])
    refused = CommandRunner().invoke(app, ["generate", GOOD, "-o", str(target / "generated")])
    assert refused.exit_code == 2
    assert f"-o {target}`" in refused.stderr


def test_generate_never_overwrites_what_somebody_wrote(app: typer.Typer, tmp_path: Path) -> None:
    own = tmp_path / "robot" / "generated" / "types.py"
    own.parent.mkdir(parents=True)
    own.write_text("MINE = 1\n")
    refused = CommandRunner().invoke(app, ["generate", GOOD, "-o", str(tmp_path / "robot")])
    assert refused.exit_code == 2
    assert "types.py" in refused.stderr
    assert own.read_text() == "MINE = 1\n"
    assert list(own.parent.iterdir()) == [own]
    assert list((tmp_path / "robot").iterdir()) == [own.parent]


def test_generate_tells_of_managers_without_a_skill(app: typer.Typer, tmp_path: Path) -> None:
    target = tmp_path / "robot"
    CommandRunner().invoke(app, ["generate", GOOD, "-o", str(target)])
    fewer = tmp_path / "everything.skillset"
    text = Path(GOOD).read_text()
    fewer.write_text(text[: text.index("    skill wait {")] + "}\n")
    result = CommandRunner().invoke(app, ["generate", str(fewer), "-o", str(target)])
    assert result.exit_code == 0
    assert "wait.py manages a skill" in result.output


def test_a_file_that_is_no_text_is_reported_when_loaded(tmp_path: Path) -> None:
    file = tmp_path / "lamp.skillset"
    file.write_bytes(b"skillset lamp {\r\n  // \xe9t\xe9\n}")
    with pytest.raises(OSError, match="it is not text in UTF-8, from byte 6 of line 2 on") as caught:
        load(file)
    assert caught.value.filename == str(file)
    file.write_bytes("skillset lamp {\r\n  // été\r\n}".encode())
    assert load(file).name == "lamp"
