"""Python from a skillset: typed messages, the base classes of skill managers, a typed client.

The output is deterministic and meant to be read; it is regenerated, never edited.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from skillwing.dsl.checking.types import bounds_text
from skillwing.dsl.model import ArrayType, EnumType, Field, Result, Skill, Skillset, StructType, Type
from skillwing.dsl.naming import class_name

_INDENT = "    "
_OPTIONS = ("goal_id", "cause")
_LINE_LENGTH = 120
MARK = "# Generated from"
"""How every generated file begins."""


def generate(skillset: Skillset, source: str) -> Mapping[str, str]:
    """Return the generated package by file name. source: the skillset's file name, for the headers."""
    header = f"{MARK} {source} by `skillwing generate`. Do not edit: change the skillset instead.\n"
    modules = {
        "__init__.py": _package(skillset),
        "interface.py": _interface(skillset),
        "managers.py": _managers(skillset),
        "types.py": _types(skillset),
    }
    return {name: header + "\n".join(lines) + "\n" for name, lines in modules.items()}


def write(modules: Mapping[str, str], directory: Path) -> None:
    """Write the files of a generated package; raises OSError."""
    directory.mkdir(parents=True, exist_ok=True)
    for name, text in modules.items():
        (directory / name).write_text(text, encoding="utf-8")


def foreign(modules: Mapping[str, str], directory: Path) -> tuple[Path, ...]:
    """The files in the directory that would be overwritten and were not generated."""
    paths = [directory / name for name in modules]
    return tuple(path for path in paths if path.is_file() and not path.read_text("utf-8").startswith(MARK))


def outdated(modules: Mapping[str, str], directory: Path) -> tuple[Path, ...]:
    """The files in the directory that are missing or differ from what would be generated."""
    paths = {directory / name: text for name, text in modules.items()}
    return tuple(path for path, text in paths.items() if not path.is_file() or path.read_text("utf-8") != text)


def _package(skillset: Skillset) -> Iterator[str]:
    yield f'"""Code of the skillset `{skillset.name}`: `types`, `managers` and `interface`."""'
    yield ""
    yield f'SCHEMA_HASH = "{skillset.schema_hash}"'


# --- types.py


def _types(skillset: Skillset) -> Iterator[str]:
    enums = [declared for declared in skillset.types if isinstance(declared, EnumType)]
    structs = [declared for declared in skillset.types if isinstance(declared, StructType)]
    yield f'"""Types of the skillset `{skillset.name}`, and what goes into and comes out of its skills."""'
    yield ""
    yield "from __future__ import annotations"
    yield ""
    if enums:
        yield "from enum import StrEnum"
        yield ""
    yield "import msgspec"
    for enum in enums:
        yield from ("", "", f"class {class_name(enum.name)}(StrEnum):")
        yield from (f'{_INDENT}{value} = "{value}"' for value in enum.values)
    for struct in structs:
        yield from _struct(class_name(struct.name), f"Type `{struct.name}`.", struct.fields)
    for skill in skillset.skills:
        for suffix, fields in _messages(skill):
            yield from _struct(class_name(skill.name) + suffix, f"{suffix} of the skill `{skill.name}`.", fields)


def _messages(skill: Skill) -> Iterator[tuple[str, tuple[Field, ...]]]:
    """The message classes of a skill: inputs always, outputs and feedback where it has any."""
    yield "Inputs", skill.inputs
    if skill.outputs:
        yield "Outputs", skill.outputs
    if skill.feedback:
        yield "Feedback", skill.feedback


def _struct(name: str, summary: str, fields: Iterable[Field]) -> Iterator[str]:
    yield from ("", "", f"class {name}(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):")
    yield f'{_INDENT}"""{summary}"""'
    for field in fields:
        default = "" if field.default is None else f" = {_default(field)}"
        yield from ("", f"{_INDENT}{field.name}: {_annotation(field.type)}{default}")
        if remark := _remark(field):
            yield f'{_INDENT}"""{remark}"""'


def _annotation(declared: Type) -> str:
    if isinstance(declared, ArrayType):
        return f"list[{_annotation(declared.element)}]"
    if isinstance(declared, EnumType | StructType):
        return class_name(declared.name)
    if declared.is_number:
        return "float" if declared.is_float else "int"
    return "str" if declared.name == "string" else declared.name


def _default(field: Field) -> str:
    if isinstance(field.type, EnumType):
        return f"{class_name(field.type.name)}.{field.default}"
    if isinstance(field.default, str):
        return _quoted(field.default)
    return repr(field.default)


def _quoted(text: str) -> str:
    """A string literal in double quotes wherever that needs no escapes, as the formatter would have it."""
    literal = repr(text)
    return literal if '"' in text else f'"{literal[1:-1]}"' if "'" not in text else literal


def _remark(field: Field) -> str:
    """Unit, range and length of a field, as far as the annotation does not tell."""
    parts = [f"[{field.unit}]"] if field.unit else []
    if field.low is not None and field.high is not None:
        parts.append(f"in {bounds_text(field.low, field.high)}")
    if isinstance(field.type, ArrayType) and field.type.length is not None:
        parts.append(f"of {field.type.length} elements")
    return " ".join(parts)


# --- managers.py


def _managers(skillset: Skillset) -> Iterator[str]:
    names = [class_name(skill.name) + suffix for skill in skillset.skills for suffix, _ in _messages(skill)]
    yield "# ruff: noqa: N802 - results keep the names that the skillset gives them"
    yield f'"""What the managers of `{skillset.name}` derive from: one class for each skill, its results as methods."""'
    yield ""
    yield "from __future__ import annotations"
    yield ""
    yield "from skillwing.services.managers.skill_manager import SkillHooks"
    yield from _import_types(names)
    for skill in skillset.skills:
        yield from _manager(skill)


