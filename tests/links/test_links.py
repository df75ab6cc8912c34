"""Promises and table of the trial of cuts. `make links` flies it."""

from __future__ import annotations

import re
import sys
from dataclasses import dataclass
from pathlib import Path

import links_run
import msgspec
import pytest
from link_cells import (
    BACK_WITHIN,
    CUTS,
    GRACE,
    KNOWN_WITHIN,
    SAYS,
    LinkCell,
    LinkResult,
    Moment,
    Place,
    cells,
    link_table,
)
from msgspec.structs import replace
from namespaces import ROBOT_ADDRESS, TwoNamespaces, obstacle

from skillwing.bt_missions.cli.foreground import without_link
from skillwing.m600.robot import ROBOT
from skillwing.services.client.connection import Target
from skillwing.services.terminal.link_monitor import ON_BOARD

TARGET = Target(ROBOT.name, "tcp/10.0.0.1:7447", ROBOT.skillset, ROBOT.clock, without_goals=ROBOT.without_goals)

GOOD = LinkResult(
    cell=LinkCell(Place.ON_BOARD, Moment.CRUISE, 10.0),
    known=2.1,
    screen="tcp/10.0.0.1:7447 has not answered since 14:03:11. A mission on board goes on.",
    mission="SUCCEEDED: 1 of 1 waypoints reached",
    heard=True,
    succeeded=True,
    landed=50.0,
    from_home=0,
    collisions=0,
    left_fence=False,
    code=0,
    load=1.0,
    back=2.2,
    flown_by="0123456789ab",
    day="2026-11-28",
)


def test_every_place_moment_and_cut_has_a_cell() -> None:
    assert len(set(cells())) == len(Place) * len(Moment) * len(CUTS)


@pytest.mark.parametrize(
    ("bad", "problem"),
    [
        (replace(GOOD, collisions=1), "1 collisions"),
        (replace(GOOD, left_fence=True), "left the fence"),
        (replace(GOOD, landed=None), "still flies"),
        (replace(GOOD, known=None), "the operator does not know in time"),
        (replace(GOOD, known=KNOWN_WITHIN + 0.1), "the operator does not know in time"),
        (
            replace(GOOD, screen="tcp/... has not answered since 14:03:11."),
            "the screen does not say what the robot does",
        ),
        (replace(GOOD, back=None), "the operator does not know in time that the link is back"),
        (replace(GOOD, back=BACK_WITHIN + 0.1), "the operator does not know in time that the link is back"),
        (replace(GOOD, code=None), "the command does not end"),
        (replace(GOOD, succeeded=False), "the mission failed"),
    ],
)
def test_a_flight_that_breaks_a_promise_says_which(bad: LinkResult, problem: str) -> None:
    assert GOOD.kept
    assert bad.problems == (problem,)
    assert f"**{problem}**" in "\n".join(link_table([bad]))


@pytest.mark.parametrize(
    ("place", "seconds", "has_to"),
    [
        (Place.ON_BOARD, 10.0, True),
        (Place.ON_BOARD, None, True),
        (Place.GROUND, 3.0, False),
        (Place.GROUND_WITH_GRACE, 10.0, True),
        (Place.GROUND_WITH_GRACE, None, False),
    ],
)
def test_a_mission_has_to_succeed_where_nothing_it_needs_is_cut(
    place: Place, seconds: float | None, has_to: bool
) -> None:
    failed = replace(GOOD, cell=LinkCell(place, Moment.CRUISE, seconds), succeeded=False, screen=" ".join(SAYS[place]))
    assert failed.kept is not has_to
    if seconds is None:
        assert replace(failed, succeeded=True, code=None, back=None).kept, "the command waits for its link"


@pytest.mark.parametrize(
    ("place", "sentence"),
    [
        (Place.ON_BOARD, ON_BOARD),
        (Place.GROUND, without_link(0.0, TARGET)),
        (Place.GROUND_WITH_GRACE, without_link(GRACE, TARGET)),
    ],
)
def test_the_sentences_of_the_commands_say_what_the_robot_does(place: Place, sentence: str) -> None:
    assert all(part in sentence for part in SAYS[place])
    assert not any(part in sentence for other in Place if other is not place for part in SAYS[other][:1])


def test_a_cut_that_nobody_can_notice_needs_no_sentence() -> None:
    assert replace(GOOD, cell=LinkCell(Place.ON_BOARD, Moment.CRUISE, 0.5), known=None, screen="", back=None).kept


