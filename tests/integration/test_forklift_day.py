"""The day of a robot that is no drone: skillset, mocks, an own manager, missions, a crash, a report.

From an empty folder, by the commands of the pages. No output has a word of a drone.
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from command_line import run_command

from drone_words import DRONE_WORDS
from skillwing.services.processes.process_state import ProcessState
from skillwing.services.processes.run_state import read_run_state

pytestmark = pytest.mark.slow

EXAMPLE = Path(__file__).parents[2] / "examples" / "forklift"
SKILLWING = Path(sys.executable).with_name("skillwing")
PATIENCE = 60.0
POLL = 0.02
OWN_MODULES = ("forklift", "first", "fetch")
"""Modules of the folder of the test."""
HONK = """
from skillwing.services.managers.hooks import Goal

from ..generated.managers import AbstractHonkManager
from ..generated.types import HonkInputs


class HonkManager(AbstractHonkManager):
    def on_dispatch(self, goal: Goal[HonkInputs]) -> None:
        self.bus.after(goal.inputs.duration, lambda: self.terminated_DONE(goal.id))
"""
SHUTTLE_XML = """<root BTCPP_format="4" main_tree_to_execute="shuttle">
  <BehaviorTree ID="shuttle">
    <Pausable name="shuttle">
      <ResourceIs name="may wait?" resource="emergency_stop" states="RELEASED"/>
      <AlwaysSuccess/>
      <Repeat name="rounds" num_cycles="100">
        <Sequence name="round">
          <MayStart skill="drive" wait="5"/><drive target="{rack}"/><drive target="0,0,0"/>
        </Sequence>
      </Repeat>
    </Pausable>
  </BehaviorTree>
  <TreeNodesModel>
    <SubTree ID="shuttle"><input_port name="rack" type="Pose" default="5,2,0"/></SubTree>
  </TreeNodesModel>
</root>
"""
FETCH_PY = """
from forklift.generated.types import Pose
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.mission.mission import Mission, MissionOptions, MissionTrees
from skillwing.bt_missions.subtrees.composites import in_order


class Options(MissionOptions):
    rack: Pose = Pose(x=5.0, y=2.0, heading=0.0)


class Fetch(Mission):
    name = "fetch"
    summary = "Fetch a pallet from a rack."
    Options = Options

    def build(self, context, options):
        return MissionTrees(
            in_order(
                "fetch",
                SkillAction("go", context, "drive", {"target": options.rack}),
                SkillAction("pick", context, "pick"),
                SkillAction("back", context, "drive", {"target": Pose(x=0.0, y=0.0, heading=0.0)}),
                SkillAction("place", context, "place"),
                SkillAction("honk", context, "honk", {"duration": 0.2}),
            )
        )


