"""Files in ONERA's robot language: their diagnostics, and the models that they are read into."""

from __future__ import annotations

import importlib.util
from itertools import product
from pathlib import Path
from types import ModuleType

import msgspec
import pytest
import typer
from command_runner import CommandRunner
from hypothesis import given
from hypothesis import strategies as st

from skillwing.dsl import SkillsetError, load, parse
from skillwing.dsl.checking.checker import check
from skillwing.dsl.commands.check import check as check_command
from skillwing.dsl.commands.convert import convert as convert_command
from skillwing.dsl.commands.generate import generate as generate_command
from skillwing.dsl.editor.document import Document
from skillwing.dsl.editor.outline import outline
from skillwing.dsl.expressions import (
    And,
    Comparison,
    Environment,
    Implies,
    Name,
    NamedValue,
    Not,
    Or,
    evaluate,
    names_used,
    to_text,
)
from skillwing.dsl.model import Skillset
from skillwing.dsl.reading.rl.postconditions import without

CASES = Path(__file__).parent / "cases" / "rl"
FILES = sorted(CASES.glob("*/*.rl"))
EXAMPLES = Path(__file__).parents[3] / "examples" / "onera"


@pytest.mark.parametrize("path", FILES, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_file_gets_exactly_the_expected_diagnostics(path: Path) -> None:
    text = path.read_text()
    expected = text.split("\n", 1)[0].removeprefix("// expect:").split()
    checked = check(text, path.name)
    assert [diagnostic.code for diagnostic in checked.diagnostics] == expected
    assert (checked.skillset is not None) == (path.parent.name == "valid")


def test_an_invalid_name_outside_of_every_block_is_reported() -> None:
    checked = check("skillset\\empty {\n}\n", "x.rl")
    assert [each.code for each in checked.diagnostics][:2] == ["SW004", "SW005"]


@pytest.mark.parametrize("name", ["forklift.rl", "gimbal.rl"])
def test_the_examples_lack_nothing_but_the_contents_of_their_types(name: str) -> None:
    checked = check((EXAMPLES / name).read_text(), name)
    assert checked.skillset is not None
    assert {diagnostic.code for diagnostic in checked.diagnostics} == {"SW090"}


# --- the same model from both languages

GIMBAL = """
skillset gimbal {
    type Image {}
    data { angle: float64 period=0.25  last_picture: Image }

    resource motor {
        state { Off Still Turning }
        initial Off
        extern * -> Off
        * -> Still
        extern * -> Still
        * -> Turning
    }

    event power_on { guard resource=(motor == Off)  effect { motor -> Still } }
    event power_off { effect { motor -> Off } }

    skill turn {
        progress=1 { remaining: float64 }
        input { angle: float64 }
        effect { motor_to_Turning: motor -> Turning  motor_to_Still: motor -> Still }
        precondition { ready: resource=(motor == Still)  success motor_to_Turning }
        invariant { powered: resource=(motor == Turning) }
        interrupt { apply=motor_to_Still }
        result {
            success turned: apply=motor_to_Still
            failure jammed: apply=motor_to_Still
        }
    }
    skill take_picture {
        output { picture: Image }
        precondition { ready: resource=(not (motor == Off or motor == Turning)) }
        result { success taken  failure too_dark }
    }
}
"""


def test_a_file_means_the_same_in_both_languages() -> None:
    gimbal = load(EXAMPLES / "gimbal.rl")
    twin = parse(GIMBAL)
    assert _sorted_transitions(gimbal) == _sorted_transitions(twin)
    for part in ("types", "data", "events", "skills"):
        assert getattr(gimbal, part) == getattr(twin, part)


def _sorted_transitions(skillset: Skillset) -> dict[str, list[tuple[str, str, bool]]]:
    return {
        resource.name: sorted((edge.source, edge.target, edge.extern) for edge in resource.transitions)
        for resource in skillset.resources
    }


@given(st.integers(1, 10**6))
def test_periods_count_in_seconds_whatever_their_unit(amount: int) -> None:
    datum = "type Float skillset s {{ data x: Float period {} }}".format
    assert parse(datum(f"{amount} ms"), "s.rl").datum("x").period == amount / 1000
    assert parse(datum(f"{amount} sec"), "s.rl") == parse(datum(f"{amount}.0"), "s.rl") == parse(datum(amount), "s.rl")


@pytest.mark.parametrize(
    ("written", "meant"),
    [
        ("Float", "float64"),
        ("float32", "float32"),
        ("Double", "float64"),
        ("UInt8", "uint8"),
        ("Integer", "int64"),
        ("Boolean", "bool"),
        ("STRING", "string"),
    ],
)
def test_type_names_that_can_mean_one_thing_only_are_built_in_types(written: str, meant: str) -> None:
    skillset = parse(f"type {written} skillset s {{ data x: {written} }}", "s.rl")
    assert skillset.datum("x").type == parse(f"skillset s {{ data {{ x: {meant} }} }}").datum("x").type
    assert skillset.types == ()


# --- who takes a transition

LAMP = """
skillset s {
    resource lamp {
        state { Off On Broken }
        initial Off
        transition { Off -> On  On -> Off  On -> Broken  Broken -> Off }
    }
"""


@pytest.mark.parametrize(
    ("behaviour", "internal", "extern"),
    [
        ("", "", "Off-On On-Off On-Broken Broken-Off"),
        ("skill shine { success shone { effect lamp -> On } }", "Off-On", "On-Off On-Broken Broken-Off"),
        ("event burst { effect lamp -> Broken }", "", "Off-On On-Off On-Broken Broken-Off"),
        (
            "event off { effect lamp -> Off } skill dim { success dimmed { effect lamp -> Off } }",
            "On-Off Broken-Off",
            "Off-On On-Off On-Broken Broken-Off",
        ),
    ],
    ids=["nobody", "a skill", "an event", "both"],
)
def test_who_takes_a_transition(behaviour: str, internal: str, extern: str) -> None:
    checked = check(f"{LAMP} {behaviour} }}", "s.rl")
    assert checked.skillset is not None
    edges = checked.skillset.resource("lamp").transitions
    assert " ".join(f"{edge.source}-{edge.target}" for edge in edges if not edge.extern) == internal
    assert " ".join(f"{edge.source}-{edge.target}" for edge in edges if edge.extern) == extern


# --- skills


def everything() -> Skillset:
    return load(CASES / "valid" / "everything.rl")


def test_inline_effects_are_named_after_what_they_do_and_shared() -> None:
    effects = {effect.name: effect.transitions for effect in everything().skill("inspect").effects}
    assert effects == {
        "motion_to_Used_and_lamp_to_On": (("motion", "Used"), ("lamp", "On")),
        "motion_to_Free": (("motion", "Free"),),
        "motion_to_Free_and_lamp_to_Off": (("motion", "Free"), ("lamp", "Off")),
    }


def test_different_effects_never_share_a_name() -> None:
    text = """skillset s {
        resource a { state { B C B_and_c_to_D } initial B transition all }
        resource c { state { D E } initial E transition all }
        skill k {
            success both { effect { a -> B  c -> D } }
            failure one { effect a -> B_and_c_to_D }
            interrupt { interrupting false }
        }
    }"""
    skill = parse(text, "s.rl").skill("k")
    assert [effect.name for effect in skill.effects] == ["a_to_B_and_c_to_D", "a_to_B_and_c_to_D_", "nothing"]
    assert skill.transitions(skill.results[1].apply) == (("a", "B_and_c_to_D"),)
    assert (skill.interrupt.apply, skill.lost) == ("nothing", "nothing")


def test_results_and_postconditions() -> None:
    seen, unseen, lost = everything().skill("inspect").results
    assert (seen.success, unseen.success, lost.success) == (True, False, False)
    assert seen.apply == "motion_to_Free_and_lamp_to_Off"
    assert lost.apply is None
    assert unseen.post is not None
    assert to_text(unseen.post) == "lamp != Off and (weather == Dry or false)"


def test_implication_is_read_from_the_left() -> None:
    text = "skillset s { resource a { state { X Y } initial X transition all } skill k { precondition p: %s } }"
    [check] = parse(text % "a == X => a == Y => a == X", "s.rl").skill("k").preconditions.checks
    assert to_text(check.expression) == "(a == X => a == Y) => a == X"


def test_parameters_are_inputs_of_their_skill_and_data_of_the_skillset() -> None:
    skillset = everything()
    assert {field.name for field in skillset.skill("inspect").inputs} == {"place", "patience"}
    assert skillset.datum("fence").period is None


def test_without_an_interrupt_the_effect_of_all_results_is_the_interruptions() -> None:
    text = """skillset s {
        resource a { state { X Y } initial X transition all }
        skill k { start a -> Y success s { effect a -> X } failure f { effect a -> X } }
    }"""
    checked = check(text, "s.rl")
    assert checked.skillset is not None
    assert checked.skillset.skill("k").interrupt.apply == "a_to_X"
    assert "SW094" not in [diagnostic.code for diagnostic in checked.diagnostics]


@pytest.mark.parametrize("guard", ["not " * 5000 + "a == X", " and ".join(["a == X"] * 5000)], ids=["not", "and"])
def test_guards_as_deep_as_nobody_writes_are_refused_and_not_choked_on(guard: str) -> None:
    text = f"""skillset s {{
        resource a {{ state {{ X Y }} initial X transition all }}
        skill k {{ success s {{ effect a -> X postcondition {guard} }} }}
    }}"""
    assert [diagnostic.code for diagnostic in check(text, "s.rl").diagnostics] == ["SW029"]


# --- postconditions


POSTS = """skillset s {
    resource arm { state { Idle Busy Stuck } initial Idle transition all }
    resource lamp { state { Off On } initial Off transition all }
    skill k {
        precondition idle: arm == Idle
        start arm -> Busy
        interrupt { interrupting true effect arm -> Idle }
        success done { effect arm -> Idle postcondition %s }
    }
    skill l { success lit { effect lamp -> On } failure dark { effect lamp -> Off } interrupt { interrupting true } }
    skill m { success stuck { effect arm -> Stuck } }
}"""


@pytest.mark.parametrize(
    ("written", "read"),
    [
        ("arm == Busy", None),
        ("not (arm == Idle)", None),
        ("lamp == On", "lamp == On"),
        ("arm == Busy and lamp == On", "lamp == On"),
        ("arm == Busy or lamp == On", None),
        ("arm == Busy => lamp == On", None),
        ("lamp == On => arm == Busy", None),
        ("not (arm == Idle or lamp == Off)", "not lamp == Off"),
        ("(arm == Busy or lamp == On) and (lamp == Off => lamp == Off)", "lamp == Off => lamp == Off"),
        ("lamp == On and not (lamp == Off and arm == Idle)", "lamp == On"),
    ],
)
def test_a_postcondition_means_the_states_before_the_effect(written: str, read: str | None) -> None:
    checked = check(POSTS % written, "s.rl")
    assert checked.skillset is not None, checked.diagnostics
    post = checked.skillset.skill("k").results[0].post
    assert (None if post is None else to_text(post)) == read
    assert ("SW097" in [item.code for item in checked.diagnostics]) == ("arm" in written)


@given(st.data())
def test_what_is_left_of_a_postcondition_holds_before_the_effect_if_the_whole_does(data: st.DataObject) -> None:
    atoms = st.sampled_from(
        [Comparison("==", Name(name, "resource"), NamedValue(state)) for name in "abc" for state in "XY"]
    )
    expressions = st.recursive(
        atoms,
        lambda inner: (
            st.builds(Not, inner)
            | st.builds(And, inner, inner)
            | st.builds(Or, inner, inner)
            | st.builds(Implies, inner, inner)
        ),
        max_leaves=6,
    )
    whole = data.draw(expressions)
    changed = data.draw(st.sets(st.sampled_from("abc")))
    left = without(whole, changed)
    assert left is None or changed.isdisjoint(names_used(left))
    for states in product("XY", repeat=3):
        before = dict(zip("abc", states, strict=True))
        if evaluate(whole, Environment(before)):
            assert left is None or evaluate(left, Environment({**before, **dict.fromkeys(changed, "Y")}))


# --- included files


def files(folder: Path, **texts: str) -> Path:
    """Write files `NAME.rl` of these names, and return the first."""
    for name, text in texts.items():
        path = folder / f"{name.replace('__', '/')}.rl"
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
    return folder / f"{next(iter(texts))}.rl"


def found_in(path: Path) -> list[tuple[str, int, int]]:
    checked = check(path.read_text(), str(path))
    return [(item.code, item.span.line, item.span.column) for item in checked.diagnostics]


def test_types_of_included_files_are_read_relative_to_the_file_that_includes_them(tmp_path: Path) -> None:
    main = files(
        tmp_path,
        main='include "lib/all.rl"\nskillset s { data { x: Float  p: Pose } }',
        lib__all='include { "more.rl" "more.rl" }\ntype { Float Unused }',
        lib__more='include "../plain.rl"\ntype Pose',
        plain="type Float",
    )
    assert found_in(main) == [("SW090", 1, 9)]
    skillset = load(main)
    assert skillset.datum("x").type == parse("skillset s { data { x: float64 } }").datum("x").type
    assert [each.name for each in skillset.types] == ["Pose"]


def test_a_type_may_be_declared_in_an_included_file_as_well(tmp_path: Path) -> None:
    main = files(tmp_path, main='include "lib.rl"\ntype Float\nskillset s { data x: Float }', lib="type Float")
    assert found_in(main) == []


def test_a_library_of_types_is_a_file_of_its_own(tmp_path: Path) -> None:
    library = files(tmp_path, **{"my-types": "type { Float Pose }"})
    assert found_in(library) == []
    assert (load(library).name, [each.name for each in load(library).types]) == ("my_types", ["Pose"])
    entries = outline(Document(library.read_text(), str(library)))
    assert [(entry.kind, entry.name) for entry in entries] == [("type", "Pose")]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (None, "cannot be read: No such file or directory"),
        ("type {", "has an error at line 1: Missing `}`"),
        ("", "has an error at line 1: The file is empty"),
    ],
)
def test_a_file_that_cannot_be_included_is_one_error_at_its_name(text: str | None, reason: str, tmp_path: Path) -> None:
    main = files(tmp_path, main='type Float\ninclude "lib.rl"\nskillset s { data { x: Pose  y: Pose } }')
    if text is not None:
        files(tmp_path, lib=text)
    (error,) = check(main.read_text(), str(main)).diagnostics
    assert (error.code, error.span.line, error.span.column) == ("SW098", 2, 9)
    assert error.message.startswith(f"`{tmp_path / 'lib.rl'}` {reason}")


