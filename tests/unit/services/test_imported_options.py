"""Imports named by options, and errors that name the file to fix."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from skillwing.services.errors import InvalidOptionError
from skillwing.services.options import imported

Write = Callable[..., str]


@pytest.fixture
def write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Write:
    """Writes a module under a name that no other test has, and returns that."""
    monkeypatch.syspath_prepend(str(tmp_path))

    def written(name: str, *lines: str) -> str:
        (tmp_path / f"{name}.py").write_text("\n".join(lines) + "\n", encoding="utf-8")
        return name

    return written


def refusal(path: str) -> str:
    with pytest.raises(InvalidOptionError) as caught:
        imported({"hooks": path}, "hooks")
    assert caught.value.option == "hooks"
    return str(caught.value)


def test_what_is_named_is_imported(write: Write) -> None:
    assert imported({"hooks": f"{write('hooks_that_fit', 'Manager = 7')}:Manager"}, "hooks") == 7


def test_a_missing_module_is_distinguished_from_one_with_a_missing_import(write: Write, tmp_path: Path) -> None:
    lacking = write("hooks_that_lack", "import math", "import hooks_of_nobody")
    user = write("hooks_that_use_it", "", "", "import hooks_that_lack")
    assert "there is no module `hooks_at_all`. Correct its name" in refusal("hooks_at_all.skills:Manager")
    for path in (lacking, user):
        told = refusal(f"{path}:Manager")
        assert f"`{tmp_path / lacking}.py:2` imports `hooks_of_nobody`, and there is no such module. Install it" in told
        assert "Correct its name" not in told


def test_a_missing_imported_name_is_reported_with_its_line(write: Write, tmp_path: Path) -> None:
    told = refusal(f"{write('hooks_that_want', 'from math import tao')}:Manager")
    assert f"`{tmp_path}/hooks_that_want.py:1` imports from `math` what that does not have" in told
    assert "Fix the import." in told


@pytest.mark.parametrize(
    ("name", "line", "told"),
    [
        ("hooks_that_err", "math.nope", "raises AttributeError: module 'math' has no attribute 'nope'. Fix it."),
        ("hooks_that_call", "math.sqrt(-1)", "raises ValueError: math domain error. Fix it."),
        ("hooks_in_a_library", "json.loads('')", "raises JSONDecodeError: Expecting value: line 1 column 1 (char 0)."),
        ("hooks_in_silence", "assert not math", "raises AssertionError. Fix it."),
        ("hooks_that_end", "raise SystemExit(4)", "ends Python. Take that out."),
        ("hooks_in_no_python", "class Manager", "is no Python: expected ':'. Fix it."),
    ],
)
def test_a_module_that_fails_while_it_is_loaded_is_reported_with_the_line(
    write: Write, tmp_path: Path, name: str, line: str, told: str
) -> None:
    broken = write(name, "import json, math", "", line)
    user = write(f"{name}_behind_another", f"import {broken}")
    for path in (broken, user):
        assert f"its module cannot be loaded. `{tmp_path}/{broken}.py:3` {told}" in refusal(f"{path}:Manager")


def test_a_name_that_a_module_does_not_define_is_reported() -> None:
    assert "`math` has no `Manager`" in refusal("math:Manager")


@pytest.mark.parametrize("path", ["math", ":Manager", "math:", "my hooks:Manager", ".:x"])
def test_what_is_no_path_is_answered_with_its_form(path: str) -> None:
    assert "Write `package.module:attribute`." in refusal(path)