MISSION = Fetch()
"""


class Day:
    """Commands in a folder of their own. `said` is all that they have printed."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.said: list[str] = []

    def skillwing(self, *words: str, codes: tuple[int, ...] = (0,)) -> str:
        """Output of `skillwing WORDS...`, which has to end with one of these codes. It runs in the test's process."""
        done = run_command(*words)
        self.said += [" ".join(words), done.out, done.error]
        assert done.code in codes, (words, done)
        return done.out + done.error

    def alone(self, *words: str) -> str:
        """The same by the installed command: an interpreter without modules of the tests finds the files."""
        command = [SKILLWING, *words]
        done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
        self.said += [" ".join(words), done.stdout, done.stderr]
        assert done.returncode == 0, (words, done)
        return done.stdout + done.stderr

    def quietly(self, *words: str) -> str:
        """Standard output of a command whose words do not count."""
        return run_command(*words).out

    @property
    def processes(self) -> dict[str, ProcessState]:
        """The processes of the running system, once all have started; empty without one."""
        state = read_run_state("forklift")
        return {each.name: each for each in state.processes} if state is not None else {}

    @contextmanager
    def running(self, *words: str) -> Iterator[subprocess.Popen[str]]:
        """A command beside the others; interrupted at the end, if it still runs."""
        process = subprocess.Popen(
            [SKILLWING, *words], cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        try:
            yield process
        finally:
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
            output, _ = process.communicate(timeout=PATIENCE)
            self.said += [" ".join(words), output]

    def until(self, condition: Callable[[], bool]) -> None:
        deadline = time.monotonic() + PATIENCE
        while not condition():
            assert time.monotonic() < deadline, "\n".join(self.said[-6:])
            time.sleep(POLL)

    def mission_is(self, phase: str) -> bool:
        return phase in self.skillwing("mission", "watch")


@pytest.fixture
def forgotten_modules(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Modules that commands import from the folder of the test are unknown to other tests."""
    monkeypatch.setenv("PYTHONPATH", os.environ.get("PYTHONPATH", ""))  # commands add their folder
    path, modules = list(sys.path), set(sys.modules)
    yield
    sys.path[:] = path
    for name in set(sys.modules) - modules:
        if name.partition(".")[0] in OWN_MODULES:
            del sys.modules[name]


@pytest.fixture
def day(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, forgotten_modules: None) -> Day:
    del forgotten_modules
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rt").mkdir(mode=0o700)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "rt"))
    monkeypatch.setenv("COLUMNS", "160")
    monkeypatch.delenv("SKILLWING_CONNECT", raising=False)
    monkeypatch.delenv("SKILLWING_ROBOT", raising=False)
    (tmp_path / "forklift").mkdir()
    for file in EXAMPLE.iterdir():
        shutil.copy(file, tmp_path / "forklift")
    return Day(tmp_path)


@contextmanager
def system(day: Day, *words: str) -> Iterator[None]:
    with day.running("up", "--robot", "./forklift", *words):
        day.until(lambda: bool(day.processes))
        yield


@pytest.mark.timeout(360)
def test_a_day_of_a_forklift_has_no_word_of_a_drone(day: Day) -> None:
    day.skillwing("check", "forklift/forklift.skillset")
    day.skillwing("generate", "forklift/forklift.skillset", "-o", "forklift")
    (day.folder / "forklift" / "skills" / "honk.py").write_text(HONK)
    day.skillwing("mission", "new", "first.xml", "--robot", "./forklift")
    day.skillwing("mission", "new", "first.py", "--robot", "./forklift")
    (day.folder / "shuttle.xml").write_text(SHUTTLE_XML)
    (day.folder / "fetch.py").write_text(FETCH_PY)
    assert "fits forklift" in day.alone("mission", "check", "fetch.py", "--robot", "./forklift")
    for mission in ("first.xml", "first.py", "shuttle.xml"):
        assert "fits forklift" in day.skillwing("mission", "check", mission, "--robot", "./forklift")
    assert "problems" in day.quietly("mission", "check", "mapping", "--robot", "./forklift"), "it is a drone's"

    with system(day, "--mock", "drive", "pick", "place", "charge"):
        day.skillwing("status")
        assert "DONE" in day.skillwing("start", "honk", "duration=0.1", "--follow"), "the own manager"
        assert "fits forklift" in day.skillwing("mission", "check", "shuttle.xml"), "the robot that runs is asked"
        assert "do not fit forklift" in day.quietly("mission", "list")
        assert "SUCCEEDED" in day.skillwing("mission", "run", "first.xml")
        assert "SUCCEEDED" in day.alone("mission", "run", "fetch.py")
        day.skillwing("mission", "run", "fetch.py", "rack=7,1", codes=(2,))

        with day.running("mission", "run", "shuttle.xml", "rack=6,2,0.5") as run:
            day.until(lambda: day.mission_is("drive"))
            day.skillwing("mission", "pause")
            day.until(lambda: day.mission_is("PAUSED"))
            assert "Mission shuttle: PAUSED  paused by the operator" in day.skillwing("status")
            day.skillwing("mission", "resume")
            day.until(lambda: day.mission_is("RUNNING"))
            day.skillwing("mission", "abort", "--reason", "lunch")
            assert run.wait(PATIENCE) == 1
        with day.running("mission", "run", "shuttle.xml") as run:
            day.until(lambda: day.mission_is("drive"))
            run.send_signal(signal.SIGINT)
            assert run.wait(PATIENCE) == 1

        day.skillwing("trigger", "emergency_stop", "PRESSED")
        assert "emergency_stop" in day.skillwing("start", "drive", "target=1,1,0", "--follow", codes=(4,))
        day.skillwing("trigger", "emergency_stop", "RELEASED")
        day.skillwing("script", "drive", "delay=600", "--always")
        pid = day.processes["skill/drive"].pid
        assert pid is not None
        day.skillwing("start", "drive", "target=1,1,0")
        os.kill(pid, signal.SIGKILL)
        day.until(lambda: "LOST" in day.skillwing("status", codes=(0, 1)))
        for command in (["top", "--once"], ["doctor"], ["resources"], ["data"]):
            day.skillwing(*command, codes=(0, 1))
        run_dir = max((day.folder / "runs").iterdir())
        day.skillwing("down")
    report = day.skillwing("report", str(run_dir))
    assert [report.count(result) for result in ("success", "aborted", "unfinished")] == [2, 2, 0], report
    day.skillwing("timeline", str(run_dir))
    day.skillwing("--help")
    words = [text for text in day.said if DRONE_WORDS.search(text) or "m600" in text]
    assert words == []
