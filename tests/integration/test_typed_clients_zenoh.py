"""A generated package as a running system: skeletons that refuse, mocks that answer, and both typed clients."""

from __future__ import annotations

import asyncio
import importlib
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from skillwing.dsl import load
from skillwing.dsl.generating.package import RobotFolder, generate, skillset_copy
from skillwing.dsl.generating.skeletons import skeletons
from skillwing.services.errors import NoSystemError, SkillwingError, TimedOutError
from skillwing.services.mocking.system import mock_processes, scripts_for
from skillwing.services.processes.launcher import Launcher
from skillwing.services.processes.run_state import announced
from skillwing.services.protocol import Ending
from skillwing.services.robot import Robot, find_robot

pytestmark = pytest.mark.slow

SOURCE = """
skillset winch {
    resource drum { initial FREE  FREE -> USED  USED -> FREE }
    skill pull {
        progress=0.1 { length: float64 [m] }
        input { length: float64 [m] in 0.0..9.0 = 1.0 }
        output { pulled: float64 [m] }
        effect { take: drum -> USED  release: drum -> FREE }
        precondition { free: resource=(drum == FREE)  success take }
        interrupt { apply=release timeout=2.0 }
        result { success DONE: apply=release  failure STUCK: apply=release }
    }
}
"""


ROOT = Path(__file__).parents[2]


def make(source: Path, folder: Path) -> Robot:
    """A freshly generated package, found by its folder."""
    robot, skillset = RobotFolder(folder), load(source)
    robot.write_once(skeletons(skillset, folder.name))
    copy = skillset_copy(skillset, source, folder, source.read_text("utf-8"))
    robot.write({**generate(skillset, source, folder, robot.managed(skillset)), **copy})
    return find_robot(str(folder))


@pytest.fixture(scope="module")
def place(runtime: Path) -> Iterator[Path]:
    """A folder for packages; the effects of their import are undone."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "path", list(sys.path))
        patch.setenv("PYTHONPATH", "")
        yield runtime
    for name in [name for name in sys.modules if name.split(".")[0] in ("winch", "rover")]:
        del sys.modules[name]


@pytest.fixture(scope="module")
def robot(place: Path) -> Robot:
    source = place / "winch.skillset"
    source.write_text(SOURCE, encoding="utf-8")
    return make(source, place / "winch")


@contextmanager
def running(robot: Robot, run_dir: Path, *, mock: bool, script: Path | None = None) -> Iterator[str]:
    """The system as processes, announced as `skillwing up` does; yields its endpoint."""
    with Launcher(robot.name, robot.skillset.stem, run_dir, clock="wall") as launcher:
        launcher.start_router()
        launcher.start(mock_processes(robot, scripts=scripts_for(robot.skillset, script)) if mock else robot.managers())
        with announced(robot, launcher.endpoint, run_dir, clock="wall", mock=mock):
            yield launcher.endpoint


def clients() -> tuple[Any, Any]:
    """The generated clients, untyped: the package exists only during the tests."""
    return importlib.import_module("winch.generated.interface"), importlib.import_module("winch.generated.aio")


def test_skeletons_start_and_refuse_and_a_short_script_gets_the_answer(robot: Robot, tmp_path: Path) -> None:
    script = """
from winch.generated.interface import connect

with connect() as winch:
    outcome = winch.pull(length=2.0).wait(timeout=20.0)
    print(outcome.ending, outcome.reason)
