"""A new skill: its block in the skillset, a test of its manager, and a to-do list."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from importlib.metadata import entry_points
from pathlib import Path
from typing import Protocol

from skillwing.dsl.generating.skeletons import skill_file
from skillwing.dsl.model import Skill, Skillset
from skillwing.dsl.naming import class_name, manager_class, script_of
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

{imports}


def test_it_rejects_its_goals_until_it_is_written() -> None:
    """Replace this by tests of `{skill}`: its results, what stops it, and goals that it rejects."""
    test = SkillTest(SKILLSET, {manager})
    goal = test.start()
    goal.assert_ended("ERROR", reason="not written yet")
'''


class SkillBody(Protocol):
    """Body of a new skill, made from a file. block: of the skill, in the skillset."""

    @property
    def block(self) -> str: ...

    def files(self, skillset: Skillset, package: Path | None) -> Mapping[str, str]:
        """Files of the robot's package, by their path there. skillset: with the new skill."""
        ...

    def test(self, package: str) -> str:
        """The first test. package: import name of the robot's package."""
        ...


BODIES = "skillwing.skill_bodies"
"""Entry points of functions that make a `SkillBody` from a file, the name of the skill, and the skillset before it."""


def body_maker(kind: str) -> Callable[[Path, str, Skillset], SkillBody]:
    """The function that makes bodies of this kind (`tree`)."""
    (maker,) = entry_points(group=BODIES, name=kind)
    return maker.load()


def with_skill(text: str, skill: str, file: str, block: str | None = None) -> str:
    """The text of a valid skillset with one more skill at its end. block: of the skill; None for an empty one.

    The rest of the text stays as it is. Text in the style of `skillwing fmt` is so afterwards.
    """
    closing = next(lexeme for lexeme in reversed(lex(text, file)) if lexeme.kind == "CLOSE")
    before, after = text[: closing.start].rstrip(), text[closing.start :]
    return f"{before}\n\n{block or _BLOCK.format(skill=skill)}{after}"


def skill_test(skill: str, package: str) -> str:
    """The first test of a skill's manager. package: import name of the robot's package."""
    kit = "from skillwing.services.testing import SkillTest"
    own = [
        f"from {package}.generated.processes import SKILLSET",
        f"from {package}.skills.{skill} import {manager_class(skill)}",
    ]
    imports = [*own, kit] if package.startswith("skillwing.") else [kit, "", *own]
    return _TEST.format(skill=skill, manager=manager_class(skill), imports="\n".join(imports))


def checklist(skill: Skill, file: Path, folder: Path | None, test: Path, makes_all: bool) -> Iterator[str]:
    """The remaining work, in its order.

    folder: the robot's package, None if there is none yet; test: the first test of the skill; makes_all: whether
    `make generate` renews everything that is generated.
    """
    yield f"Describe it in {file}:"
    yield "  [ ] `input`, `output` and `progress`: the values that go in and come out, with units and ranges"
    yield "  [ ] `effect`: the resources that it takes, and how it gives them back"
    yield "  [ ] `precondition`: what must hold for a start, and the effect that then takes the resources"
    yield "  [ ] `invariant`: what must hold while it runs, and the effect that gives the resources back otherwise"
    yield "  [ ] `result`: each end, with the effect that it applies and a `post` if you can promise one"
    yield "  [ ] `interrupt` with its timeout, and `lost` if a dead manager needs another effect"
    yield f"  [ ] `skillwing check {file}`"
    if folder is None:
        yield "Then make the robot's package, with its manager in it:"
        yield f"  [ ] `skillwing generate {file} -o DIR`"
        return
    yield f"Write it in {folder}/{skill_file(skill.name)}:"
    if makes_all:
        yield "  [ ] `make generate`, which gives the hooks their types and renews everything that is generated"
    else:
        yield f"  [ ] `skillwing generate {file} -o {folder}`, which gives the hooks their types"
    yield "  [ ] `on_dispatch` starts the functional layer; callbacks end the goal by `terminated_<RESULT>`"
    yield "  [ ] `on_interrupt` stops it and calls `interrupted` when it has stopped"
    yield f"  [ ] `progress`, if there is any, returns a `{class_name(skill.name)}Feedback`"
    yield f"Test it in {test}:"
    yield "  [ ] each result, the interruption, each invariant, a rejected start"
    yield f"  [ ] `pytest {test.parent}`"
    yield "Where you have them:"
    script = script_of(file)
    yield f"  [ ] mock script: `[skill.{skill.name}]` in {script}, if a mock has to do more than succeed after 1 s"
    if not makes_all:
        yield f"  [ ] reference page: `skillwing docs {file} -o PAGE.md`"
        yield f"  [ ] your own Compose file: the service `skill_{skill.name}`, as in {folder}/generated/compose.yml"
