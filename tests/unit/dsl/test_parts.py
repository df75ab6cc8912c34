"""Limits of the exploration: it works part by part, and skills that change nothing do not count."""

from __future__ import annotations

from pathlib import Path

import pytest

from skillwing.dsl.checking.checker import check
from skillwing.dsl.checking.reachability import parts

M600 = Path(__file__).parents[3] / "services" / "skillwing" / "m600" / "m600.skillset"

# `w` is BAD only while `r` is B, which two resources followed one by one do not tell.
TIED = """
    resource r { initial A  A -> B  B -> A }
    resource w { initial OK  OK -> BAD  BAD -> OK }
    skill both {
        effect { go { r -> B  w -> BAD }  back { r -> A  w -> OK } }
        precondition { free: resource=(r == A)  success go }
        result { DONE: apply=back }
    }
    skill wanting {
        precondition { odd: resource=(r == A and w == BAD) }
        result { DONE }
    }
"""


def codes(elements: str) -> list[str]:
    return [diagnostic.code for diagnostic in check(f"skillset s {{ {elements} }}", "f").diagnostics]


def test_an_impossible_combination_is_found() -> None:
    assert codes(TIED) == ["SW050"]


def test_skills_that_do_nothing_hinder_nothing() -> None:
    idle = "".join(f"skill idle{n} {{ precondition {{ p: resource=(r == A) }} result {{ DONE }} }}" for n in range(60))
    assert codes(TIED + idle) == ["SW050"]


def test_what_is_not_tied_hinders_nothing() -> None:
    others = "".join(
        f"resource o{n} {{ initial A  A -> B  B -> A }} "
        f"skill k{n} {{ effect {{ go: o{n} -> B  back: o{n} -> A }} "
        f"precondition {{ p: resource=(o{n} == A) success go }} result {{ DONE: apply=back }} }}"
        for n in range(30)
    )
    assert codes(TIED + others) == ["SW050"]


def test_several_skills_and_conditions_are_few_enough() -> None:
    conditions = "".join(f"resource c{n} {{ initial Y  extern Y -> N  extern N -> Y }}" for n in range(4))
    guards = " ".join(f"p{n}: resource=(c{n} == Y)" for n in range(4))
    takers = "".join(
        f"skill k{n} {{ effect {{ go {{ r -> B  w -> BAD }}  back {{ r -> A  w -> OK }} }} "
        f"precondition {{ free: resource=(r == A) {guards} success go }} result {{ DONE: apply=back }} }}"
        for n in range(6)
    )
    assert codes(TIED + conditions + takers) == ["SW050"]


def test_the_m600_is_played_through() -> None:
    text = M600.read_text()
    sound = check(text, "m600.skillset")
    assert sound.exact and sound.skillset is not None
    odd = "axes_authority == USED and heading_authority == AVAILABLE and SDK_authority == UNAVAILABLE"
    place = text.rindex("}")
    planted = f"{text[:place]} skill odd {{ precondition {{ odd: resource=({odd}) }} result {{ DONE }} }} }}"
    assert [diagnostic.code for diagnostic in check(planted, "m600.skillset").diagnostics] == ["SW050"]


@pytest.mark.parametrize("limit", ["MOST_SKILLS", "MOST_STATES", "MOST_SITUATIONS"])
def test_parts_that_are_too_large_are_reported(limit: str, monkeypatch: pytest.MonkeyPatch) -> None:
    text = f"skillset s {{ {TIED} }}"
    assert check(text, "f").exact
    monkeypatch.setattr(parts, limit, 0)
    checked = check(text, "f")
    assert not checked.exact
    assert checked.diagnostics == ()
