"""Building blocks of generated Python modules."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from textwrap import wrap

from skillwing.dsl.checking.types import bounds_text
from skillwing.dsl.model import ArrayType, EnumType, Field, Skill, Skillset, StructType, Type
from skillwing.dsl.naming import class_name

INDENT = "    "
LINE_LENGTH = 120


class TypeNames:
    """The names of the skillset's types, and of classes made from them, in one module.

    Names of the runtime begin with an underscore, which no type does. reserved: other names in the module or in one of
    its classes; a type with such a name is taken from `_types`. origin: the module that types come from.
    """

    def __init__(self, reserved: Iterable[str] = (), origin: str = ".types") -> None:
        self._reserved = frozenset(reserved)
        self._origin = origin
        self._used: set[str] = set()
        self._hidden = False

    def __call__(self, name: str) -> str:
        """The name of a type from `types.py` in this module."""
        if name in self._reserved:
            self._hidden = True
            return f"_types.{name}"
        self._used.add(name)
        return name

    def module_import(self) -> Iterator[str]:
        """The import of the module `types` itself, if a type with a reserved name was used."""
        if self._hidden:
            yield "from . import types as _types"

    def imports(self) -> Iterator[str]:
        """The import of all other types, in one line if it fits."""
        if not self._used:
            return
        opening, used = f"from {self._origin} import", sorted(self._used, key=_import_order)
        one_line = f"{opening} {', '.join(used)}"
        yield from [one_line] if len(one_line) <= LINE_LENGTH else bracketed(f"{opening} (", used, ")")


def _import_order(name: str) -> tuple[object, ...]:
    """The order of ruff and isort: names in capitals first, then by letter, then capitals first."""
    return not name.isupper() or len(name) == 1, _natural_order(name.lower()), _natural_order(name)


def _natural_order(text: str) -> list[str | tuple[int, str]]:
    """Numbers by value. Those with a leading zero count as fractions and come first."""
    pieces = re.split(r"(\d+)", text)
    return [
        (0 if piece.startswith("0") else len(piece), piece) if place % 2 else piece
        for place, piece in enumerate(pieces)
    ]


def annotation(declared: Type, names: TypeNames | None = None) -> str:
    """The Python annotation of a type. names: of the module that it stands in, None for `types.py`."""
    if isinstance(declared, ArrayType):
        return f"list[{annotation(declared.element, names)}]"
    if isinstance(declared, EnumType | StructType):
        name = class_name(declared.name)
        return name if names is None else names(name)
    if declared.is_number:
        return "float" if declared.is_float else "int"
    return "str" if declared.name == "string" else declared.name


def default(field: Field, names: TypeNames | None = None) -> str:
    """` = value` for a field with a default, else nothing."""
    if field.default is None:
        return ""
    if isinstance(field.type, EnumType):
        return f" = {annotation(field.type, names)}.{field.default}"
    return f" = {quoted(field.default) if isinstance(field.default, str) else repr(field.default)}"


def quoted(text: str) -> str:
    """A string literal in double quotes wherever that needs no escapes, as the formatter writes it."""
    literal = repr(text)
    return literal if '"' in text else f'"{literal[1:-1]}"' if "'" not in text else literal


def remark(field: Field) -> str:
    """Unit, range and length of a field, as far as the annotation lacks them."""
    parts = [f"[{field.unit}]"] if field.unit else []
    if field.low is not None and field.high is not None:
        parts.append(f"in {bounds_text(field.low, field.high)}")
    if isinstance(field.type, ArrayType) and field.type.length is not None:
        parts.append(f"of {field.type.length} elements")
    return " ".join(parts)


def inputs_class(skill: Skill, names: TypeNames) -> str:
    """The class of a skill's inputs."""
    return names(f"{class_name(skill.name)}Inputs")


def answer_classes(skill: Skill, names: TypeNames) -> tuple[str, str]:
    """The classes of a skill's outputs and feedback; `None` for what it does not have."""
    stem = class_name(skill.name)
    return (
        names(f"{stem}Outputs") if skill.outputs else "None",
        names(f"{stem}Feedback") if skill.feedback else "None",
    )


def exemptions(skillset: Skillset) -> Iterator[str]:
    """The linter exemption of a module with methods named after results, unless all of these are in small letters."""
    if any(result.name != result.name.lower() for skill in skillset.skills for result in skill.results):
        yield "# ruff: noqa: N802 - results keep the names that the skillset gives them"


def enumeration(names: Sequence[str], last: str) -> str:
    """`A, B or C`, with `last` for the `or`."""
    return f"{', '.join(names[:-1])} {last} {names[-1]}" if names[1:] else "".join(names)


def bracketed(opening: str, items: Iterable[str], closing: str) -> Iterator[str]:
    """Items one to a line, as the formatter writes a list that is too long for one line."""
    yield opening
    yield from (f"{INDENT}{item}," for item in items)
    yield closing


def docstring(summary: str, more: str = "") -> Iterator[str]:
    """A method's docstring, in one line if it fits."""
    margin = INDENT * 2
    one_line = f'{margin}"""{" ".join(filter(None, [summary, more]))}"""'
    if len(one_line) <= LINE_LENGTH:
        yield one_line
    else:
        yield from (f'{margin}"""{summary}', "")
        yield from wrap(more, LINE_LENGTH, initial_indent=margin, subsequent_indent=margin)
        yield f'{margin}"""'


def method(head: str, parameters: Sequence[str], result: str) -> Iterator[str]:
    """The first lines of a method with keyword parameters, each on its own line if it has any."""
    if not parameters:
        yield f"{INDENT}{head}(self) -> {result}:"
        return
    yield from (INDENT + line for line in bracketed(f"{head}(", ["self", "*", *parameters], f") -> {result}:"))
