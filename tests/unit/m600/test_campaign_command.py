"""A campaign whose flights are killed, recorded, flown again: what is kept of it, what is told, and how it ends."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from socket import socket
from typing import Any

import pytest
import typer

from skillwing.dsl.model import UnknownNameError
from skillwing.evaluation.campaign import cluster, command
from skillwing.evaluation.campaign.flight_code import CodeChangedError, FlyingCode
from skillwing.evaluation.campaign.ledger import LEDGER_FILE, read_results
from skillwing.evaluation.campaign.recordings import UNFINISHED
from skillwing.evaluation.campaign.worker_pool import WorkerPool
from skillwing.services.errors import InvalidOptionError

PLAN = """
import json, os, sys
plan = json.loads(sys.argv[1])
result = {"plan": plan, "end": "landed at home", "phase": "SUCCEEDED", "digest": str(plan["seed"]), "clearance": 2.0}
"""
LANDS = PLAN + "print(json.dumps(result))"
KILLED = PLAN + "if plan['seed'] == 1: os.kill(os.getpid(), 9)\nprint(json.dumps(result))"
RECORDS = (
    PLAN
    + """
if len(sys.argv) > 2:
    assert not os.listdir(sys.argv[2]), "somebody has been here"
    open(os.path.join(sys.argv[2], "flight.jsonl"), "w").close()
"""
)
ENDS_OTHERWISE = PLAN + "print(json.dumps({**result, 'end': 'landed elsewhere', 'digest': 'another'}))"

FLIES = "m600/skills/hover.py"

Fly = Callable[..., int]


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """One in which a single file flies."""
    (tmp_path / FLIES).parent.mkdir(parents=True)
    (tmp_path / FLIES).write_text("SECONDS = 2.0\n", encoding="utf-8")
    return tmp_path


@pytest.fixture
def fly(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, package: Path) -> Fly:
    """Run a campaign whose flights are a program's; its exit code."""
    monkeypatch.setattr(command, "FlyingCode", partial(FlyingCode, [package]))

    def fly(source: str, **options: Any) -> int:
        monkeypatch.setattr(command, "WorkerPool", partial(WorkerPool, worker=(sys.executable, "-c", source)))
        with pytest.raises(typer.Exit) as ended:
            command.campaign("mapping", **{"output": tmp_path / "flights", "jobs": 1, **options})
        return ended.value.exit_code

    return fly


def seeds_in(folder: Path) -> list[int]:
    return [result.plan.seed for result in read_results(folder / LEDGER_FILE)]


def test_a_flight_that_was_killed_leaves_no_line_and_is_flown_by_resume(
    fly: Fly, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page, folder = tmp_path / "page.md", tmp_path / "flights"
    assert fly(KILLED, seeds="0:3", write=page) == 1
    assert seeds_in(folder) == [0, 2]
    told = capsys.readouterr().out
    assert "lost: Its process was killed by signal 9. Fly it again by --resume." in told
    assert "There is no result of mapping-courtyard-none-1. Its process was killed by signal 9." in told
    assert not page.exists()
    assert fly(LANDS, seeds="0:3", write=page, resume=True) == 0
    assert seeds_in(folder) == [0, 2, 1]
    assert "3 flights of seeds 0 to 2 by code" in page.read_text(encoding="utf-8")


@pytest.mark.parametrize("option", ["seeds", "faults", "worlds"])
def test_an_empty_option_is_not_the_usual_one(fly: Fly, option: str, tmp_path: Path) -> None:
    with pytest.raises((InvalidOptionError, UnknownNameError)):
        fly(LANDS, **{option: ""})
    assert not (tmp_path / "flights").exists()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"cluster": "here"},
            r"`here` is no address of a Dask scheduler\. Write tcp://HOST:PORT, or tls://HOST:PORT\.",
        ),
        ({"cluster": "tls://127.0.0.1:1"}, r"tls://127\.0\.0\.1:1 needs certificates\. Name them in Dask's config"),
        ({"cluster": "tcp://127.0.0.1:1", "jobs": 2}, r"follows from the workers of a cluster\. Leave out --jobs\."),
    ],
)
def test_a_cluster_that_cannot_be_used_is_a_bad_option(
    fly: Fly, options: dict[str, Any], message: str, tmp_path: Path
) -> None:
    with pytest.raises(InvalidOptionError, match=message):
        fly(LANDS, **{"jobs": 0, **options})
    assert not (tmp_path / "flights").exists()


