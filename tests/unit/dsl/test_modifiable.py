"""Modifiable inputs in the language, in the model and in generated code."""

from __future__ import annotations

from skillwing.dsl import parse
from skillwing.dsl.printing.source import to_source

TEXT = """\
skillset rover {{
    data {{ battery: float64 [%] period=1.0 }}
    skill drive {{
        input {{ speed: float64 [m/s] in 0.1..2.0 = 0.5{speed}  far: bool = false{far} }}
        precondition {{ charged: data=(battery > 50.0{condition}) }}
        result {{ ARRIVED }}
    }}
}}
"""


def text(speed: str = "", far: str = "", condition: str = "") -> str:
    return TEXT.format(speed=speed, far=far, condition=condition)


def test_an_input_is_modifiable_if_the_file_says_so() -> None:
    skill = parse(text(speed=" modifiable")).skill("drive")
    assert [item.name for item in skill.modifiable] == ["speed"]
    assert not skill.input("far").modifiable


def test_the_word_changes_the_meaning_and_its_absence_nothing() -> None:
    plain, modifiable = parse(text()), parse(text(speed=" modifiable"))
    assert plain.schema_hash != modifiable.schema_hash
    assert "modifiable" not in to_source(plain)
    again = parse(to_source(modifiable))
    assert again.schema_hash == modifiable.schema_hash


def test_an_input_of_that_name_still_exists() -> None:
    skill = parse("skillset s { skill a { input { modifiable: bool modifiable } } }").skill("a")
    assert [item.name for item in skill.modifiable] == ["modifiable"]