def test_a_file_behind_an_included_one_is_reported_at_the_include_that_leads_to_it(tmp_path: Path) -> None:
    main = files(tmp_path, main='include "lib.rl"\nskillset s { }', lib='include "gone.rl"\ntype Float')
    (error,) = check(main.read_text(), str(main)).diagnostics
    assert (error.code, error.span.line) == ("SW098", 1)
    assert "which `lib.rl` includes" in error.message


def test_an_unclosed_name_of_a_file_is_one_error() -> None:
    text = 'include "types.rl\nskillset s { data x: Pose }'
    assert [item.code for item in check(text, "s.rl").diagnostics if item.severity == "error"] == ["SW004"]


@pytest.mark.parametrize("name", ["a\0b", "\x1b[31m", "x" * 5000, "", "..", "/"])
def test_a_name_that_no_file_has_is_an_error(name: str, tmp_path: Path) -> None:
    (error,) = check(f'include "{name}"\nskillset s {{ }}', str(tmp_path / "main.rl")).diagnostics
    assert error.code == "SW098"
    assert error.message.isprintable()


def test_a_folder_and_a_device_are_no_files(tmp_path: Path) -> None:
    (tmp_path / "lib.rl").mkdir()
    main = files(tmp_path, main='include { "lib.rl" "/dev/zero" }\nskillset s { }')
    assert [code for code, *_ in found_in(main)] == ["SW098", "SW098"]