def test_a_cluster_without_its_scheduler_is_a_bad_option(
    fly: Fly, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(cluster, "CONNECT_TIMEOUT", 0.1)
    with socket() as taken:
        taken.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{taken.getsockname()[1]}"
        for answers in (False, True):
            if answers:
                taken.listen()  # the kernel accepts the connection, and nobody speaks
            with pytest.raises(InvalidOptionError, match=rf"No Dask scheduler answers at {address}\. Start one"):
                fly(LANDS, jobs=0, cluster=address)
    assert not (tmp_path / "flights").exists()


def test_a_missing_extra_is_named(fly: Fly, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, cluster.__name__)
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(
        InvalidOptionError, match=r"distributed is not installed\. .*pip install 'skillwing\[cluster\]'"
    ):
        fly(LANDS, jobs=0, cluster="tcp://127.0.0.1:1")


def test_a_page_that_cannot_be_written_is_a_bad_option(fly: Fly, tmp_path: Path) -> None:
    with pytest.raises(InvalidOptionError, match="There is no folder for"):
        fly(LANDS, seeds="0", write=tmp_path / "nowhere" / "page.md")
    assert not (tmp_path / "flights").exists()


def test_the_summary_for_programs_tells_what_was_lost(fly: Fly, capsys: pytest.CaptureFixture[str]) -> None:
    assert fly(KILLED, seeds="0:2", as_json=True) == 1
    summary = json.loads(capsys.readouterr().out)
    assert (summary["planned"], summary["flown"], summary["sampled"]) == (2, 1, None)
    assert [each["flight"] for each in summary["lost"]] == ["mapping-courtyard-none-1"]


def test_a_flight_by_code_that_changed_meanwhile_is_not_kept(fly: Fly, tmp_path: Path, package: Path) -> None:
    edits = PLAN + f"if plan['seed'] == 1: open({str(package / FLIES)!r}, 'w').close()\nprint(json.dumps(result))"
    with pytest.raises(CodeChangedError, match=rf"while it flew: {FLIES}\. Running flights are not kept"):
        fly(edits, seeds="0:3", write=tmp_path / "page.md")
    assert seeds_in(tmp_path / "flights") == [0]
    assert not (tmp_path / "page.md").exists()
    with pytest.raises(InvalidOptionError, match="Start in another folder"):
        fly(LANDS, seeds="0:3", resume=True)


def test_half_a_recording_is_not_gone_on_with(fly: Fly, tmp_path: Path) -> None:
    folder = tmp_path / "flights"
    dies = RECORDS + "if plan['seed'] == 1: os.kill(os.getpid(), 9)\nprint(json.dumps(result))"
    assert fly(dies, seeds="0:2", record=True) == 1
    assert (folder / f"mapping-courtyard-none-1{UNFINISHED}" / "flight.jsonl").exists()
    assert fly(RECORDS + "print(json.dumps(result))", seeds="0:2", record=True, resume=True) == 0
    recorded = sorted(path.name for path in folder.iterdir() if path.is_dir())
    assert recorded == ["mapping-courtyard-none-0", "mapping-courtyard-none-1"]


def test_the_worst_flights_are_recorded_unless_they_are_already(fly: Fly, tmp_path: Path) -> None:
    folder = tmp_path / "flights"
    half = folder / f"mapping-courtyard-none-0{UNFINISHED}"
    half.mkdir(parents=True)
    (half / "flight.jsonl").touch()
    assert fly(RECORDS + "print(json.dumps(result))", seeds="0:2", worst=2) == 0
    recorded = sorted(path.name for path in folder.iterdir() if path.is_dir())
    assert recorded == ["mapping-courtyard-none-0", "mapping-courtyard-none-1"]
    assert fly("raise SystemExit('nothing is to be flown')", seeds="0:2", worst=2, resume=True) == 0


def test_a_recorded_flight_that_differs_is_reported(
    fly: Fly, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    changes = PLAN + "result['digest'] += 'again' * (len(sys.argv) > 2)\nprint(json.dumps(result))"
    assert fly(changes, seeds="0:2", worst=1) == 1
    assert "not the same flight again; it landed at home" in capsys.readouterr().out
    assert fly(LANDS, seeds="5", output=tmp_path / "other", worst=1) == 0


def test_a_recording_whose_process_was_lost_is_no_flight_that_differs(
    fly: Fly, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    dies = PLAN + "if len(sys.argv) > 2: os.kill(os.getpid(), 9)\nprint(json.dumps(result))"
    page = tmp_path / "page.md"
    assert fly(dies, seeds="0", worst=1, as_json=True, write=page) == 1
    summary = json.loads(capsys.readouterr().out)
    lost = {"flight": "mapping-courtyard-none-0", "why": "Its process was killed by signal 9."}
    assert (summary["flown"], summary["lost"], summary["differing"], summary["unrecorded"]) == (1, [], [], [lost])
    assert page.exists()


def test_a_sample_fails_if_a_flight_ends_otherwise(
    fly: Fly, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert fly(LANDS, seeds="0:4") == 0
    sample = {"sample_of": tmp_path / "flights", "sample": 2, "as_json": True}
    capsys.readouterr()
    for source, code, alike in ((LANDS, 0, 2), (ENDS_OTHERWISE, 1, 0), (KILLED, 1, 1)):
        assert fly(source, output=tmp_path / f"again-{code}-{alike}", **sample) == code
        summary = json.loads(capsys.readouterr().out)
        assert (summary["sampled"], summary["alike"]) == (1 if source is KILLED else 2, alike)
