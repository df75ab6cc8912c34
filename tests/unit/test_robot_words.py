"""Words of a drone stand where a drone is meant: other robots use the rest of the system, too."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from drone_words import DRONE_WORDS

ROOT = Path(__file__).parents[2]
FOR_EVERY_ROBOT = ("services/skillwing/services", "bt_missions/skillwing/bt_missions", "dsl/skillwing/dsl")
OF_A_DRONE = ("bt_missions/skillwing/bt_missions/drone", "bt_missions/skillwing/bt_missions/missions")
"""Folders whose subject is a drone."""
KINDS = (".py", ".xml", ".txt", ".toml", ".json", ".template", ".lark")
WITHOUT_A_MEANING = ("without building", "Building blocks")
"""Phrases in which such a word has another meaning."""


def files() -> Iterator[Path]:
    for folder in FOR_EVERY_ROBOT:
        for file in (ROOT / folder).rglob("*"):
            own = any(file.is_relative_to(ROOT / each) for each in OF_A_DRONE)
            if file.suffix in KINDS and not own:
                yield file


def test_words_of_a_drone_stand_in_its_folders_alone() -> None:
    found = [
        f"{file.relative_to(ROOT)}:{number}: {line.strip()}"
        for file in files()
        for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), 1)
        if DRONE_WORDS.search(line) and not any(phrase in line for phrase in WITHOUT_A_MEANING)
    ]
    assert not found, "Use words for every robot, or move it to a folder of the drone:\n" + "\n".join(found)


def test_the_folders_are_there_and_the_words_are_found_in_them() -> None:
    assert len(list(files())) > 200
    for folder in OF_A_DRONE:
        texts = [file.read_text(encoding="utf-8") for file in (ROOT / folder).rglob("*.py")]
        assert any(DRONE_WORDS.search(text) for text in texts), folder
