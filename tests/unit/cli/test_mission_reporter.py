"""A mission that is flown with a running system leaves a report, also when it is cut short."""

from __future__ import annotations

import fcntl
import io
import subprocess
import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import redirect_stdout
from pathlib import Path
from types import SimpleNamespace

import pytest
from rich.console import Console

from skillwing.m600.robot import SKILLSET
from skillwing.services.bus import Handle
from skillwing.services.bus.inprocess import InProcessBus, InProcessNetwork
from skillwing.services.commands import report as report_command
from skillwing.services.history.files import GOALS_FILE, TIMELINE_FILE, JsonLines
from skillwing.services.history.history import History
from skillwing.services.history.report import REPORT_FILE, OperatorFacts, make_report, read_report
from skillwing.services.processes.process_state import ProcessState
from skillwing.services.protocol import GoalStatus, Keys, MissionPhase, MissionStatus, Record, RecordKind, State, encode
from skillwing.services.recording.run_facts import RUN_FILE, RunFacts, read_facts, write_facts
from skillwing.services.report.rendering import write_report
from skillwing.services.report.run_reports import _earlier_facts, write_reports
from skillwing.services.terminal import cli
from skillwing.services.terminal.exit_codes import OK, USAGE
from skillwing.services.terminal.mission_reporter import FULL, LAST_WORDS, LOOK_FOR_ROOM, MissionReporter

STATES = (ProcessState(name="router"), ProcessState(name="recorder", restarts=1, last_words="It was killed."))


class System:
    """A run directory, as a recorder fills it, and a bus on which a mission tells what it does."""

    def __init__(self, run_dir: Path) -> None:
        self.run_dir = run_dir
        write_facts(run_dir, RunFacts(robot="m600", skillset=str(SKILLSET)))
        self.network = InProcessNetwork()
        self.told: list[str] = []
        self.reports = MissionReporter(run_dir, "m600", lambda: STATES)
        self.bus = self.network.bus("supervisor")
        self.reports.attach(self.bus, lambda text, _style: self.told.append(text))
        self._mission = self.network.bus("mission")
        self._out = self._mission.advertise(Keys("m600").mission_status, events=True)
        self._number = 0

    def enter(self, before: str, after: str, *, recorded: bool = True) -> None:
        self._number += 1
        t = self.bus.now()
        record = Record(
            id=f"mission#{self._number}",
            t=t,
            source="mission",
            kind=RecordKind.MISSION,
            subject="patrol",
            before=before,
            after=after,
        )
        if recorded:
            with JsonLines[Record](self.run_dir / TIMELINE_FILE) as file:
                file.write(record)
        self._out.put(encode(MissionStatus(mission="patrol", phase=MissionPhase(after), t=t, text="")))

    def begin(self) -> Handle:
        """A mission takes off; cancelling what is returned kills its process."""
        token = self.alive()
        self.enter("IDLE", "RUNNING")
        return token

    def alive(self) -> Handle:
        return self._mission.declare_alive(Keys("m600").alive("mission"))

    def lose_router_and(self, token: Handle) -> None:
        """Take the router away for a while, and meanwhile the token of the mission."""
        assert isinstance(self.bus, InProcessBus)
        self.bus.given_up = True
        token.cancel()
        self.network.run_for(3 * LAST_WORDS)
        self.bus.given_up = False

    def results(self) -> dict[str, tuple[str, float, float | None]]:
        """Result, duration and wall time in the reports."""
        read = {folder.parent.name: read_report(folder.parent) for folder in self.run_dir.glob("*/report.json")}
        return {name: (each.result, each.sim_time_s, each.wall_time_s) for name, each in read.items()}

    def wait_for_report(self) -> None:
        for thread in threading.enumerate():
            if thread.name == "report":
                thread.join()
        self.network.run_for(0.1)

    def finish(self) -> str:
        console = Console(file=io.StringIO(), width=300)
        self.reports.finish(console)
        assert isinstance(console.file, io.StringIO)
        return console.file.getvalue()


