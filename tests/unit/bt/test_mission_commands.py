"""The words of `skillwing mission`, as far as they need no system."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from skillwing.bt_missions.commands import mission
from skillwing.bt_missions.missions.mapping import MISSION, MappingOptions
from skillwing.bt_missions.running.option_words import parse_options
from skillwing.services.errors import InvalidOptionError


def test_options_are_read_from_words() -> None:
    words = ["route=30,0,4; 30,20,4;", "speed=1.5", "area=-10,-10,40,30"]
    assert MISSION.read_options(parse_options(words)) == MappingOptions(
        route=((30.0, 0.0, 4.0), (30.0, 20.0, 4.0)), speed=1.5, area=(-10.0, -10.0, 40.0, 30.0)
    )


def test_options_are_read_from_json() -> None:
    assert parse_options(["route=[[1, 2, 3]]"]) == {"route": [[1, 2, 3]]}


@pytest.mark.parametrize("words", [["speed"], ["=3"], ["speed=1", "speed=2"], ["route=[[1,"]])
def test_words_that_are_no_options_are_refused_with_a_sentence(words: list[str]) -> None:
    with pytest.raises(InvalidOptionError, match=r"\.$"):
        parse_options(words)


def test_the_list_of_missions_names_each_option_with_its_default() -> None:
    result = CliRunner().invoke(mission, ["list", "--json"])
    assert result.exit_code == 0
    (entry,) = [each for each in json.loads(result.output) if each["mission"] == "mapping"]
    assert entry["options"]["speed"] == 2.0
    assert "mapping" in CliRunner().invoke(mission, ["list"]).output
