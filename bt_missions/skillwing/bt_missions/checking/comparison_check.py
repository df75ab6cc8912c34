"""Check of comparisons with data of the robot: fields, sign and value."""

from __future__ import annotations

from collections.abc import Iterator

from skillwing.bt_missions.checking.declared_values import field_at
from skillwing.bt_missions.leaves.conditions import DataCompare
from skillwing.dsl.model import ArrayType, DataItem, EnumType, ScalarType, StructType, Type
from skillwing.dsl.suggest import listed

_EQUALITY = ("==", "!=")


def comparison_problems(leaf: DataCompare, datum: DataItem) -> Iterator[str]:
    """Problems of the fields, the sign and the value of a comparison."""
    try:
        compared = field_at(datum, leaf.fields)
    except LookupError as error:
        yield str(error)
        return
    problem = _value_problem(leaf, compared.type)
    if problem is not None:
        yield f"`{'.'.join([datum.name, *leaf.fields])}` {problem}"


def _value_problem(leaf: DataCompare, kind: Type) -> str | None:
    """Reason why a value of this type cannot be compared so; None if it can."""
    value = leaf.value
    match kind:
        case StructType():
            problem = f"has the fields {listed(field.name for field in kind.fields)}; compare one of them"
        case ArrayType():
            problem = "is a list, which cannot be compared"
        case ScalarType() if kind.is_number:
            fits = isinstance(value, int | float) and not isinstance(value, bool)
            return None if fits else f"is a number, and `{value}` is none"
        case ScalarType(name="bool") if not isinstance(value, bool):
            problem = f"is `true` or `false`, and never `{value}`"
        case ScalarType(name="string") if not isinstance(value, str):
            problem = f"is text, and `{value}` is none"
        case EnumType() if value not in kind.values:
            problem = f"is one of {listed(kind.values)}, and never `{value}`"
        case _ if leaf.sign not in _EQUALITY:
            problem = f"has no order; compare it by `==` or `!=`, not `{leaf.sign}`"
        case _:
            return None
    return problem