class WriterInThisProcess:
    """Replacement of the process that writes a report: it takes a second to start, ten times as long as it writes."""

    returncode = OK

    def __init__(self, command: list[str], **_: object) -> None:
        words = command[command.index("report") :]
        self._run_dir, self._until = Path(words[1]), float(words[words.index("--until") + 1])

    def communicate(self, facts: bytes) -> tuple[bytes, bytes]:
        file = self._run_dir / "facts.json"
        file.write_bytes(facts)
        with redirect_stdout(io.StringIO()) as out:
            report_command.report(self._run_dir, facts=file, until=self._until, brief=True)
        return out.getvalue().encode(), b""


@pytest.fixture
def real_system(tmp_path: Path) -> System:
    """A system with reports by another process, as users have them."""
    return System(tmp_path / "run")


@pytest.fixture
def system(real_system: System, monkeypatch: pytest.MonkeyPatch) -> System:
    replaced = SimpleNamespace(Popen=WriterInThisProcess, PIPE=subprocess.PIPE)
    monkeypatch.setattr("skillwing.services.terminal.mission_reporter.subprocess", replaced)
    return real_system


def test_a_mission_that_is_over_is_reported_and_the_next_one_beside_it(real_system: System) -> None:
    system = real_system
    system.network.run_for(1.0)
    system.enter("IDLE", "RUNNING")
    system.network.run_for(20.0)
    system.enter("RUNNING", "SUCCEEDED")
    system.network.run_for(LAST_WORDS + 1.0)
    system.wait_for_report()
    assert system.told[0].startswith("Mission patrol: success. Its report is in ")
    report = read_report(system.run_dir / "1-patrol")
    assert (report.result, report.sim_time_s) == ("success", 20.0)
    assert report.wall_time_s == pytest.approx(20.0, abs=0.5)
    assert [(each.name, each.state) for each in report.processes] == [("router", "runs"), ("recorder", "runs")]
    assert "started again 1 time." in report.processes[1].detail
    assert (system.run_dir / "1-patrol" / "timeline.png").exists()

    system.enter("IDLE", "RUNNING")
    system.network.run_for(5.0)
    assert "Mission patrol: unfinished." in system.finish()
    assert read_report(system.run_dir / "2-patrol").result == "unfinished"
    assert read_report(system.run_dir / "1-patrol") == report


def test_one_that_is_followed_at_once_by_the_next_is_reported_all_the_same(system: System) -> None:
    system.network.run_for(1.0)
    first = system.begin()
    system.network.run_for(20.0)
    system.enter("RUNNING", "SUCCEEDED")
    first.cancel()
    system.network.run_for(LAST_WORDS / 2)
    system.begin()
    system.network.run_for(10.0)
    system.wait_for_report()
    (told,) = system.told
    assert "1-patrol" in told
    assert system.results() == {"1-patrol": ("success", 20.0, pytest.approx(20.0, abs=0.1))}
    system.enter("RUNNING", "FAILED")
    system.network.run_for(LAST_WORDS + 1.0)
    system.wait_for_report()
    assert system.results()["2-patrol"] == ("failure", 10.1, pytest.approx(10.1, abs=0.1))
    assert len(system.told) == 2


def test_a_last_word_that_comes_after_the_end_of_the_process_is_measured_all_the_same(system: System) -> None:
    system.network.run_for(1.0)
    ended = system.begin()
    system.network.run_for(20.0)
    ended.cancel()
    system.network.run_for(0.1)
    system.enter("RUNNING", "SUCCEEDED")
    system.network.run_for(LAST_WORDS + 1.0)
    system.wait_for_report()
    assert system.results() == {"1-patrol": ("success", 20.1, pytest.approx(20.1, abs=0.1))}
    assert len(system.told) == 1


def test_one_whose_process_is_killed_is_reported_as_unfinished(system: System) -> None:
    system.network.run_for(1.0)
    killed = system.begin()
    system.network.run_for(20.0)
    killed.cancel()
    system.network.run_for(LAST_WORDS + 1.0)
    system.wait_for_report()
    assert [each.split(".")[0] for each in system.told] == ["Mission patrol: unfinished"]
    assert list(system.results()) == ["1-patrol"]
    assert system.finish().count("Mission") == 0