@pytest.mark.parametrize(
    ("texts", "ring"),
    [
        ({"main": 'include "main.rl" type Float'}, "main.rl -> main.rl"),
        ({"main": 'include "a.rl" type Float', "a": 'include "main.rl" type A'}, "main.rl -> a.rl -> main.rl"),
        ({"main": 'include "a.rl"', "a": 'include "b.rl"', "b": 'include "a.rl"'}, "a.rl -> b.rl -> a.rl"),
    ],
)
def test_files_that_include_each_other_are_reported(texts: dict[str, str], ring: str, tmp_path: Path) -> None:
    main = files(tmp_path, **texts)
    (error,) = check(main.read_text(), str(main)).diagnostics
    assert (error.code, error.span.line, error.span.column) == ("SW099", 1, 9)
    assert error.message == f"The files include each other: {ring}."


def test_a_generated_package_needs_no_included_file(app: typer.Typer, tmp_path: Path) -> None:
    main = files(
        tmp_path,
        main='// An arm.\ninclude "lib.rl"  // shared\ninclude { "lib.rl" "more.rl" }\ntype Pose\n'
        "skillset arm { data { p: Pose  f: Float  g: Grip } }",
        lib="type { Float Pose }",
        more="type Grip",
    )
    assert CommandRunner().invoke(app, ["generate", str(main), "-o", str(tmp_path / "robot")]).exit_code == 0
    copy = tmp_path / "robot" / "generated" / "arm.rl"
    head = "// An arm.\ntype { Float Grip }  // shared\n\ntype Pose\n"
    assert copy.read_text().partition("\n")[2].startswith(head)
    assert load(copy).schema_hash == load(main).schema_hash


