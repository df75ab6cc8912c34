"""A client that was written from docs/protocol.md alone starts skills of real processes and follows them."""

from __future__ import annotations

import ast
import json
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from skillwing.services.protocol import DirectMock, Keys, encode
from skillwing.services.testing import SkillsetProcesses

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
CLIENT = ROOT / "examples" / "plain_client" / "client.py"
ROVER = ROOT / "examples" / "rover" / "rover.skillset"
TARGET = {"target": {"x": 1.0, "y": 2.0, "heading": 0.0}}
DATA = {"battery": 80.0, "tilt": 0.0, "sun_current": 2.0}
WITHIN = 30.0


@pytest.fixture(scope="module")
def rover(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SkillsetProcesses]:
    with SkillsetProcesses(ROVER, run_dir=tmp_path_factory.mktemp("rover"), data=DATA) as system:
        yield system


def start(rover: SkillsetProcesses, skill: str, inputs: dict[str, Any], schema: str) -> subprocess.Popen[str]:
    words = [rover.launcher.endpoint, "rover", "rover", schema, skill, json.dumps(inputs)]
    return subprocess.Popen(
        [sys.executable, str(CLIENT), *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def finish(rover: SkillsetProcesses, client: subprocess.Popen[str]) -> tuple[int, list[dict[str, Any]], str]:
    """Exit code, news and complaints of a client, while the test's process goes on publishing the rover's data."""
    rover.run_until(lambda: client.poll() is not None, WITHIN, "the client to end")
    out, err = client.communicate()
    return client.returncode, [json.loads(line) for line in out.splitlines()], err


def direct(rover: SkillsetProcesses, skill: str, **run: Any) -> None:
    """Say how the next goal of a mocked skill goes."""
    answers: list[object] = []
    rover.bus.ask(Keys("rover").mocked_skill(skill), encode(DirectMock(run=run)), answers.append)
    rover.run_until(lambda: bool(answers))


def test_it_knows_nothing_of_skillwing() -> None:
    imported = {
        name.split(".")[0]
        for node in ast.walk(ast.parse(CLIENT.read_text(encoding="utf-8")))
        for name in (
            [alias.name for alias in node.names]
            if isinstance(node, ast.Import)
            else [node.module or ""]
            if isinstance(node, ast.ImportFrom)
            else []
        )
    }
    assert imported - set(sys.stdlib_module_names) == {"zenoh", "msgspec"}


def test_it_follows_a_goal_to_its_end(rover: SkillsetProcesses) -> None:
    direct(rover, "drive_to", delay=1.2, output={"stopped_at": TARGET["target"]}, progress={"distance": 3.5})
    client = start(rover, "drive_to", TARGET, rover.skillset.schema_hash)
    code, news, _ = finish(rover, client)
    assert code == 0
    told = ["ended" if each.get("terminal") else each["state"] for each in news if "state" in each]
    assert told[-1] == "ended"
    assert told.index("DRIVING") < told.index("RUNNING"), "causes come before effects"
    assert "PARKED" in told, "what the goal had taken is free before its end is printed"
    assert news[-1]["terminal"]["output"] == {"stopped_at": TARGET["target"]}
    assert {"distance": 3.5} in [each["feedback"] for each in news if "feedback" in each]
    assert len({each["goal_id"] for each in news if "goal_id" in each}) == 1


def test_it_interrupts_its_goal(rover: SkillsetProcesses) -> None:
    direct(rover, "drive_to", forever=True)
    client = start(rover, "drive_to", TARGET, rover.skillset.schema_hash)
    rover.assert_states(wheels="DRIVING", within=WITHIN)
    client.send_signal(signal.SIGINT)
    code, news, _ = finish(rover, client)
    assert (code, news[-1]["terminal"]["ending"], news[-1]["terminal"]["forced"]) == (1, "IT", False)
    rover.assert_states(wheels="PARKED")


def test_a_goal_whose_manager_is_started_again_is_lost(rover: SkillsetProcesses) -> None:
    direct(rover, "drive_to", forever=True)
    client = start(rover, "drive_to", TARGET, rover.skillset.schema_hash)
    rover.assert_states(wheels="DRIVING", within=WITHIN)
    rover.kill("skill/drive_to")
    questions: list[str] = []
    absent = rover.bus.serve(Keys("rover").goal("drive_to"), lambda request: questions.append(request.key))
    rover.run_until(lambda: bool(questions), WITHIN, "a question that nobody answers")
    absent.cancel()
    rover.restart("skill/drive_to")
    code, news, complaint = finish(rover, client)
    assert (code, complaint) == (1, "")
    assert (news[-1]["terminal"]["ending"], "knows of no goal" in news[-1]["terminal"]["reason"]) == ("LOST", True)


def test_a_goal_that_may_not_start_says_why(rover: SkillsetProcesses) -> None:
    rover.set_states(emergency_stop="PRESSED")
    code, news, _ = finish(rover, start(rover, "drive_to", TARGET, rover.skillset.schema_hash))
    rover.set_states(emergency_stop="RELEASED")
    assert (code, news[-1]["terminal"]["ending"], news[-1]["terminal"]["failing"]) == (1, "NR", ["released"])


def test_another_skillset_is_refused(rover: SkillsetProcesses) -> None:
    code, news, complaint = finish(rover, start(rover, "drive_to", TARGET, "0123456789abcdef"))
    assert (code, [each for each in news if "goal_id" in each]) == (2, [])
    assert "Start both from the same .skillset file" in complaint
