"""Types of the ports of a main tree: their names in tree files, in the language and in Python."""

from __future__ import annotations

from typing import Any

from skillwing.bt_missions.planning.detour import Position
from skillwing.bt_missions.planning.known_space import Area
from skillwing.dsl.checking.types import SCALARS
from skillwing.dsl.model import ArrayType, EnumType, ScalarType, StructType, Type

LANGUAGE_NAMES = {"double": "float64", "float": "float64", "int": "int64", **{name: name for name in SCALARS}}
"""Scalar types of the language, by their names in tree files: BehaviorTree.CPP's, and those of the language."""
SHAPES: dict[str, Any] = {"Position": Position, "Position[]": tuple[Position, ...], "Area": Area | None}
"""Types with names for which a skillset may have types with other fields."""
LIST = "[]"
"""End of the name of a type of lists."""


def _python_type(kind: ScalarType) -> type:
    if kind.is_number:
        return int if kind.is_integer else float
    return bool if kind.name == "bool" else str


PYTHON_TYPES: dict[str, Any] = {
    **{name: _python_type(SCALARS[scalar]) for name, scalar in LANGUAGE_NAMES.items()},
    **SHAPES,
}
"""Types of options of missions on every robot, by their names. The skillset's own types, and lists of them, are others.
"""


def port_type(kind: Type) -> str:
    """The name of a type for an option. Lists of scalars are text, which the skill's port reads."""
    match kind:
        case ScalarType():
            wanted = _python_type(kind)
            return next(name for name, python in PYTHON_TYPES.items() if python is wanted)
        case EnumType() | StructType():
            return kind.name
        case ArrayType(element=EnumType() | StructType() as element, length=None):
            return f"{element.name}{LIST}"
        case _:
            return "string"