def test_of_an_included_skillset_the_types_are_read(tmp_path: Path) -> None:
    main = files(
        tmp_path,
        main='include "arm.rl"\nskillset s { data x: Force }',
        arm="type Force skillset arm { type Inner data y: Inner }",
    )
    assert found_in(main) == [("SW090", 1, 9), ("SW100", 1, 9)]
    assert load(main).name == "s"


def test_a_changed_file_is_read_again(tmp_path: Path) -> None:
    main = files(tmp_path, main='include "lib.rl"\nskillset s { data x: Thing }', lib="type Thing")
    assert [each.name for each in load(main).types] == ["Thing"]
    files(tmp_path, lib="type Other")
    with pytest.raises(SkillsetError):
        load(main)


# --- the commands


@pytest.fixture
def app() -> typer.Typer:
    application = typer.Typer()
    application.command("check")(check_command)
    application.command("generate")(generate_command)
    application.command("convert")(convert_command)
    return application


def test_check_takes_rl_files(app: typer.Typer) -> None:
    output = CommandRunner().invoke(app, ["check", str(EXAMPLES / "gimbal.rl"), str(CASES / "invalid" / "unclosed.rl")])
    assert output.exit_code == 1
    assert "warning[SW090]" in output.output
    assert "Missing `}`" in output.output


