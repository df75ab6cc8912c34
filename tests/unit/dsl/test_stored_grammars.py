"""Analysed grammars in files: a text is read without Lark, and a grammar that has changed is analysed again."""

from __future__ import annotations

import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from grammar_files import DIALECTS

from skillwing.dsl.reading import dialect as reading
from skillwing.dsl.reading.dialect import Dialect
from skillwing.dsl.reading.skillset.dialect import SKILLSET

SOURCE = "skillset arm { resource power { initial ON  ON -> OFF } }"
LOAD = f"""
import sys
from skillwing.dsl import parse
parse({SOURCE!r})
assert "lark" not in sys.modules
"""


@pytest.mark.parametrize("dialect", DIALECTS, ids=lambda dialect: dialect.grammar)
def test_what_is_stored_is_the_analysis_of_the_grammar(dialect: Dialect) -> None:
    assert dialect.stored.read_text(encoding="utf-8") == dialect.analysed_again(), "call `make generate`"


def test_a_skillset_is_read_without_lark() -> None:
    subprocess.run([sys.executable, "-c", LOAD], check=True)


@pytest.mark.parametrize("damage", ["", "{", '{"digest": ""}'])
def test_a_damaged_file_is_analysed_again(damage: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A merge leaves such files. `make generate` writes them again, and reads skillsets before."""
    shutil.copytree(reading.READING, tmp_path, dirs_exist_ok=True)
    monkeypatch.setattr(reading, "READING", tmp_path)
    damaged = replace(SKILLSET)
    damaged.stored.write_text(damage, encoding="utf-8")
    assert "INITIAL" in {each.kind for each in damaged.scanner.scan(reading.Source("initial", "x.skillset"))}


@pytest.mark.parametrize("is_stored", [True, False])
def test_a_grammar_that_has_changed_is_analysed_again(
    is_stored: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A keyword has another text. The file, if there is one, is of the grammar before."""
    stored = SKILLSET.stored.read_bytes()
    for file in (reading.READING / "lexical.lark", reading.READING / SKILLSET.grammar):
        copy = tmp_path / file.relative_to(reading.READING)
        copy.parent.mkdir(exist_ok=True)
        copy.write_text(file.read_text(encoding="utf-8").replace('"initial"', '"at_first"'), encoding="utf-8")
    monkeypatch.setattr(reading, "READING", tmp_path)
    changed = replace(SKILLSET)
    if is_stored:
        changed.stored.write_bytes(stored)
    assert "INITIAL" in {each.kind for each in changed.scanner.scan(reading.Source("at_first", "x.skillset"))}
