"""Checked skillsets from the launcher: a process neither parses nor checks the same text again."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from skillwing.dsl import load
from skillwing.services.processes.checked_skillsets import MOST_BYTES, pack_skillsets, read_skillsets

LAMP = "skillset lamp { resource light { initial OFF OFF -> ON } }\n"
READER = """
import sys
from skillwing.dsl import load
from skillwing.services.processes.checked_skillsets import read_skillsets
read_skillsets(sys.stdin.fileno(), int(sys.argv[1]))
print(load(sys.argv[2]).schema_hash, "skillwing.dsl.checking" in sys.modules)
"""


def read(packed: bytes, size: int, file: Path) -> list[str]:
    """Words of a new process: hash of the skillset that it reads, and whether it needed the checker."""
    words = [sys.executable, "-c", READER, str(size), str(file)]
    return subprocess.run(words, input=packed, capture_output=True, check=True).stdout.decode().split()


@pytest.fixture
def lamp(tmp_path: Path) -> Path:
    file = tmp_path / "lamp.skillset"
    file.write_text(LAMP, encoding="utf-8")
    return file


def test_a_process_uses_what_its_launcher_has_checked(lamp: Path) -> None:
    packed = pack_skillsets([str(lamp), str(lamp)])
    assert read(packed, len(packed), lamp) == [load(lamp).schema_hash, "False"]


def test_a_file_that_has_changed_is_checked_again(lamp: Path) -> None:
    packed, before = pack_skillsets([str(lamp)]), load(lamp).schema_hash
    lamp.write_text(LAMP.replace("OFF -> ON", "OFF -> ON ON -> OFF"), encoding="utf-8")
    found, checked = read(packed, len(packed), lamp)
    assert found == load(lamp).schema_hash != before
    assert checked == "True"


def test_a_launcher_that_ends_too_early_leaves_its_process_to_check(lamp: Path) -> None:
    packed = pack_skillsets([str(lamp)])
    assert read(packed[:-1], len(packed), lamp) == [load(lamp).schema_hash, "True"]


def test_a_process_with_newer_code_than_its_launcher_checks_itself(lamp: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("skillwing.services.processes.checked_skillsets._CODE", b"1\n")
    packed = pack_skillsets([str(lamp)])
    assert read(packed, len(packed), lamp) == [load(lamp).schema_hash, "True"]


def test_files_with_errors_and_missing_ones_are_left_out(lamp: Path, tmp_path: Path) -> None:
    wrong = tmp_path / "wrong.skillset"
    wrong.write_text("skillset wrong { resource }\n", encoding="utf-8")
    assert pack_skillsets([]) == pack_skillsets([str(wrong), str(tmp_path / "none.skillset")]) == b""
    both = pack_skillsets([str(wrong), str(lamp)])
    assert read(both, len(both), lamp)[-1] == "False"


def test_what_an_rl_file_includes_may_change_so_it_is_checked_by_each_process(tmp_path: Path) -> None:
    file = tmp_path / "lamp.rl"
    file.write_text(
        "skillset lamp { resource light { state { OFF ON } initial OFF transition all } }\n", encoding="utf-8"
    )
    packed = pack_skillsets([str(file)])
    assert read(packed, len(packed), file)[-1] == "True"


def test_more_than_a_pipe_holds_is_not_handed_on(tmp_path: Path) -> None:
    """The launcher would wait for a process that may never read."""
    file = tmp_path / "long.skillset"
    states = [f"S{number}_{os.urandom(9).hex()}" for number in range(MOST_BYTES // 8)]
    file.write_text(f"skillset long {{ resource place {{ initial {states[0]} }} }} // {' '.join(states)}\n", "utf-8")
    assert load(file).resources[0].states == (states[0],)
    assert pack_skillsets([str(file)]) == b""


def test_nothing_is_read_where_nothing_was_announced() -> None:
    reading, writing = os.pipe()
    os.close(writing)
    read_skillsets(reading, 0)
    os.close(reading)
