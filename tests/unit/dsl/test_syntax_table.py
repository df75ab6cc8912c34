"""Every form of every element of the language is read, and means what the reference says."""

from __future__ import annotations

import pytest

from skillwing.dsl import parse
from skillwing.dsl.checking.types import SCALARS
from skillwing.dsl.expressions import Environment, evaluate
from skillwing.dsl.model import ArrayType, EnumType, ScalarType, Skill, Skillset, StructType

HEAD = """
    enum Mode { FAST SLOW }
    type Point { x: float64 [m]  y: float64 [m] = 0.5 }
    data { height: float64 [m] period=0.1  mode: Mode  place: Point  ready: bool  label: string }
    resource arm { initial IDLE  IDLE -> BUSY  BUSY -> IDLE }
    resource hand { initial OPEN  OPEN -> SHUT  SHUT -> OPEN }
    skill move {
        effect { busy { arm -> BUSY  hand -> SHUT }  idle { arm -> IDLE  hand -> OPEN } }
        precondition { success busy }
        result { MOVED: apply=idle }
    }
"""


def skillset(body: str) -> Skillset:
    return parse(f"skillset s {{ {HEAD} {body} }}", "f.skillset")


def skill(body: str) -> Skill:
    return skillset(f"skill k {{ {body} }}").skill("k")


EFFECTS = "effect { take: arm -> BUSY  free: arm -> IDLE }"
TAKES = f"{EFFECTS} precondition {{ idle: resource=(arm == IDLE)  success take }}"


# --- types and data


@pytest.mark.parametrize("name", SCALARS)
def test_built_in_types(name: str) -> None:
    whole = skill(f"input {{ a: {name}  b: {name}[]  c: {name}[4] }} result {{ DONE }}")
    scalar = ScalarType(name)
    assert [field.type for field in whole.inputs] == [scalar, ArrayType(scalar, None), ArrayType(scalar, 4)]


def test_declared_types_units_ranges_and_defaults() -> None:
    whole = skill(
        "input { m: Mode = SLOW  v: float64 [m/s] in 0.1..3.0 = 1.0  n: int8 in -3..3  p: Point } result { D }"
    )
    mode, speed, number, point = whole.inputs
    assert isinstance(mode.type, EnumType) and mode.type.values == ("FAST", "SLOW") and mode.default == "SLOW"
    assert (speed.unit, speed.low, speed.high, speed.default) == ("m/s", 0.1, 3.0, 1.0)
    assert (number.low, number.high, number.default) == (-3, 3, None)
    assert isinstance(point.type, StructType) and point.type.field("y").default == 0.5


def test_a_datum_is_stale_after_three_periods() -> None:
    whole = skillset("")
    assert whole.datum("height").stale_after == pytest.approx(0.3)
    assert whole.datum("mode").stale_after is None


# --- resources and events


@pytest.mark.parametrize(
    ("body", "states", "internal", "extern"),
    [
        ("initial A  A -> B", "AB", {"AB"}, set[str]()),
        ("initial A  extern A -> B  B -> A", "AB", {"BA"}, {"AB"}),
        ("state { B A } initial A  A -> B", "BA", {"AB"}, set[str]()),
        ("state { A B C } initial A  A -> *", "ABC", {"AB", "AC"}, set[str]()),
        ("state { A B C } initial A  extern * -> A  extern A -> *", "ABC", set[str](), {"BA", "CA", "AB", "AC"}),
    ],
)
def test_resources(body: str, states: str, internal: set[str], extern: set[str]) -> None:
    source = (
        f"skillset s {{ resource r {{ {body} }} skill k {{ precondition {{ p: resource=(r == A) }} result {{ D }} }} }}"
    )
    resource = parse(source, "f").resource("r")
    assert ("".join(resource.states), resource.initial) == (states, "A")
    assert {edge.source + edge.target for edge in resource.transitions if not edge.extern} == internal
    assert {edge.source + edge.target for edge in resource.transitions if edge.extern} == extern


