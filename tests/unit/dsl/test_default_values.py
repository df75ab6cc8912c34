"""Values where nobody gave any: valid, and such that guards hold."""

from __future__ import annotations

from pathlib import Path

import pytest

from skillwing.dsl import load, parse
from skillwing.dsl.default_values import default_data, default_fields
from skillwing.dsl.expressions import Environment, evaluate, names_used
from skillwing.services.core.values import fit, fit_fields

ROOT = next(folder for folder in Path(__file__).parents if (folder / "pyproject.toml").exists())
FILES = sorted([*ROOT.glob("examples/*/*.skillset"), *ROOT.glob("services/skillwing/m600/*.skillset")])


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_defaults_are_valid_and_satisfy_the_guards(file: Path) -> None:
    skillset = load(file)
    data = default_data(skillset)
    for item in skillset.data:
        assert fit(data[item.name], item.type, item.name)[1] == []
    for skill in skillset.skills:
        for fields in (skill.inputs, skill.outputs, skill.feedback):
            assert fit_fields(fields, default_fields(fields))[1] == []
        predicates = (*skill.preconditions.checks, *skill.invariants)
        for guard in (each.expression for each in predicates if names_used(each.expression, "data")):
            assert evaluate(guard, Environment(data=data, inputs=default_fields(skill.inputs))), (skill.name, guard)


def test_thresholds_enums_flags_and_fields_are_met() -> None:
    skillset = parse("""
    skillset s {
        enum Mode { OFF ON }
        type Position { x: float64  z: float64 in 5.0..9.0 }
        data { mode: Mode  level: float64  count: uint8  ready: bool  position: Position  pair: float64[2] }
        skill go {
            precondition {
                on:    data=(mode == ON)
                above: data=(level > 1000.0 and level < 1200.0)
                few:   data=(count <= 3 and count >= 2)
                ready: data=(ready)
                high:  data=(position.z > 6.5)
            }
            result { success DONE }
        }
    }
    """)
    data = default_data(skillset)
    assert (data["mode"], data["ready"], data["pair"]) == ("ON", True, [0.0, 0.0])
    assert 1000.0 < data["level"] < 1200.0
    assert data["count"] in (2, 3)
    assert 6.5 < data["position"]["z"] <= 9.0


def test_data_of_a_mock_lie_in_their_ranges() -> None:
    text = "skillset s { data { pressure: float64 [bar] in 2.0..9.0  level: int8 in -5..-1 } }"
    assert default_data(parse(text, "s.skillset")) == {"pressure": 2.0, "level": -1}
