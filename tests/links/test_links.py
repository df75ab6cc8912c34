"""Promises and table of the trial of cuts. `make links` flies it."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import links_run
import pytest
from link_cells import CUTS, KNOWN_WITHIN, LinkCell, LinkResult, Moment, Place, cells, link_table
from msgspec.structs import replace
from namespaces import ROBOT_ADDRESS, TwoNamespaces, obstacle

GOOD = LinkResult(
    cell=LinkCell(Place.ON_BOARD, Moment.CRUISE, 10.0),
    known=2.1,
    screen="tcp/10.0.0.1:7447 has not answered since 14:03:11.",
    mission="SUCCEEDED: 1 of 1 waypoints reached",
    heard=True,
    succeeded=True,
    landed=50.0,
    from_home=0,
    collisions=0,
    left_fence=False,
    code=0,
    load=1.0,
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
    failed = replace(GOOD, cell=LinkCell(place, Moment.CRUISE, seconds), succeeded=False)
    assert failed.kept is not has_to


def test_a_cut_that_nobody_can_notice_needs_no_sentence() -> None:
    assert replace(GOOD, cell=LinkCell(Place.ON_BOARD, Moment.CRUISE, 0.5), known=None).kept


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

    def fly(self, cell: LinkCell, speed: float) -> LinkResult:
        del speed
        self.flown += 1
        return replace(GOOD, cell=cell, landed=None if cell.moment is Moment.LANDING else 50.0)


def test_what_was_flown_is_not_flown_again_and_a_broken_promise_is_the_exit_code(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pilot = Pilot()
    monkeypatch.setattr(links_run, "fly", pilot.fly)
    monkeypatch.setattr(links_run, "obstacle", lambda: None)
    results = ["--results", str(tmp_path / "links.jsonl")]
    assert links_run.main([*results, "--only", "on board / cruise"]) == 0
    assert pilot.flown == len(CUTS)
    assert links_run.main([*results, "--only", "on board / cruise"]) == 0
    assert pilot.flown == len(CUTS)
    assert links_run.main([*results, "--only", "on board / landing / 3 s"]) == 1
    assert "44 of 48 cells are not flown yet" in capsys.readouterr().out


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
