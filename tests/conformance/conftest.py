"""Each conformance case runs on every stage."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from conformance_stages import InProcessStage, ProcessStage
from conformance_system import Stage, System

FOLDER = Path(__file__).parent
LAYOUT = "CONFORMANCE_LAYOUT"
"""Environment variable: how the processes of the third stage are laid out, see `ProcessStage`."""
STAGES = ("hooks", "mocks", pytest.param("processes", marks=pytest.mark.slow))
RUNNING: list[ProcessStage] = []
"""The system of the third stage, while it runs."""


@pytest.fixture
def processes(tmp_path_factory: pytest.TempPathFactory) -> ProcessStage:
    """The stage of processes: one system for all cases that follow each other."""
    if not RUNNING:
        RUNNING.append(ProcessStage(tmp_path_factory.mktemp("workbench"), os.environ.get(LAYOUT, "own")))
    return RUNNING[0]


@pytest.hookimpl(trylast=True)
def pytest_runtest_teardown(nextitem: pytest.Item | None) -> None:
    """End the system after the last case: its processes would take time from all later tests of the session."""
    if nextitem is None or FOLDER not in nextitem.path.parents:
        end_system()


def pytest_sessionfinish() -> None:
    """End the system also when the session is interrupted."""
    end_system()


def end_system() -> None:
    while RUNNING:
        RUNNING.pop().close()


@pytest.fixture(params=STAGES)
def system(request: pytest.FixtureRequest) -> Iterator[System]:
    """The workbench, with nothing running and every resource in its initial state, and so again afterwards."""
    stage: Stage
    if request.param == "processes":
        stage = request.getfixturevalue("processes")
    else:
        stage = InProcessStage(mocked=request.param == "mocks")
    system = System(stage)
    yield system
    system.leave()