def test_an_end_that_the_recorder_missed_is_reported_now_and_later(system: System) -> None:
    system.network.run_for(1.0)
    flown = system.begin()
    system.network.run_for(20.0)
    system.enter("RUNNING", "SUCCEEDED", recorded=False)
    flown.cancel()
    system.network.run_for(LAST_WORDS + 1.0)
    system.wait_for_report()
    assert system.results() == {"1-patrol": ("success", 20.0, pytest.approx(20.0, abs=0.1))}
    goal = GoalStatus(goal_id="by-hand", skill="takeoff", state=State.RUNNING, t=45.0)
    with JsonLines[GoalStatus](system.run_dir / GOALS_FILE) as file:
        file.write(goal)
    for _ in range(2):
        write_reports(system.run_dir, read_facts(system.run_dir), None, only_last=True)
        assert system.results() == {"1-patrol": ("success", 20.0, pytest.approx(20.0, abs=0.1))}
        assert read_report(system.run_dir / "1-patrol").skills == ()


def test_one_that_is_killed_just_before_the_next_is_given_up_is_reported_with_that(system: System) -> None:
    system.network.run_for(1.0)
    killed = system.begin()
    system.network.run_for(20.0)
    killed.cancel()
    system.network.run_for(LAST_WORDS / 2)
    system.enter("IDLE", "ABORTED")
    system.network.run_for(LAST_WORDS + 1.0)
    system.wait_for_report()
    assert {name: (result, wall) for name, (result, _, wall) in system.results().items()} == {
        "1-patrol": ("unfinished", None),
        "2-patrol": ("aborted", None),
    }


def test_a_mission_goes_on_while_the_router_is_away(system: System) -> None:
    system.network.run_for(1.0)
    token = system.begin()
    system.network.run_for(5.0)
    system.lose_router_and(token)
    system.network.run_for(LAST_WORDS / 2)
    token = system.alive()
    system.network.run_for(2.0)
    assert system.told == []
    system.enter("RUNNING", "SUCCEEDED")
    token.cancel()
    system.network.run_for(LAST_WORDS + 1.0)
    system.wait_for_report()
    assert system.results() == {"1-patrol": ("success", 24.5, pytest.approx(24.5, abs=0.1))}
    assert [each.split(".")[0] for each in system.told] == ["Mission patrol: success"]


def test_a_mission_that_is_gone_when_the_router_is_back_is_reported_as_unfinished(system: System) -> None:
    killed = system.begin()
    system.network.run_for(5.0)
    system.lose_router_and(killed)
    system.network.run_for(LAST_WORDS + 1.0)
    system.wait_for_report()
    assert [each.split(".")[0] for each in system.told] == ["Mission patrol: unfinished"]


def test_a_mission_that_was_away_for_long_and_is_back_has_no_wall_time(system: System) -> None:
    """The link of the mission broke, and not that of the robot. A wall time from its return on would be too short."""
    away = system.begin()
    system.network.run_for(5.0)
    away.cancel()
    system.network.run_for(LAST_WORDS + 1.0)
    system.wait_for_report()
    system.alive()
    system.enter("RUNNING", "PAUSED")
    system.network.run_for(2.0)
    system.enter("PAUSED", "SUCCEEDED")
    system.network.run_for(LAST_WORDS + 1.0)
    system.wait_for_report()
    assert system.results() == {"1-patrol": ("success", pytest.approx(13.0, abs=0.2), None)}


def test_a_report_that_is_written_at_the_same_time_keeps_the_facts(system: System) -> None:
    """The later writer waits for the earlier one, which alone has the facts, and takes them from its report."""
    system.begin()
    system.network.run_for(20.0)
    system.enter("RUNNING", "SUCCEEDED")
    facts = read_facts(system.run_dir)
    with (system.run_dir / RUN_FILE).open("rb") as file, ThreadPoolExecutor(1) as other:
        fcntl.flock(file, fcntl.LOCK_EX)
        written = other.submit(write_reports, system.run_dir, facts, None)
        with pytest.raises(TimeoutError):
            written.result(0.5)
        write_report(make_report(History(), mission="patrol", wall_time_s=20.0), History(), system.run_dir / "1-patrol")
        fcntl.flock(file, fcntl.LOCK_UN)
        ((_, report),) = written.result()
    assert report.wall_time_s == 20.0


