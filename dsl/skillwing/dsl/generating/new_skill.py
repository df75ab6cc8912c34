"""A skill to begin with: its block in the skillset, a test of its manager, and what is left to do."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from skillwing.dsl.generating.skeletons import skill_file
from skillwing.dsl.model import Skill
from skillwing.dsl.naming import class_name, manager_class
from skillwing.dsl.reading.dialect import lex

_BLOCK = """\
    // Say here in a sentence what `{skill}` does.
    skill {skill} {{
        result {{
            success DONE
            failure ABORTED
        }}
    }}
"""

_TEST = '''\
"""Tests of `{skill}`. Written once by `skillwing new-skill`, and yours from then on."""

from __future__ import annotations

from skillwing.services.testing import SkillTest

from ..generated.processes import SKILLSET
from ..skills.{skill} import {manager}


def test_it_refuses_its_goals_until_it_is_written() -> None:
    """Put in its place what `{skill}` has to do: how it ends, what stops it, what it refuses."""
    test = SkillTest(SKILLSET, {manager})
    goal = test.start()
    goal.assert_ended("ERROR", reason="not written yet")
'''


def with_skill(text: str, skill: str, file: str) -> str:
    """The text of a valid skillset with one more skill, the last one.

    Nothing else of it changes, its comments least of all; what was in the style of `skillwing fmt` is so afterwards.
    """
    closing = next(lexeme for lexeme in reversed(lex(text, file)) if lexeme.kind == "CLOSE")
    before, after = text[: closing.start].rstrip(), text[closing.start :]
    return f"{before}\n\n{_BLOCK.format(skill=skill)}{after}"


def skill_test(skill: str) -> Mapping[str, str]:
    """The files of the skill's first test by their path in the package."""
    text = _TEST.format(skill=skill, manager=manager_class(skill))
    return {"tests/__init__.py": "", tests_of(skill): text}


def tests_of(skill: str) -> str:
    """Where in the package the tests of a skill are."""
    return f"tests/test_{skill}.py"


def checklist(skill: Skill, file: str, folder: str | None) -> Iterator[str]:
    """What is left to do, in the order in which to do it. folder: the robot's package, None if there is none yet."""
    yield f"Describe it in {file}:"
    yield "  [ ] `input`, `output` and `progress`: what goes in and comes out, with units and ranges"
    yield "  [ ] `effect`: which resources it takes, and how it gives them back"
    yield "  [ ] `precondition`: what has to hold for it to start, and which effect then takes the resources"
    yield "  [ ] `invariant`: what has to hold while it runs, and what gives the resources back where it does not"
    yield "  [ ] `result`: how it ends, each with what it applies and a `post` if you can promise one"
    yield "  [ ] `interrupt` with its timeout, and `lost` if a dead manager needs more than that"
    yield f"  [ ] `skillwing check {file}`"
    if folder is None:
        yield "Then make the robot's package, with its manager in it:"
        yield f"  [ ] `skillwing generate {file} -o DIR`"
        return
    yield f"Write it in {folder}/{skill_file(skill.name)}:"
    yield f"  [ ] `skillwing generate {file} -o {folder}`, which gives the hooks their types"
    yield "  [ ] `on_dispatch` starts the functional layer; callbacks end the goal by `terminated_<RESULT>`"
    yield "  [ ] `on_interrupt` stops it and calls `interrupted` when it has stopped"
    yield f"  [ ] `progress`, if there is any, returns a `{class_name(skill.name)}Feedback`: how far it is"
    yield f"Test it in {folder}/{tests_of(skill.name)}:"
    yield "  [ ] each result, the interruption, each invariant, a refused start"
    yield f"  [ ] `pytest {folder}/tests`"
