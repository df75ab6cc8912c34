from __future__ import annotations

from pathlib import Path

import pytest

from skillwing.dsl import UnknownNameError, load, parse
from skillwing.dsl.model import ArrayType, EnumType, ScalarType, Skillset, StructType

CASES = Path(__file__).parent / "cases" / "valid"


@pytest.fixture(scope="module")
def everything() -> Skillset:
    return load(CASES / "everything.skillset")


def test_listing_3_means_what_the_paper_says() -> None:
    takeoff = load(CASES / "paper.skillset").skill("takeoff")
    assert takeoff.progress_period == 0.5
    assert [field.name for field in takeoff.inputs] == ["height", "speed"]
    assert takeoff.transitions("take_control") == (("axes_authority", "USED"),)
    assert takeoff.transitions("reset") == ()
    assert takeoff.preconditions.success == "take_control"
    assert [(item.name, item.violation) for item in takeoff.invariants] == [
        ("keep_sdk_authority", "reset"),
        ("in_control", "reset"),
    ]
    assert [(result.name, result.success) for result in takeoff.results] == [
        ("AT_ALTITUDE", True),
        ("BLOCKED", False),
        ("ABORTED", False),
    ]
    # Not in the listing: all results agree, so an interruption and a loss apply the same.
    assert (takeoff.interrupt.apply, takeoff.interrupt.timeout, takeoff.lost) == (
        "release_control",
        5.0,
        "release_control",
    )
    assert takeoff.dispatch_timeout == 1.0


def test_types_and_fields(everything: Skillset) -> None:
    path = everything.type("Path")
    point = everything.type("Point")
    assert isinstance(path, StructType)
    assert path.field("points").type == ArrayType(point, None)
    assert path.field("corners").type == ArrayType(point, 4)
    assert path.field("mode").default == "SLOW"
    assert everything.type("Mode") == EnumType("Mode", ("FAST", "SLOW"))
    height = everything.skill("move").input("height")
    assert (height.type, height.unit, height.low, height.high, height.default) == (
        ScalarType("float64"),
        "m",
        -1.5,
        100,
        5,
    )
    assert isinstance(height.default, float)
    assert everything.datum("position").stale_after == pytest.approx(0.3)
    assert everything.datum("wind").stale_after is None


def test_transitions_belong_to_skills_or_to_the_functional_layer(everything: Skillset) -> None:
    axes, sensor, source = (everything.resource(name) for name in ("axes", "sensor", "source"))
    assert axes.allows("FREE", "USED", extern=False)
    assert not axes.allows("FREE", "USED", extern=True)
    assert sensor.allows("UNKNOWN", "FAILED", extern=True)
    assert not sensor.allows("OK", "UNKNOWN", extern=True)
    assert axes.allows("USED", "USED", extern=False)
    assert not axes.allows("LOST", "LOST", extern=False)
    assert source.states == ("NONE", "A", "B")
    assert source.allows("NONE", "A", extern=False)
    assert source.allows("NONE", "B", extern=False)


def test_results_partition(everything: Skillset) -> None:
    assert [result.success for result in everything.skill("move").results] == [True, False, False]
    assert everything.skill("look").results == ()
    assert everything.skill("move").interrupt.timeout == 2.0


def test_unknown_names_say_what_exists(everything: Skillset) -> None:
    with pytest.raises(UnknownNameError) as caught:
        everything.skill("mvoe")
    assert (caught.value.kind, caught.value.name) == ("skill", "mvoe")
    assert caught.value.known == ("move", "look", "wait")
    assert "did you mean `move`?" in str(caught.value)
    assert "`move`, `look` and `wait`" in str(caught.value)


SMALL = """
skillset s {
    data { battery: float64 period=1.0 }
    resource r { initial A  extern A -> B  extern B -> A }
    skill k { precondition { p: resource=(r == A) }  result { DONE } }
    skill l { precondition { p: data=(battery > 3) }  result { DONE } }
}
"""


def test_the_schema_hash_ignores_layout_comments_and_order() -> None:
    lines = SMALL.strip().split("\n")
    shuffled = "\n".join([lines[0], "// a comment", *reversed(lines[1:-1]), lines[-1]]).replace("==", " ==\n  ")
    assert parse(shuffled).schema_hash == parse(SMALL).schema_hash
    assert len(parse(SMALL).schema_hash) == 16
    explicit = SMALL.replace("result { DONE }", "result { DONE }  interrupt { timeout=5 }  dispatch_timeout=1.0")
    assert parse(explicit).schema_hash == parse(SMALL).schema_hash


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("r == A", "r != A"),
        ("> 3", "> 4"),
        ("period=1.0", "period=0.5"),
        ("extern B -> A", "B -> A"),
        ("initial A", "initial B"),
        ("DONE", "OVER"),
        ("skillset s", "skillset t"),
        ("float64", "float64 [%]"),
        ("result { DONE }", "result { DONE }  deadline=3"),
    ],
)
def test_the_schema_hash_notices_a_change_of_meaning(old: str, new: str) -> None:
    assert parse(SMALL.replace(old, new)).schema_hash != parse(SMALL).schema_hash


def test_a_range_of_a_datum_is_part_of_the_meaning_and_no_range_is_none() -> None:
    source = "skillset s {{ data {{ level: float64{} period=1.0 }} }}"
    plain, ranged = (parse(source.format(bounds)) for bounds in ("", " in 0.0..1.0"))
    assert plain.schema_hash == "d2db4733f461d4f6" != ranged.schema_hash
    assert (ranged.datum("level").low, ranged.datum("level").high) == (0.0, 1.0)


def test_the_schema_hash_sees_into_types() -> None:
    source = "skillset s {{ enum M {{ A {more} }}  skill k {{ input {{ m: M }}  result {{ DONE }} }} }}"
    assert parse(source.format(more="B")).schema_hash != parse(source.format(more="C")).schema_hash


@pytest.mark.parametrize(
    ("datum", "given"),
    [("arm: float64", ""), ("battery: float64", "input { arm: float64 = 1.0 }")],
    ids=["datum", "input"],
)
def test_a_guard_on_what_is_called_like_a_resource_is_kept(datum: str, given: str) -> None:
    skillset = parse(
        f"""
        skillset s {{
            data {{ {datum} period=0.1 }}
            resource arm {{ initial FREE  FREE -> USED  USED -> FREE }}
            skill reach {{
                {given}
                effect {{ take: arm -> USED  release: arm -> FREE }}
                precondition {{ low: data=(arm < 3.0)  success take }}
                invariant {{ still_low: data=(3.0 > arm) violation=release }}
                interrupt {{ apply=release }}
                result {{ DONE: apply=release post data=(arm == 1.0) }}
            }}
        }}
        """,
        "s.skillset",
    )
    skill = skillset.skill("reach")
    assert [each.name for each in skill.preconditions.checks] == ["low"]
    assert [each.name for each in skill.invariants] == ["still_low"]
    assert skill.result("DONE").post is not None
