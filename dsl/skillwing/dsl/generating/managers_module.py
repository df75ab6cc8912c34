"""`managers.py`: the base classes of skill managers."""

from __future__ import annotations

from collections.abc import Iterator

from skillwing.dsl.generating.source_text import (
    INDENT,
    LINE_LENGTH,
    TypeNames,
    answer_classes,
    enumeration,
    exemptions,
    inputs_class,
)
from skillwing.dsl.model import Result, Skill, Skillset
from skillwing.dsl.naming import class_name


def abstract_manager(skill: str) -> str:
    """The base class of a skill's manager."""
    return f"Abstract{class_name(skill)}Manager"


def lines(skillset: Skillset) -> Iterator[str]:
    names = TypeNames()
    body = [line for skill in skillset.skills for line in _manager(skill, names)]
    yield from exemptions(skillset)
    yield f'"""Base classes of the managers of `{skillset.name}`: one for each skill, with its results as methods."""'
    yield ""
    yield "from __future__ import annotations"
    if body:
        yield from ("", "from skillwing.services.managers.hooks import SkillHooks as _SkillHooks", "")
    yield from names.imports()
    yield from body


def _manager(skill: Skill, names: TypeNames) -> Iterator[str]:
    inputs, (outputs, feedback) = inputs_class(skill, names), answer_classes(skill, names)
    yield from ("", "", f"class {abstract_manager(skill.name)}(_SkillHooks[{inputs}, {outputs}, {feedback}]):")
    yield f'{INDENT}"""Hooks of the skill `{skill.name}`: {_endings(skill)}."""'
    yield ""
    yield f'{INDENT}skill = "{skill.name}"'
    yield f"{INDENT}Inputs = {inputs}"
    if skill.outputs:
        yield f"{INDENT}Outputs = {outputs}"
    if skill.feedback:
        yield f"{INDENT}Feedback = {feedback}"
    for result in skill.results:
        yield ""
        yield from _termination(result, outputs)


def _endings(skill: Skill) -> str:
    if not skill.results:
        return "runs until it is interrupted"
    return f"ends {enumeration([result.name for result in skill.results], 'or')}"


def _termination(result: Result, outputs: str) -> Iterator[str]:
    parameter, passed = ("", "") if outputs == "None" else (f", output: {outputs}", ", output")
    parameters = f'self, goal_id: str{parameter}, *, cause: str | None = None, why: str = ""'
    name = f"{INDENT}def terminated_{result.name}"
    if len(in_one_line := f"{name}({parameters}) -> None:") <= LINE_LENGTH:
        yield in_one_line
    else:
        yield from (f"{name}(", f"{INDENT * 2}{parameters}", f"{INDENT}) -> None:")
    yield f'{INDENT * 2}"""End the goal as a {"success" if result.success else "failure"}."""'
    yield f'{INDENT * 2}self.terminated(goal_id, "{result.name}"{passed}, cause=cause, why=why)'
