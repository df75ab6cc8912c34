"""Cached machine code is that of the constants as they are now, also of those that another file defines."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from numba import types

from skillwing.sim_mujoco import compiled

PACKAGE = ("skillwing", "sim_mujoco")
LOOPS = """\
from constants_elsewhere import REACH
from skillwing.sim_mujoco.compiled import compiled


@compiled
def reach():
    return REACH


@compiled
def far_away():
    return 2.0 * reach()
"""


def loaded(file: Path, reach: float, monkeypatch: pytest.MonkeyPatch) -> Any:
    """The file as a new process loads it, when another file says how far the reach is."""
    elsewhere = ModuleType("constants_elsewhere")
    elsewhere.REACH = reach  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, elsewhere.__name__, elsewhere)
    spec = importlib.util.spec_from_file_location("loops", file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_a_changed_constant_of_another_file_is_compiled_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "loops.py"
    file.write_text(LOOPS, encoding="utf-8")
    assert loaded(file, 1.0, monkeypatch).far_away() == 2.0
    changed = loaded(file, 3.0, monkeypatch)
    assert (changed.far_away(), changed.reach()) == (6.0, 3.0)
    again = loaded(file, 3.0, monkeypatch)
    assert (again.far_away(), sum(again.far_away.stats.cache_hits.values())) == (6.0, 1)


def with_loops() -> list[str]:
    """Names of all modules that have compiled functions."""
    folder = Path(compiled.__file__).parent
    files = [file for file in folder.rglob("*.py") if "\n@compiled\n" in file.read_text(encoding="utf-8")]
    return [".".join((*PACKAGE, *file.relative_to(folder).with_suffix("").parts)) for file in sorted(files)]


@pytest.mark.parametrize("name", with_loops())
def test_the_cache_knows_all_that_a_compiled_function_takes_from_elsewhere(name: str) -> None:
    module = importlib.import_module(name)
    found = [each for each in vars(module).values() if hasattr(each, "py_func") and each.__module__ == name]
    assert found
    for function in found:
        taken = {each: vars(module)[each] for each in function.py_func.__code__.co_names if each in vars(module)}
        for constant, value in taken.items():
            known = isinstance(value, compiled.Constant | ModuleType | types.ExternalFunction)
            assert known or value.__module__ == name, f"{function.__name__} takes {constant} from another file"
        assert function.__qualname__.endswith(compiled.constants_digest(vars(module))), "a constant stands below it"
