from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import msgspec
import pytest

from skillwing import m600
from skillwing.dsl import load, parse
from skillwing.dsl.generating.package import generate, outdated, write

CASES = Path(__file__).parent / "cases" / "valid"
M600 = Path(m600.__path__[0])


def test_the_generated_code_of_the_m600_is_up_to_date() -> None:
    modules = generate(load(M600 / "m600.skillset"), "m600.skillset")
    assert outdated(modules, M600 / "generated") == ()


def test_generation_is_deterministic_and_compiles() -> None:
    skillset = load(CASES / "everything.skillset")
    modules = generate(skillset, "everything.skillset")
    assert modules == generate(load(CASES / "everything.skillset"), "everything.skillset")
    for name, text in modules.items():
        compile(text, name, "exec")
    assert skillset.schema_hash in modules["__init__.py"]


@pytest.fixture
def everything_types(tmp_path: Path) -> ModuleType:
    """The generated types of the case file, imported from where they were written."""
    write(generate(load(CASES / "everything.skillset"), "everything.skillset"), tmp_path)
    spec = importlib.util.spec_from_file_location("everything_types", tmp_path / "types.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["everything_types"] = module
    spec.loader.exec_module(module)
    return module


def test_generated_types_carry_defaults_and_refuse_wrong_types(everything_types: ModuleType) -> None:
    inputs = msgspec.convert({"path": {"points": [], "corners": []}}, everything_types.MoveInputs)
    assert (inputs.height, inputs.count, inputs.mode, inputs.slow) == (5.0, 3, "FAST", False)
    assert inputs.path.mode is everything_types.Mode.SLOW
    for wrong in ({"path": {"points": [], "corners": []}, "count": "3"}, {"path": {}}, {"path": {}, "hight": 3}):
        with pytest.raises(msgspec.ValidationError):
            msgspec.convert(wrong, everything_types.MoveInputs)


def test_a_changed_skillset_makes_the_code_outdated(tmp_path: Path) -> None:
    source = "skillset s { skill k { input { x: bool }  result { DONE } } }"
    write(generate(parse(source), "s.skillset"), tmp_path)
    assert outdated(generate(parse(source), "s.skillset"), tmp_path) == ()
    changed = generate(parse(source.replace("bool", "int8")), "s.skillset")
    assert {path.name for path in outdated(changed, tmp_path)} == {"__init__.py", "types.py", "interface.py"}


def test_an_input_named_like_an_option_hides_it() -> None:
    source = "skillset s { skill k { input { cause: string }  result { DONE } } }"
    text = generate(parse(source), "s.skillset")["interface.py"]
    assert "cause: str," in text
    assert "cause=cause" not in text
    assert "goal_id=goal_id" in text
