"""A mistyped command line is answered in sentences as every other mistake: what is wrong, and what to do."""

from __future__ import annotations

from functools import partial

import pytest
from typer.testing import CliRunner

from skillwing.services.errors import InvalidOptionError
from skillwing.services.terminal import cli
from skillwing.services.terminal.exit_codes import USAGE, exit_code_of


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        (
            "new-skill wave",
            "`skillwing new-skill` lacks `--skillset FILE` (skillset file). See `skillwing new-skill -h`.",
        ),
        ("trigger a", "`skillwing trigger` lacks `STATE` (its new state). See `skillwing trigger -h`."),
        ("up --roboter a", "`skillwing up` has no option `--roboter`; did you mean `--robot`? See `skillwing up -h`."),
        ("down -z", "`skillwing down` has no option `-z`. See `skillwing down -h`."),
        ("--nope", "`skillwing` has no option `--nope`. See `skillwing -h`."),
        ("up --speed", "`--speed` of `skillwing up` does not fit: Option `--speed` requires an argument."),
        ("up --viewer foo", "`--viewer` of `skillwing up` does not fit: `foo` is not one of `none`, `native`, `web`."),
        (
            "up --seed 4294967296",
            "`--seed` of `skillwing up` does not fit: 4294967296 is not from 0 to 4294967295.",
        ),
        ("runs prune --count -1", "`--count` of `skillwing runs prune` does not fit: -1 is not at least 0."),
        ("demo --fault-at=-1", "`--fault-at` of `skillwing demo` does not fit: -1 is not at least 0."),
        (
            "mission run a --robot left --owner-grace 100",
            "`--owner-grace` of `skillwing mission run` does not fit: 100 is not from 0 to 60.",
        ),
        ("replay a b", "`skillwing replay` does not fit: Got unexpected extra argument"),
        (
            "mission chek",
            "There is no command `chek` of `skillwing mission`; did you mean `check`? What exists: `list`",
        ),
        ("mission it's", "There is no command `it's` of `skillwing mission`. What exists: `list`"),
        ("mission a`b", "There is no command `a`b` of `skillwing mission`. What exists: `list`"),
        (
            "up --viewer it's",
            "`--viewer` of `skillwing up` does not fit: `it's` is not one of `none`, `native`, `web`.",
        ),
        ("up --speed it's", "`--speed` of `skillwing up` does not fit: `it's` is no speed: give a number"),
    ],
)
def test_it_is_a_sentence_and_a_way_out(line: str, sentence: str) -> None:
    with pytest.raises(InvalidOptionError) as caught:
        CliRunner().invoke(cli.app, line.split(), prog_name="skillwing", catch_exceptions=False)
    assert str(caught.value).startswith(sentence)
    assert exit_code_of(caught.value) == USAGE


def test_the_command_in_the_sentence_is_the_one_that_was_typed(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Advised commands choose the robot that was named; this one is no advice."""
    monkeypatch.setattr("sys.argv", ["skillwing", "mission", "run", "a", "--robot", "left", "--owner-grace", "100"])
    monkeypatch.setattr(cli, "app", partial(cli.app, prog_name="skillwing"))
    with pytest.raises(SystemExit):
        cli.main()
    said = capsys.readouterr().err
    assert said.endswith("100 is not from 0 to 60. See `skillwing mission run -h`.\n")
    assert "--robot left" not in said


def test_an_apostrophe_is_no_quote() -> None:
    with pytest.raises(InvalidOptionError, match=r"\(it's isn't\)"):
        CliRunner().invoke(cli.app, ["replay", "a", "it's", "isn't"], prog_name="skillwing", catch_exceptions=False)


def test_a_number_is_asked_for_in_plain_words() -> None:
    with pytest.raises(InvalidOptionError) as caught:
        CliRunner().invoke(cli.app, ["up", "--seed", "x"], prog_name="skillwing", catch_exceptions=False)
    assert str(caught.value).startswith("`--seed` of `skillwing up` does not fit: ")
    assert "parse" not in str(caught.value)


@pytest.mark.parametrize("line", ["", "mission"])
def test_who_names_no_command_gets_the_help(line: str) -> None:
    result = CliRunner().invoke(cli.app, line.split(), prog_name="skillwing")
    assert "Usage: skillwing" in result.output
    assert result.exit_code == USAGE