def test_an_event_has_a_guard_and_an_effect() -> None:
    door = "resource door { initial SHUT  extern SHUT -> AJAR  extern AJAR -> SHUT }"
    event = skillset(f"{door} event draught {{ guard resource=(arm == IDLE) effect {{ door -> AJAR }} }}").event(
        "draught"
    )
    assert event.guard is not None and evaluate(event.guard, Environment(resources={"arm": "IDLE"}))
    assert event.effect.transitions == (("door", "AJAR"),)


# --- effects


@pytest.mark.parametrize(
    ("effect", "transitions"),
    [
        ("e: arm -> BUSY", [("arm", "BUSY")]),
        ("e {}", []),
        ("e { arm -> BUSY }", [("arm", "BUSY")]),
        ("e { arm -> BUSY  hand -> SHUT }", [("arm", "BUSY"), ("hand", "SHUT")]),
    ],
)
def test_effects(effect: str, transitions: list[tuple[str, str]]) -> None:
    whole = skill(f"effect {{ {effect} }} result {{ DONE: apply=e }}")
    assert list(whole.transitions("e")) == transitions


def test_an_effect_may_name_the_state_that_the_resource_is_in() -> None:
    assert skillset("").resource("arm").allows("BUSY", "BUSY", extern=False)


# --- guards


@pytest.mark.parametrize(
    ("expression", "value"),
    [
        ("arm == IDLE", True),
        ("arm != IDLE", False),
        ("not arm == BUSY", True),
        ("arm == IDLE and hand == OPEN", False),
        ("arm == BUSY or hand == SHUT", True),
        ("arm == IDLE => hand == SHUT", True),
        ("hand == SHUT => arm == IDLE => hand == OPEN", False),
        ("(arm == IDLE or hand == OPEN) and not (arm == BUSY and hand == SHUT)", True),
        ("not arm == IDLE or hand == SHUT", True),
    ],
)
def test_guards_on_resources(expression: str, value: bool) -> None:
    check = skill(f"precondition {{ p: resource=({expression}) }} result {{ D }}").preconditions.checks[0]
    assert check.kind == "resource"
    assert evaluate(check.expression, Environment(resources={"arm": "IDLE", "hand": "SHUT"})) is value


@pytest.mark.parametrize(
    ("expression", "value"),
    [
        ("height < 2.0", False),
        ("height <= 2.0 and height >= 2.0", True),
        ("height > -1.5e0", True),
        ("height != speed", True),
        ("speed >= height + 0", None),
        ("3 < speed", True),
        ("place.x == 1.0", True),
        ("mode == FAST", True),
        ("ready", False),
        ("not ready and true", True),
        ('label == "a \\"b\\""', True),
    ],
)
def test_guards_on_data_and_inputs(expression: str, value: bool | None) -> None:
    body = f"input {{ speed: float64 }} precondition {{ p: data=({expression}) }} result {{ D }}"
    if value is None:
        with pytest.raises(Exception, match="SW004"):
            skill(body)
        return
    check = skill(body).preconditions.checks[0]
    data = {"height": 2.0, "mode": "FAST", "place": {"x": 1.0, "y": 0.0}, "ready": False, "label": 'a "b"'}
    assert check.kind == "data"
    assert evaluate(check.expression, Environment(data=data, inputs={"speed": 4.0})) is value


def test_a_predicate_over_absent_data_is_false_whatever_it_says() -> None:
    body = "invariant { low: data=(not height > 2.0) } result { D }"
    assert not evaluate(skill(body).invariant("low").expression, Environment())


def test_preconditions_have_effects_for_success_and_failure() -> None:
    whole = skill(f"{EFFECTS} precondition {{ success take  failure free }} interrupt {{ apply=free }} result {{ D }}")
    assert (whole.preconditions.success, whole.preconditions.failure) == ("take", "free")


