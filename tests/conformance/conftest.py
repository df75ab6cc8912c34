"""Each conformance case runs on every stage."""

from __future__ import annotations

import os
from collections.abc import Iterator

import pytest
from conformance_stages import InProcessStage, ProcessStage
from conformance_system import Stage, System

LAYOUT = "CONFORMANCE_LAYOUT"
"""Environment variable: how the processes of the third stage are laid out, see `ProcessStage`."""
STAGES = ("hooks", "mocks", pytest.param("processes", marks=pytest.mark.slow))


@pytest.fixture(scope="session")
def processes(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ProcessStage]:
    stage = ProcessStage(tmp_path_factory.mktemp("workbench"), os.environ.get(LAYOUT, "own"))
    yield stage
    stage.close()


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