"""
    with running(robot, tmp_path / "run", mock=False):
        done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, cwd=tmp_path)
    assert done.stdout.strip() == "ERROR `pull` is not written yet: fill in skills/pull.py."


RUNS = """
[skill.pull]
runs = [{delay = 0.5}, {forever = true}, {delay = 0.5}, {forever = true}]
"""


def test_both_clients_of_a_mocked_system(robot: Robot, tmp_path: Path) -> None:
    interface, aio = clients()
    (script := tmp_path / "runs.toml").write_text(RUNS, encoding="utf-8")

    async def fly() -> None:
        async with aio.connect("winch", endpoint=endpoint) as winch:
            goal = winch.pull()
            assert len([feedback async for feedback in goal.feedback()]) >= 1
            assert (await goal).result == "DONE"
            with pytest.raises(TimeoutError):
                async with asyncio.timeout(0.05):
                    await winch.pull()
            assert winch.resources.drum.state == "FREE"
        with pytest.raises(SkillwingError, match="closed"):
            await winch.pull()

    with running(robot, tmp_path / "run", mock=True, script=script) as endpoint:
        with interface.connect() as winch:
            outcome = winch.pull(length=2.0).wait(timeout=20.0).require_success()
            assert isinstance(outcome.output.pulled, float)
            goal = winch.pull()
            winch.resources.drum.wait_for("USED", timeout=20.0)
            next(goal.feedback())  # the drum is taken before the run begins; a run that never began is still to come
            goal.interrupt()
            assert goal.wait(timeout=20.0).ending is Ending.INTERRUPTED
        asyncio.run(fly())


def test_a_client_finds_a_robot_of_another_name_by_its_skillset(robot: Robot, tmp_path: Path) -> None:
    interface, _ = clients()
    with (
        running(replace(robot, name="second"), tmp_path / "run", mock=True) as endpoint,
        pytest.MonkeyPatch.context() as elsewhere,
    ):
        elsewhere.setenv("XDG_RUNTIME_DIR", str(tmp_path))  # as on another machine
        with interface.connect(endpoint=endpoint) as winch:
            assert winch.pull(length=2.0).wait(timeout=20.0).require_success().result == "DONE"
        elsewhere.setenv("SKILLWING_CONNECT", endpoint)
        with interface.connect() as winch:
            assert winch.resources.drum.state == "FREE"


def test_where_nothing_runs_both_say_so(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("skillwing.services.client.joining.CONNECT_TIMEOUT", 0.2)
    interface, aio = clients()
    with pytest.raises(NoSystemError), interface.connect():
        pass
    with pytest.raises(NoSystemError, match="No router answers"), interface.connect(endpoint="tcp/127.0.0.1:1"):
        pass

    async def connect() -> None:
        async with aio.connect():
            pass

    with pytest.raises(NoSystemError):
        asyncio.run(connect())


def test_the_scripts_of_the_documentation(place: Path, tmp_path: Path) -> None:
    page = (ROOT / "docs" / "robots.md").read_text("utf-8")
    waiting, asynchronous = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    rover = make(ROOT / "examples" / "rover" / "rover.skillset", place / "rover")
    with running(rover, tmp_path / "run", mock=True):
        said = [
            subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, cwd=place).stdout
            for script in (waiting, asynchronous)
        ]
    assert re.fullmatch(r"(.* m to go\n)+drive_to ended S_ARRIVED: .* PARKED \d.*\n", said[0])
    assert said[1] == "too slow; the wheels are PARKED\nTrue\n"


# --- goals and the scripts that started them -------------------------------------------------------------------------


LEAVES_ITS_GOAL = """
import sys
from winch.generated.interface import connect

with connect(owns_goals={owns_goals}) as winch:
    winch.pull()
    winch.resources.drum.wait_for("USED", timeout=20.0)
    print("pulls", flush=True)
    sys.stdin.read()
"""


@pytest.fixture(scope="module")
def pulling(robot: Robot, place: Path) -> Iterator[None]:
    """A running system in which no goal ends by itself."""
    (script := place / "long.toml").write_text("[skill.pull]\nforever = true\n", encoding="utf-8")
    with running(robot, place / "pulling", mock=True, script=script):
        yield


@contextmanager
def goal_of_a_script(folder: Path, *, owned: bool, killed: bool) -> Iterator[None]:
    """A running goal of a script. On exit the script ends or is killed."""
    script, pipe = LEAVES_ITS_GOAL.format(owns_goals=owned), subprocess.PIPE
    with subprocess.Popen([sys.executable, "-c", script], stdin=pipe, stdout=pipe, cwd=folder) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"pulls\n"
        yield
        if killed:
            process.kill()


@pytest.mark.usefixtures("pulling")
@pytest.mark.parametrize("killed", [False, True], ids=["ends", "is killed"])
def test_a_goal_ends_with_the_script_that_started_it(place: Path, killed: bool) -> None:
    interface, _ = clients()
    with interface.connect() as onlooker:
        with goal_of_a_script(place, owned=True, killed=killed):
            onlooker.resources.drum.wait_for("USED", timeout=20.0)
        onlooker.resources.drum.wait_for("FREE", timeout=20.0)


@pytest.mark.usefixtures("pulling")
def test_a_system_with_another_skillset_is_refused(robot: Robot) -> None:
    interface, _ = clients()
    source = robot.skillset.read_text(encoding="utf-8")
    robot.skillset.write_text(SOURCE.replace("0.0..9.0", "0.0..8.0"), encoding="utf-8")
    try:
        with pytest.raises(SkillwingError, match="another skillset"), interface.connect():
            pass
    finally:
        robot.skillset.write_text(source, encoding="utf-8")


@pytest.mark.usefixtures("pulling")
def test_a_script_may_leave_its_goals_to_themselves(place: Path) -> None:
    """The last test of this system: its goal runs on."""
    interface, _ = clients()
    with interface.connect() as onlooker:
        with goal_of_a_script(place, owned=False, killed=True):
            onlooker.resources.drum.wait_for("USED", timeout=20.0)
        with pytest.raises(TimedOutError):
            onlooker.resources.drum.wait_for("FREE", timeout=3.0)
