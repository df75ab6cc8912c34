"""Words of a drone stand where a drone is meant: other robots use the rest of the system, too."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
FOR_EVERY_ROBOT = ("services/skillwing/services", "bt_missions/skillwing/bt_missions")
OF_A_DRONE = ("bt_missions/skillwing/bt_missions/drone", "bt_missions/skillwing/bt_missions/missions")
"""Folders whose subject is a drone."""
WORDS = re.compile(
    r"\b(drones?|take-?off|taking off|takes off|land|lands|landed|landing|flights?|fly|flies|flying|flown|flew|airborne"
    r"|buildings?|terrain|in the air)\b",
    re.IGNORECASE,
)


def files() -> Iterator[Path]:
    for folder in FOR_EVERY_ROBOT:
        for file in (ROOT / folder).rglob("*"):
            own = any(file.is_relative_to(ROOT / each) for each in OF_A_DRONE)
            if file.suffix in (".py", ".xml", ".txt", ".toml", ".json") and not own:
                yield file


def test_words_of_a_drone_stand_in_its_folders_alone() -> None:
    found = [
        f"{file.relative_to(ROOT)}:{number}: {line.strip()}"
        for file in files()
        for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), 1)
        if WORDS.search(line)
    ]
    assert not found, "Use words for every robot, or move it to a folder of the drone:\n" + "\n".join(found)


def test_the_folders_are_there_and_the_words_are_found_in_them() -> None:
    assert len(list(files())) > 200
    for folder in OF_A_DRONE:
        texts = [file.read_text(encoding="utf-8") for file in (ROOT / folder).rglob("*.py")]
        assert any(WORDS.search(text) for text in texts), folder