def test_where_no_mission_was_flown_nothing_is_written(system: System) -> None:
    assert system.finish() == ""
    assert [path.name for path in system.run_dir.iterdir()] == ["run.json"]


@pytest.mark.parametrize(
    ("content", "sentence"),
    [(None, "holds no `run.json`"), (b"{", "cannot be read"), (b'{"robot":"r","skillset":"%s"}', "No mission ran")],
)
def test_a_run_that_cannot_be_reported_gets_a_sentence(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    content: bytes | None,
    sentence: str,
) -> None:
    if content is not None:
        (tmp_path / "run.json").write_bytes(content.replace(b"%s", str(SKILLSET).encode()))
    monkeypatch.setattr("sys.argv", ["skillwing", "report", str(tmp_path)])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code == USAGE
    assert sentence in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--no-record", "--viewer", "web"], "Leave out `--no-record`."),
        ([], "holds the recording of a run"),
    ],
)
def test_what_cannot_be_shown_or_recorded_starts_nothing(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: list[str],
    sentence: str,
) -> None:
    (tmp_path / TIMELINE_FILE).touch()
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setattr("sys.argv", ["skillwing", "up", "--mock", "--run-dir", str(tmp_path), *words])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code == USAGE
    assert sentence in capsys.readouterr().err


def test_a_report_that_does_not_fit_on_the_disk_is_written_when_there_is_room(
    real_system: System, monkeypatch: pytest.MonkeyPatch
) -> None:
    system = real_system
    room = [False]
    monkeypatch.setattr("skillwing.services.terminal.mission_reporter.has_room", lambda folder: room[0])
    folder = system.run_dir / "1-patrol"
    folder.write_text("in the way")
    system.enter("IDLE", "RUNNING")
    system.network.run_for(5.0)
    system.enter("RUNNING", "SUCCEEDED")
    system.network.run_for(LAST_WORDS + 1.0)
    system.wait_for_report()
    assert system.told[-1].startswith("There is no report of the mission.")
    system.network.run_for(3 * LOOK_FOR_ROOM)
    assert len(system.told) == 1
    folder.unlink()
    room[0] = True
    system.network.run_for(2 * LOOK_FOR_ROOM)
    system.wait_for_report()
    assert system.told[-1].startswith("Mission patrol: success.")
    assert system.results() == {"1-patrol": ("success", 5.0, pytest.approx(5.0, abs=0.5))}


def test_a_report_is_tried_again_where_the_disk_has_some_room_but_not_enough(
    real_system: System, monkeypatch: pytest.MonkeyPatch
) -> None:
    system = real_system
    write, full = MissionReporter._write, [True, True]

    def written(reporter: MissionReporter, facts: bytes, until: float) -> str:
        text = write(reporter, facts, until)
        reporter._failed = bool(full)
        return f"There is no report of the mission. {full.pop() and FULL}" if full else text

    monkeypatch.setattr(MissionReporter, "_write", written)
    system.enter("IDLE", "RUNNING")
    system.network.run_for(5.0)
    system.enter("RUNNING", "SUCCEEDED")
    system.network.run_for(LAST_WORDS + 1.0)
    system.wait_for_report()
    for _ in range(2):
        system.network.run_for(LOOK_FOR_ROOM + 1.0)
        system.wait_for_report()
    assert [text.partition(".")[0] for text in system.told] == [
        "There is no report of the mission",
        "Mission patrol: success",
    ]


@pytest.mark.parametrize("content", [b"", b'{"mission": 5}'], ids=["emptied by a power cut", "of another version"])
def test_a_report_that_cannot_be_read_does_not_prevent_the_next_one(tmp_path: Path, content: bytes) -> None:
    (tmp_path / REPORT_FILE).write_bytes(content)
    assert _earlier_facts(tmp_path, 0.0) == OperatorFacts()
