"""Conditions for exit code 0 of `skillwing status`."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import Any, cast

import pytest
import typer
from typer.testing import CliRunner

from skillwing.dsl import load
from skillwing.m600.robot import SKILLSET
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.client.connection import Target
from skillwing.services.commands import status
from skillwing.services.commands.status import SystemOverview
from skillwing.services.names import MISSION
from skillwing.services.processes.proc_files import Usage
from skillwing.services.processes.process_monitor import ProcessStatus
from skillwing.services.processes.process_state import ProcessCondition, ProcessState
from skillwing.services.protocol import Keys, MissionPhase, MissionStatus, ResourceStates, encode
from skillwing.services.terminal.connection import System
from skillwing.services.terminal.output import DOES_NOT_ANSWER

USED = Usage(cpu=1.0, memory=1, uptime=100.0, stopped=False)
RUNS = ProcessStatus(ProcessState(name="skill/goto", pid=7), ProcessCondition.RUNS, USED)
WHOLE = SystemOverview(
    target=Target("m600", "tcp/127.0.0.1:7447", Path("m600.skillset"), "robot"),
    processes=[RUNS],
    goals=[],
    silent=[],
    unmanaged=[],
    # What a hook has done once is told, and over.
    blocked={"goto": "`on_dispatch` blocks."},
    states=ResourceStates(step=1, t=1.0, states={}),
    unattended=None,
)


def test_a_system_is_whole_while_its_processes_run_and_answer() -> None:
    assert WHOLE.is_whole
    assert WHOLE.troubles == {"goto": "`on_dispatch` blocks."}


@pytest.mark.parametrize(
    "seen",
    [
        *(
            replace(WHOLE, processes=[RUNS, replace(RUNS, condition=each)])
            for each in ProcessCondition
            if each != "runs"
        ),
        replace(WHOLE, silent=["goto"]),
        replace(WHOLE, states=None),
    ],
)
def test_one_that_does_not_makes_it_less(seen: SystemOverview) -> None:
    assert not seen.is_whole


def test_a_manager_that_does_not_answer_now_counts_more_than_what_it_did() -> None:
    assert replace(WHOLE, silent=["goto"]).troubles == {"goto": DOES_NOT_ANSWER}


def test_a_paused_mission_is_shown_with_its_reason(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The command runs against a mission and a resource manager on a bus without a network."""
    network, names = InProcessNetwork(), count()
    bus = network.bus("mission")
    bus.declare_alive(Keys("m600").alive(MISSION))
    out = bus.advertise(Keys("m600").mission_status, events=True)
    for phase, text in ((MissionPhase.RUNNING, "goto"), (MissionPhase.PAUSED, "a person on the field")):
        out.put(encode(MissionStatus(mission="rounds", phase=phase, t=2.0, text=text)))
    network.run_for(1.0)

    @contextmanager
    def connected(*_: object, **__: object) -> Iterator[System]:
        yield System(WHOLE.target, cast("Any", network.bus(f"cli-{next(names)}")), load(SKILLSET))

    monkeypatch.setattr(status, "connect", connected)
    app = typer.Typer()
    app.command()(status.status)
    facts = json.loads(CliRunner().invoke(app, ["--json"]).stdout)
    assert facts["mission"] == {"mission": "rounds", "phase": "PAUSED", "text": "a person on the field", "t": 2.0}
    assert "Mission rounds: PAUSED  a person on the field" in CliRunner().invoke(app, []).output
