"""`types.py`: the types of the skillset, and the inputs, outputs and feedback of its skills."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from skillwing.dsl.generating.source_text import (
    INDENT,
    LINE_LENGTH,
    annotation,
    bracketed,
    default,
    quoted,
    remark,
)
from skillwing.dsl.model import EnumType, Field, Skill, Skillset, StructType
from skillwing.dsl.naming import class_name


def lines(skillset: Skillset) -> Iterator[str]:
    enums = [declared for declared in skillset.types if isinstance(declared, EnumType)]
    structs = [declared for declared in skillset.types if isinstance(declared, StructType)]
    yield f'"""Types of the skillset `{skillset.name}`, and inputs, outputs and feedback of its skills."""'
    yield ""
    yield "from __future__ import annotations"
    yield ""
    # Modules, not names in them, since a type of the skillset may be called `Literal`.
    if enums:
        yield "import enum"
    if skillset.skills or skillset.resources:
        yield "import typing"
    if structs or skillset.skills:
        yield from ("", "import msgspec")
    for enum in enums:
        yield from ("", "", f"class {class_name(enum.name)}(enum.StrEnum):")
        yield from (f'{INDENT}{value} = "{value}"' for value in enum.values)
    for struct in structs:
        yield from _struct(class_name(struct.name), f"Type `{struct.name}`.", struct.fields)
    for skill in skillset.skills:
        for suffix, fields in _messages(skill):
            yield from _struct(class_name(skill.name) + suffix, f"{suffix} of the skill `{skill.name}`.", fields)
    aliases = [
        *((f"{class_name(skill.name)}Result", [result.name for result in skill.results]) for skill in skillset.skills),
        *((f"{class_name(resource.name)}State", resource.states) for resource in skillset.resources),
    ]
    if aliases:
        yield from ("", "")
    for name, values in aliases:
        yield from _alias(name, values)


def _messages(skill: Skill) -> Iterator[tuple[str, tuple[Field, ...]]]:
    """The message classes of a skill: inputs always, outputs and feedback if it has any."""
    yield "Inputs", skill.inputs
    if skill.outputs:
        yield "Outputs", skill.outputs
    if skill.feedback:
        yield "Feedback", skill.feedback


def _struct(name: str, summary: str, fields: Iterable[Field]) -> Iterator[str]:
    yield from ("", "", f"class {name}(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):")
    yield f'{INDENT}"""{summary}"""'
    for field in fields:
        yield from ("", f"{INDENT}{field.name}: {annotation(field.type)}{default(field)}")
        if told := remark(field):
            yield f'{INDENT}"""{told}"""'


def _alias(name: str, values: Sequence[str]) -> Iterator[str]:
    """The alias for the names of results or states; a skill without results has none."""
    if not values:
        yield f"{name}: typing.TypeAlias = typing.Never"
        return
    literals = [quoted(value) for value in values]
    one_line = f"{name}: typing.TypeAlias = typing.Literal[{', '.join(literals)}]"
    if len(one_line) <= LINE_LENGTH:
        yield one_line
    else:
        yield from bracketed(f"{name}: typing.TypeAlias = typing.Literal[", literals, "]")