def test_invariants_may_have_an_effect() -> None:
    whole = skill(
        f"{TAKES} invariant {{ a: resource=(arm == BUSY) violation=free  b: data=(ready) }} result {{ D: apply=free }}"
    )
    assert [(item.name, item.kind, item.violation) for item in whole.invariants] == [
        ("a", "resource", "free"),
        ("b", "data", None),
    ]


# --- ends


@pytest.mark.parametrize(
    ("results", "succeeds"),
    [
        ("A", [True]),
        ("A: apply=free  B: apply=free", [True, False]),
        ("failure A: apply=free  success B: apply=free  success C: apply=free", [False, True, True]),
    ],
)
def test_results(results: str, succeeds: list[bool]) -> None:
    whole = skill(f"{EFFECTS} result {{ {results} }} precondition {{ success take }} interrupt {{ apply=free }}")
    assert [result.success for result in whole.results] == succeeds


def test_a_result_may_have_a_postcondition() -> None:
    whole = skill(f"{TAKES} result {{ success D: apply=free post resource=(arm == IDLE)  failure F: apply=free }}")
    post = whole.result("D").post
    assert post is not None and evaluate(post, Environment(resources={"arm": "IDLE"}))
    assert whole.result("F").post is None


@pytest.mark.parametrize(
    ("ends", "interrupt", "timeout", "lost"),
    [
        ("result { A: apply=free  B: apply=free }", "free", 5.0, "free"),
        ("result { A: apply=free  B }  interrupt { apply=free timeout=2.0 }", "free", 2.0, "free"),
        ("result { A: apply=free }  interrupt { timeout=1 }  lost { apply=keep }", "free", 1.0, "keep"),
    ],
)
def test_interrupt_and_lost(ends: str, interrupt: str, timeout: float, lost: str) -> None:
    whole = skill(
        f"effect {{ take: arm -> BUSY  free: arm -> IDLE  keep {{}} }} precondition {{ success take }} {ends}"
    )
    assert (whole.interrupt.apply, whole.interrupt.timeout, whole.lost) == (interrupt, timeout, lost)


# --- what a skill carries, and its limits


def test_outputs_and_feedback() -> None:
    whole = skill("output { at: Point } progress=0.5 { left: float64 [m] } result { D }")
    assert [field.name for field in whole.outputs] == ["at"]
    assert (whole.progress_period, [field.unit for field in whole.feedback]) == (0.5, ["m"])
    assert skill("progress=2 result { D }").progress_period == 2.0


@pytest.mark.parametrize(
    ("written", "deadline", "dispatch_timeout", "owner_lost"),
    [
        ("", None, 1.0, "interrupt"),
        ("deadline=60.0", 60.0, 1.0, "interrupt"),
        ("dispatch_timeout=0.2 owner_lost=interrupt", None, 0.2, "interrupt"),
        ("owner_lost=continue deadline=3", 3.0, 1.0, "continue"),
    ],
)
def test_limits(written: str, deadline: float | None, dispatch_timeout: float, owner_lost: str) -> None:
    whole = skill(f"{written} result {{ D }}")
    assert (whole.deadline, whole.dispatch_timeout, whole.owner_lost) == (deadline, dispatch_timeout, owner_lost)


def test_comments_mean_nothing() -> None:
    plain = skillset("skill k { result { D } }")
    assert skillset("skill /* a { */ k { // }\n result { D } }").schema_hash == plain.schema_hash


def test_words_of_the_language_are_names_where_only_a_name_fits() -> None:
    resource = "resource initial { initial initial  extern initial -> state }"
    skills = "skill skill { precondition { post: resource=(initial == initial) } result { result } }"
    whole = parse(f"skillset skillset {{ {resource} {skills} }}", "f")
    assert whole.resource("initial").states == ("initial", "state")
    assert whole.skill("skill").result("result").success
