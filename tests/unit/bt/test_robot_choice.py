"""Robot that a command of missions is about."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from skillwing.bt_missions.cli.robot_choice import choose_robot
from skillwing.services.client.connection import find_target
from skillwing.services.errors import SeveralSystemsError
from skillwing.services.processes.run_state import RunState, started, write_run_state

SKILLSET = "skillset rover { skill go { result { success DONE } } }"


@pytest.fixture
def two_rovers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two systems that run here, by their run states."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.delenv("SKILLWING_CONNECT", raising=False)
    file = tmp_path / "rover.skillset"
    file.write_text(SKILLSET, encoding="utf-8")
    for name in ("first", "second"):
        write_run_state(
            RunState(
                robot=name,
                endpoint="tcp/127.0.0.1:1",
                skillset=str(file),
                clock="wall",
                pid=os.getpid(),
                pid_started=started(os.getpid()) or "",
                run_dir=str(tmp_path),
            )
        )


@pytest.mark.usefixtures("two_rovers")
def test_of_several_systems_one_has_to_be_chosen_in_the_words_of_every_command() -> None:
    with pytest.raises(SeveralSystemsError) as by_others:
        find_target()
    with pytest.raises(SeveralSystemsError) as by_missions:
        choose_robot(None)
    assert str(by_missions.value) == str(by_others.value)
    assert choose_robot("second").skillset.name == "rover"