SERVER = """
import socket, sys
with socket.create_server((sys.argv[1], 0)) as server:
    print(server.getsockname()[1], flush=True)
    while True:
        server.accept()
"""
CLIENT = "import socket, sys; socket.create_connection((sys.argv[1], int(sys.argv[2])), timeout=1.0)"


@dataclass
class Pilot:
    flown: int = 0

    def fly(self, cell: LinkCell, speed: float, *, keys: bool) -> LinkResult:
        del speed
        self.flown += 1
        landed, code = None if cell.moment is Moment.LANDING else 50.0, 0 if cell.heals else None
        return replace(GOOD, cell=cell, landed=landed, code=code, keys=keys)


def test_what_was_flown_is_not_flown_again_and_a_broken_promise_is_the_exit_code(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pilot = Pilot()
    monkeypatch.setattr(links_run, "fly", pilot.fly)
    monkeypatch.setattr(links_run, "obstacle", lambda: None)
    monkeypatch.setattr(links_run, "code_of_links", lambda: "aaaaaaaaaaaa")  # takes a second for each flight
    results = ["--results", str(tmp_path / "links.jsonl")]
    assert links_run.main([*results, "--only", "on board / cruise"]) == 0
    assert pilot.flown == len(CUTS)
    assert links_run.main([*results, "--only", "on board / cruise"]) == 0
    assert pilot.flown == len(CUTS)
    assert links_run.main([*results, "--only", "on board / landing / 3 s"]) == 1
    assert "44 of 48 cells are not flown yet" in capsys.readouterr().out
    assert links_run.main([*results, "--only", "on board / cruise / 3 s", "--keys"]) == 0
    assert pilot.flown == len(CUTS) + 2
    assert "47 of 48 cells are not flown yet" in capsys.readouterr().out


def test_the_code_of_the_trial_has_a_digest() -> None:
    assert re.fullmatch("[0-9a-f]{12}", links_run.code_of_links())


def test_flights_of_other_code_are_flown_again_and_stay_out_of_the_table(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pilot, codes = Pilot(), ["aaaaaaaaaaaa"]
    monkeypatch.setattr(links_run, "fly", pilot.fly)
    monkeypatch.setattr(links_run, "obstacle", lambda: None)
    monkeypatch.setattr(links_run, "code_of_links", lambda: codes[-1])
    file = tmp_path / "links.jsonl"
    older = msgspec.to_builtins(GOOD)
    del older["flown_by"], older["day"]
    file.write_bytes(msgspec.json.encode(older) + b"\n")
    words = ["--results", str(file), "--only", GOOD.cell.name]
    assert links_run.main(words) == 0
    codes.append("bbbbbbbbbbbb")
    assert links_run.main(words) == 0
    assert pilot.flown == 2
    said = capsys.readouterr().out
    assert "47 of 48 cells are not flown yet; seed 1, code aaaaaaaaaaaa, " in said
    assert "47 of 48 cells are not flown yet; seed 1, code bbbbbbbbbbbb, " in said

    def changes(cell: LinkCell, speed: float, *, keys: bool) -> LinkResult:
        codes.append("cccccccccccc")
        return pilot.fly(cell, speed, keys=keys)

    monkeypatch.setattr(links_run, "fly", changes)
    assert links_run.main(["--results", str(file), "--only", "on board / landing / 3 s"]) == 1
    assert "The code has changed meanwhile." in capsys.readouterr().out
    assert len(file.read_text(encoding="utf-8").splitlines()) == 3
    assert links_run.main(["--only", "nowhere"]) == 2


def test_without_namespaces_nothing_is_flown_and_the_reason_is_said(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(links_run, "obstacle", lambda: "network namespaces need root")
    assert links_run.main([]) == 0
    assert capsys.readouterr().out == "Nothing is flown: network namespaces need root.\n"


@pytest.mark.slow
def test_a_cut_drops_packets_and_a_healed_link_carries_them() -> None:
    reason = obstacle()
    if reason is not None:
        pytest.skip(reason)
    with TwoNamespaces() as spaces:
        server = spaces.start(spaces.robot, [sys.executable, "-c", SERVER, ROBOT_ADDRESS], {})
        try:
            assert server.stdout is not None
            port = server.stdout.readline().strip()

            def connects() -> bool:
                words = [sys.executable, "-c", CLIENT, ROBOT_ADDRESS, port]
                process = spaces.start(spaces.station, words, {})
                process.communicate(timeout=20)
                return process.returncode == 0

            assert connects()
            spaces.cut()
            assert not connects()
            spaces.heal()
            assert connects()
        finally:
            server.kill()
            server.communicate(timeout=20)
