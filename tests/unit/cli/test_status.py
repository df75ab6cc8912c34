"""Conditions for exit code 0 of `skillwing status`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from skillwing.services.client.connection import Target
from skillwing.services.commands.status import SystemOverview
from skillwing.services.processes.proc_files import Usage
from skillwing.services.processes.process_monitor import ProcessStatus
from skillwing.services.processes.process_state import ProcessCondition, ProcessState
from skillwing.services.protocol import ResourceStates
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
