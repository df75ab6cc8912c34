"""All mistakes of a file are told in one run, each at its place, and nothing that merely follows from them."""

from __future__ import annotations

import random
import re
from functools import cache
from pathlib import Path

import pytest
from skillset_mistakes import Mistake, independent, mistakes, with_mistakes

from skillwing.dsl.checking.checker import check
from skillwing.dsl.diagnostics.diagnostic import Diagnostic

HERE = Path(__file__).parent
ROOT = HERE.parents[2]
M600 = ROOT / "services" / "skillwing" / "m600" / "m600.skillset"
FILES = [
    path
    for path in (*sorted(HERE.glob("cases/valid/*.skillset")), *sorted(ROOT.glob("examples/*/*.skillset")), M600)
    if not re.search(r"dispatch_timeout|lost \{", path.read_text(encoding="utf-8"))  # those are put in
    # Without one of its guards, an effect of the yard meets the extern transition to the same state: a second error.
    and path.stem != "yard"
]


@cache
def known(path: Path) -> list[Mistake]:
    return mistakes(path.read_text(encoding="utf-8"), path.name)


def errors(text: str, path: Path) -> list[Diagnostic]:
    return [item for item in check(text, path.name).diagnostics if item.severity == "error"]


def test_mistakes_of_many_kinds_are_made() -> None:
    assert len({mistake.kind for path in FILES for mistake in known(path)}) >= 15


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_one_mistake_is_one_error_at_its_place(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    chance = random.Random(path.name)
    for mistake in chance.sample(known(path), min(len(known(path)), 15)):
        broken, expected = with_mistakes(text, [mistake])
        found = errors(broken, path)
        assert [(item.code, item.span.line, item.span.column) for item in found] == expected, mistake


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_several_mistakes_are_as_many_errors_each_at_its_place(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    chance = random.Random(path.stem)
    for _ in range(6):
        made = independent(text, known(path), chance, chance.randint(2, 8))
        broken, expected = with_mistakes(text, made)
        found = errors(broken, path)
        assert [(item.code, item.span.line, item.span.column) for item in found] == expected, made


def test_a_section_in_a_wrong_place_hides_nothing() -> None:
    text = """skillset gripper {
    data { battery: float64 [%] period=1.0 }
    resource arm { initial IDLE  IDLE -> BUSY  BUSY -> IDLE }
    initial IDLE
    skill grasp {
        input { force: flot64 }
        effect { take: arm -> BUSY  drop: arm -> IDEL }
        initial IDLE
        precondition {
            idle:    resource=(arn == IDLE)
            charged: data=(batery > 10.0)
            success tak
        }
        result { HELD: apply=drop }
    }
}
"""
    found = [(item.code, item.span.line) for item in errors(text, Path("gripper.skillset"))]
    assert found == [
        *(("SW002", 4), ("SW013", 6), ("SW011", 7), ("SW002", 8)),
        *(("SW010", 10), ("SW014", 11), ("SW012", 12)),
    ]


def test_problems_in_a_misplaced_block_are_reported() -> None:
    text = """skillset s {
    resource r { initial A  A -> B  B -> A }
    skill k {
        effect {
            go: r -> B
            result { DONE: apply=gone }
        }
        resource other { initial X  extern X -> Y  extern Y -> X }
        precondition { p: resource=(other == Z) success go }
    }
}
"""
    found = [(item.code, item.span.line) for item in errors(text, Path("s.skillset"))]
    assert found == [("SW002", 6), ("SW012", 6), ("SW002", 8), ("SW011", 9)]


def test_what_may_be_declared_in_a_part_that_was_not_read_is_not_called_unknown() -> None:
    text = """skillset s {
    data { calm: bool  wind float64 [m/s] }
    resource r { initial A  A -> B  B -> A }
    skill k { precondition { p: data=(wind < 5.0)  q: data=(wnd < 5.0) } result { DONE } }
}
"""
    (missing, unknown) = errors(text, Path("s.skillset"))
    assert (missing.code, unknown.code, unknown.message) == ("SW005", "SW014", "There is no datum or input `wnd`.")


@pytest.mark.parametrize(
    ("written", "code", "message"),
    [
        ("{ r -> A  other -> X }", "SW005", "A name is missing before `{`."),
        (": { r -> A  other -> X }", "SW002", "`:` has no place here in `effect`."),
    ],
)
def test_an_effect_without_name_is_one_problem(written: str, code: str, message: str) -> None:
    text = f"""skillset s {{
    resource r {{ initial A  A -> B  B -> A }}
    resource other {{ initial X  X -> Y  Y -> X }}
    skill k {{
        effect {{
            go {{ r -> B }}
            {written}
        }}
        precondition {{ free: resource=(r == A) success go }}
        result {{ DONE: apply=back  success LATE: apply=back }}
    }}
    skill l {{ precondition {{ p: resource=(r == Z) }} result {{ DONE }} }}
}}
"""
    first, behind = errors(text, Path("s.skillset"))
    assert (first.code, first.span.line, first.message) == (code, 7, message)
    assert (behind.code, behind.span.line) == ("SW011", 12)


def test_what_is_in_a_block_without_a_name_is_judged() -> None:
    text = """skillset s {
    resource r { initial A  A -> B  B -> A }
    skill k { effect { { r -> Z  w -> A } } result { DONE } }
}
"""
    found = errors(text, Path("s.skillset"))
    assert [(item.code, item.span.column) for item in found] == [("SW005", 24), ("SW011", 31), ("SW010", 34)]


def test_a_mistake_right_behind_a_block_hides_nothing_of_that_in_it() -> None:
    text = """skillset s {
    resource r { initial A  A -> B  B => A }
    effect { x: r -> B }
    skill k { precondition { p: resource=(r == Z) } result { DONE } }
}
"""
    assert [(item.code, item.span.line) for item in errors(text, Path("s.skillset"))] == [
        ("SW005", 2),
        ("SW002", 3),
        ("SW011", 4),
    ]