def _imported(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location("forklift_types", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_generated_package_can_be_imported(app: typer.Typer, tmp_path: Path) -> None:
    package = tmp_path / "forklift"
    outcome = CommandRunner().invoke(app, ["generate", str(EXAMPLES / "forklift.rl"), "-o", str(package)])
    assert outcome.exit_code == 0, outcome.output
    for path in package.rglob("*.py"):
        compile(path.read_text(), str(path), "exec")
    [path] = package.rglob("types.py")
    types = _imported(path)
    inputs = types.DriveToInputs(target=types.Pose(), speed=1.0)
    assert msgspec.to_builtins(inputs) == {"target": {}, "speed": 1.0}


@pytest.mark.parametrize(
    "path", [EXAMPLES / "forklift.rl", CASES / "valid" / "everything.rl"], ids=lambda path: path.stem
)
def test_converted_files_mean_the_same(app: typer.Typer, path: Path, tmp_path: Path) -> None:
    target = tmp_path / "converted.skillset"
    outcome = CommandRunner().invoke(app, ["convert", str(path), "-o", str(target)])
    assert outcome.exit_code == 0, outcome.output
    assert load(target) == load(path)
    assert CommandRunner().invoke(app, ["convert", str(path)]).output == target.read_text()
    assert CommandRunner().invoke(app, ["convert", str(path), "-o", str(target)]).exit_code == 2


def test_broken_files_are_not_converted(app: typer.Typer, tmp_path: Path) -> None:
    target = tmp_path / "converted.skillset"
    outcome = CommandRunner().invoke(app, ["convert", str(CASES / "invalid" / "names.rl"), "-o", str(target)])
    assert outcome.exit_code == 1
    assert "error[SW013]" in outcome.output
    assert not target.exists()


def test_words_of_the_language_that_are_names_are_converted(app: typer.Typer) -> None:
    outcome = CommandRunner().invoke(app, ["convert", str(CASES / "valid" / "words_as_names.rl")])
    assert outcome.exit_code == 0
    assert "        extern all -> in\n        extern in -> None\n" in outcome.output


def test_a_name_that_the_skillset_language_cannot_tell_from_its_words_is_said(app: typer.Typer, tmp_path: Path) -> None:
    path = tmp_path / "initial.rl"
    path.write_text(
        """
        skillset s {
            resource door { state { initial Open } initial initial transition { initial -> Open } }
            skill open { start door -> Open success done {} interrupt { interrupting true } }
        }
        """
    )
    outcome = CommandRunner().invoke(app, ["convert", str(path)])
    assert outcome.exit_code == 2
    assert "as a name" in outcome.output
