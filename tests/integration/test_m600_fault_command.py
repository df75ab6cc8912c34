"""`skillwing fault` and `skillwing pilot` against a simulator in a process of its own."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from pathlib import Path

import pytest
from typer.testing import CliRunner

from skillwing.dsl.model import UnknownNameError
from skillwing.m600.operator_commands import LINK_KINDS, Handover, fault, pilot
from skillwing.m600.robot import ROBOT, functional_layer
from skillwing.services.errors import InvalidOptionError, SkillwingError
from skillwing.services.processes.launcher import Launcher
from skillwing.services.terminal import cli
from skillwing.services.terminal.exit_codes import NO_SYSTEM, USAGE, exit_code_of
from skillwing.sim_mujoco.sensors.table import SENSORS

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def endpoint(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    simulated = [spec for spec in functional_layer({"seed": 3}) if spec.name in ("sim", "link")]
    with Launcher(ROBOT.name, ROBOT.skillset.stem, tmp_path_factory.mktemp("run"), clock=ROBOT.clock) as launcher:
        launcher.start(simulated)
        yield launcher.endpoint


@pytest.fixture
def running(endpoint: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SKILLWING_CONNECT", endpoint)


@pytest.mark.usefixtures("running")
def test_switches_a_fault_on_and_off(capsys: pytest.CaptureFixture[str]) -> None:
    fault("zed")
    fault("zed", off=True)
    fault("lidar", kind="noise", magnitude=0.5)
    fault("lidar", kind="freeze")
    fault("lidar", off=True)
    fault("lidar", off=True)
    fault("link", kind="narrow")
    fault("link", kind="cut", off=True)
    fault("link", off=True)
    assert capsys.readouterr().out.splitlines() == [
        "Blackout of zed is on.",
        "Blackout of zed is off.",
        "Noise of lidar is on.",
        "Freeze of lidar is on.",
        "Noise of lidar is off. Freeze of lidar is off.",
        "No fault of lidar was on.",
        "Narrow of the link is on.",
        "Cut of link was not on.",
        "Narrow of the link is off.",
    ]


@pytest.mark.usefixtures("running")
def test_shows_what_can_fail_and_what_does(capsys: pytest.CaptureFixture[str]) -> None:
    fault("range", kind="slow")
    fault("rotor/2", kind="weak", magnitude=0.9)
    fault("link", kind="narrow")
    capsys.readouterr()
    fault(list_faults=True, as_json=True)
    told = {each["name"]: each for each in json.loads(capsys.readouterr().out)}
    assert told["range"]["active"] == ["slow"]
    assert "freeze" in told["gnss"]["kinds"]
    assert set(told) == {*SENSORS, "camera", "link", *(f"rotor/{number}" for number in range(1, 7))}
    kinds = {"blackout", "freeze", "noise", "bias", "dropout", "slow", "stopped", "weak", *LINK_KINDS}
    assert {kind for each in told.values() for kind in each["kinds"]} == kinds
    assert told["link"]["active"] == ["narrow"]
    assert told["zed"]["status"] in {"UNKNOWN", "OK", "FAILED"}
    assert (told["rotor/2"]["active"], told["rotor/2"]["status"]) == (["weak"], None)
    fault(list_faults=True)
    assert any(line.split()[0] == "rotor/2" and "weak" in line for line in capsys.readouterr().out.splitlines())
    fault("link", kind="narrow", off=True)
    fault("range", kind="slow", off=True)
    fault("rotor/2", kind="weak", off=True)


@pytest.mark.usefixtures("running")
def test_an_unknown_name_is_answered_with_those_that_run() -> None:
    with pytest.raises(UnknownNameError, match=r"did you mean `gnss`\?"):
        fault("gns")


@pytest.mark.usefixtures("running")
@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("skillwing fault l", {"lidar", "link"}),
        ("skillwing fault rotor/", {f"rotor/{number}" for number in range(1, 7)}),
        ("skillwing fault rotor/2 --kind s", {"slow", "stopped"}),
    ],
)
def test_names_and_kinds_are_completed_from_the_running_drone(line: str, expected: set[str]) -> None:
    words = {"COMP_WORDS": line, "COMP_CWORD": str(len(line.split(" ")) - 1), "_TYPER_COMPLETE_ARGS": line}
    env = {"_SKILLWING_COMPLETE": "complete_bash", **words}
    result = CliRunner().invoke(cli.app, [], prog_name="skillwing", env=env)
    assert set(result.stdout.split()) == expected


@pytest.mark.usefixtures("running")
def test_without_a_name_it_says_how_to_find_one() -> None:
    with pytest.raises(InvalidOptionError, match="--list"):
        fault()


@pytest.mark.usefixtures("running")
@pytest.mark.parametrize(
    ("sensor", "kind", "known", "meant"),
    [
        ("link", "ctu", "narrow, cut", "cut"),
        ("zed", "blakout", "blackout, freeze", "blackout"),
        ("rotor/2", "stoped", "stopped, weak", "stopped"),
    ],
)
def test_a_wrong_name_is_answered_with_what_exists(sensor: str, kind: str, known: str, meant: str) -> None:
    with pytest.raises(InvalidOptionError, match=rf"did you mean `{meant}`; choose one of {known}") as caught:
        fault(sensor, kind=kind)
    assert exit_code_of(caught.value) == USAGE


@pytest.mark.usefixtures("running")
@pytest.mark.parametrize(
    ("sensor", "kind", "magnitude", "sentence"),
    [
        ("zed", "dropout", 3.0, "The magnitude of dropout has to be from 0 to 1, not 3. Choose another magnitude."),
        ("zed", "blackout", 3.0, "Blackout has no magnitude. Leave the magnitude out."),
        ("rotor/2", "stopped", 1.0, "Stopped has no magnitude. Leave the magnitude out."),
        ("link", "cut", 1.0, "Cut has no magnitude. Leave the magnitude out."),
    ],
)
def test_a_magnitude_that_a_kind_cannot_have_is_a_malformed_value(
    sensor: str, kind: str, magnitude: float, sentence: str
) -> None:
    with pytest.raises(InvalidOptionError) as caught:
        fault(sensor, kind=kind, magnitude=magnitude)
    assert str(caught.value) == sentence
    assert exit_code_of(caught.value) == USAGE


@pytest.mark.usefixtures("running")
def test_the_pilot_takes_the_authority_and_gives_it_back(capsys: pytest.CaptureFixture[str]) -> None:
    pilot(Handover.TAKE)
    pilot(Handover.GIVE)
    assert capsys.readouterr().out.splitlines() == [
        "The safety pilot has the authority.",
        "The computer has the authority.",
    ]


@pytest.mark.usefixtures("running")
def test_both_answer_in_json(capsys: pytest.CaptureFixture[str]) -> None:
    fault("zed", off=True, as_json=True)
    assert json.loads(capsys.readouterr().out)["on"] is False
    pilot(Handover.GIVE, as_json=True)
    assert json.loads(capsys.readouterr().out)["authority"] is True


@pytest.mark.parametrize("magnitude", [math.nan, math.inf])
def test_a_magnitude_that_is_no_number_is_refused(magnitude: float) -> None:
    with pytest.raises(InvalidOptionError, match="is a number from") as caught:
        fault("zed", kind="noise", magnitude=magnitude)
    assert exit_code_of(caught.value) == USAGE


def test_without_a_system_it_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("SKILLWING_CONNECT", raising=False)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    with pytest.raises(SkillwingError, match="skillwing up") as caught:
        fault("zed")
    assert exit_code_of(caught.value) == NO_SYSTEM