def _manager(skill: Skill) -> Iterator[str]:
    stem = class_name(skill.name)
    suffixes = [suffix for suffix, _ in _messages(skill)]
    parameters = [f"{stem}{suffix}" if suffix in suffixes else "None" for suffix in ("Inputs", "Outputs", "Feedback")]
    yield from ("", "", f"class Abstract{stem}Manager(SkillHooks[{', '.join(parameters)}]):")
    yield f'{_INDENT}"""Hooks of the skill `{skill.name}`: {_endings(skill)}."""'
    yield ""
    yield f'{_INDENT}skill = "{skill.name}"'
    for suffix in suffixes:
        yield f"{_INDENT}{suffix} = {stem}{suffix}"
    for result in skill.results:
        yield ""
        yield from _termination(skill, result)


def _endings(skill: Skill) -> str:
    if not skill.results:
        return "runs until it is interrupted"
    names = [result.name for result in skill.results]
    return "ends " + (", ".join(names[:-1]) + " or " if names[1:] else "") + names[-1]


def _termination(skill: Skill, result: Result) -> Iterator[str]:
    output = f", output: {class_name(skill.name)}Outputs" if skill.outputs else ""
    passed = ", output" if skill.outputs else ""
    yield f"{_INDENT}def terminated_{result.name}(self, goal_id: str{output}) -> None:"
    yield f'{_INDENT * 2}"""End the goal as a {"success" if result.success else "failure"}."""'
    yield f'{_INDENT * 2}self.terminated(goal_id, "{result.name}"{passed})'


# --- interface.py


def _interface(skillset: Skillset) -> Iterator[str]:
    name = class_name(skillset.name)
    inputs = [field for skill in skillset.skills for field in skill.inputs]
    yield f'"""Typed access to the skills of `{skillset.name}`."""'
    yield ""
    yield "from __future__ import annotations"
    yield ""
    yield "from skillwing.services.client.interface import GoalHandle, SkillsetInterface"
    yield from _import_types(declared for field in inputs for declared in _declared_types(field.type))
    yield from ("", "", f"class {name}Skills:")
    yield f'{_INDENT}"""Starts skills through an interface; each method returns the goal at once, still to be answered.'
    yield ""
    yield f"{_INDENT}goal_id: the interface chooses one unless given. cause: the timeline record that leads here."
    yield f"{_INDENT}Raises InvalidInputError for a value of a wrong type."
    yield f'{_INDENT}"""'
    yield ""
    yield f"{_INDENT}def __init__(self, interface: SkillsetInterface) -> None:"
    yield f"{_INDENT * 2}self._interface = interface"
    for skill in skillset.skills:
        yield ""
        yield from _starter(skill)


def _starter(skill: Skill) -> Iterator[str]:
    taken = {field.name for field in skill.inputs}
    options = [option for option in _OPTIONS if option not in taken]
    parameters = [
        *(_parameter(field) for field in skill.inputs),
        *(f"{option}: str | None = None" for option in options),
    ]
    yield f"{_INDENT}def {skill.name}("
    yield from (f"{_INDENT * 2}{line}" for line in ("self,", "*,"))
    yield from (f"{_INDENT * 2}{parameter}," for parameter in parameters)
    yield f"{_INDENT}) -> GoalHandle:"
    remarks = [f"{field.name}: {remark}" for field in skill.inputs if (remark := _remark(field))]
    summary = f'{_INDENT * 2}"""Start `{skill.name}`.'
    if not remarks:
        yield f'{summary}"""'
    elif len(one_line := f'{summary} {"; ".join(remarks)}."""') <= _LINE_LENGTH:
        yield one_line
    else:
        yield from (summary, "", *(f"{_INDENT * 2}{remark}." for remark in remarks), f'{_INDENT * 2}"""')
    inputs = [f'"{field.name}": {field.name}' for field in skill.inputs]
    one_line = f"{_INDENT * 2}inputs = {{{', '.join(inputs)}}}"
    if inputs and len(one_line) <= _LINE_LENGTH:
        yield one_line
    elif inputs:
        yield from (f"{_INDENT * 2}inputs = {{", *(f"{_INDENT * 3}{pair}," for pair in inputs), f"{_INDENT * 2}}}")
    arguments = ["inputs" if inputs else "{}", *(f"{option}={option}" for option in options)]
    yield f'{_INDENT * 2}return self._interface.start("{skill.name}", {", ".join(arguments)})'


def _parameter(field: Field) -> str:
    default = "" if field.default is None else f" = {_default(field)}"
    return f"{field.name}: {_annotation(field.type)}{default}"


def _declared_types(declared: Type) -> Iterator[str]:
    """The generated class that an annotation names, if any."""
    if isinstance(declared, ArrayType):
        yield from _declared_types(declared.element)
    elif isinstance(declared, EnumType | StructType):
        yield class_name(declared.name)


def _import_types(names: Iterable[str]) -> Iterator[str]:
    """Import generated classes, in one line if it fits."""
    ordered = sorted(set(names))
    one_line = f"from .types import {', '.join(ordered)}"
    if ordered and len(one_line) <= _LINE_LENGTH:
        yield from ("", one_line)
    elif ordered:
        yield from ("", "from .types import (", *(f"{_INDENT}{name}," for name in ordered), ")")
