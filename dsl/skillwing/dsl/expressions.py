"""Predicates of the language: syntax tree, evaluation and printing.

A predicate names states of resources, data and inputs of a goal. `evaluate` is the only evaluation of guards: the
resource manager, the mocks and the checker all call it.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Literal as OneOf
from typing import TypeAlias, cast

from skillwing.dsl.spans import Span

Scope: TypeAlias = OneOf["resource", "data", "input"]
Operator: TypeAlias = OneOf["==", "!=", "<", "<=", ">", ">="]


@dataclass(frozen=True, slots=True)
class Name:
    """A resource, a datum or an input, or a field of a structured one (`position.z`).

    `scope` is one of the three. It is None only before the expression is resolved.
    """

    path: str
    scope: Scope | None = None
    span: Span | None = field(default=None, compare=False, repr=False)

    @property
    def root(self) -> str:
        """The declared name: `position` for `position.z`."""
        return self.path.partition(".")[0]

    @property
    def fields(self) -> tuple[str, ...]:
        """The field names that follow the root: `("z",)` for `position.z`."""
        return tuple(self.path.split(".")[1:])


@dataclass(frozen=True, slots=True)
class NamedValue:
    """A literal word: a state of a resource or a value of an enum."""

    name: str
    span: Span | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Literal:
    """A number, `true`, `false` or a string."""

    value: bool | int | float | str
    span: Span | None = field(default=None, compare=False, repr=False)


Operand: TypeAlias = "Name | NamedValue | Literal"


@dataclass(frozen=True, slots=True)
class Comparison:
    """`left operator right`."""

    operator: Operator
    left: Operand
    right: Operand
    span: Span | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Not:
    """`not operand`."""

    operand: Expression


@dataclass(frozen=True, slots=True)
class And:
    """`left and right`."""

    left: Expression
    right: Expression


@dataclass(frozen=True, slots=True)
class Or:
    """`left or right`."""

    left: Expression
    right: Expression


@dataclass(frozen=True, slots=True)
class Implies:
    """`left => right`, read from the right: `a => b => c` is `a => (b => c)`."""

    left: Expression
    right: Expression


Term: TypeAlias = "Comparison | Name | Literal"
Expression: TypeAlias = "Term | Not | And | Or | Implies"


@dataclass(frozen=True, slots=True)
class Environment:
    """The values for an evaluation.

    resources: state of each resource. data: *fresh* values only; stale and unpublished data are left out. inputs: the
    goal's inputs, defaults filled in. Structured values are mappings or objects with attributes.
    """

    resources: Mapping[str, str] = field(default_factory=dict[str, str])
    data: Mapping[str, object] = field(default_factory=dict[str, object])
    inputs: Mapping[str, object] = field(default_factory=dict[str, object])


class UnboundNameError(LookupError):
    """An expression names a resource or an input that is not in the environment."""

    def __init__(self, name: Name) -> None:
        self.name = name
        super().__init__(
            f"The environment gives no {name.scope or 'meaning'} for `{name.path}`; "
            "every resource state and input has to be given before an expression can be judged."
        )


def evaluate(expression: Expression, environment: Environment) -> bool:
    """Evaluate a resolved expression.

    If any datum that it names is absent, the whole predicate is false: a guard never holds on unknown data. Raises
    UnboundNameError for a resource or input without a value.
    """
    if any(name.scope == "data" and name.root not in environment.data for name in references(expression)):
        return False
    return _holds(expression, environment)


def references(expression: Expression) -> Iterator[Name]:
    """Yield every name in the expression from left to right, repetitions included."""
    match expression:
        case Name():
            yield expression
        case Literal():
            return
        case Comparison(left=left, right=right):
            yield from (side for side in (left, right) if isinstance(side, Name))
        case Not(operand):
            yield from references(operand)
        case And(left, right) | Or(left, right) | Implies(left, right):
            yield from references(left)
            yield from references(right)


def terms(expression: Expression) -> Iterator[Term]:
    """Yield the comparisons and bare operands of an expression from left to right.

    Uses no recursion, so that the depth does not matter.
    """
    pending = [expression]
    while pending:
        match pending.pop():
            case Not(operand):
                pending.append(operand)
            case And(left, right) | Or(left, right) | Implies(left, right):
                pending += [right, left]
            case term:
                yield term


def depth(expression: Expression) -> int:
    """Return the nesting depth of operators. Uses no recursion, so that any expression is accepted."""
    deepest = 0
    pending = [(expression, 0)]
    while pending:
        node, level = pending.pop()
        deepest = max(deepest, level)
        match node:
            case Not(operand):
                pending.append((operand, level + 1))
            case And(left, right) | Or(left, right) | Implies(left, right):
                pending += [(left, level + 1), (right, level + 1)]
            case _:
                pass
    return deepest


def names_used(expression: Expression, scope: Scope | None = None) -> frozenset[str]:
    """Return the declared names (`position` for `position.z`) used in the expression, of one scope if given."""
    return frozenset(name.root for name in references(expression) if scope is None or name.scope == scope)


_COMPARE: Mapping[Operator, Callable[[object, object], bool]] = cast(
    Mapping[Operator, Callable[[object, object], bool]],
    {
        "==": operator.eq,
        "!=": operator.ne,
        "<": operator.lt,
        "<=": operator.le,
        ">": operator.gt,
        ">=": operator.ge,
    },
)


def _holds(expression: Expression, environment: Environment) -> bool:
    match expression:
        case Comparison(operator=sign, left=left, right=right):
            return bool(_COMPARE[sign](_value(left, environment), _value(right, environment)))
        case Not(operand):
            return not _holds(operand, environment)
        case And(left, right):
            return _holds(left, environment) and _holds(right, environment)
        case Or(left, right):
            return _holds(left, environment) or _holds(right, environment)
        case Implies(left, right):
            return not _holds(left, environment) or _holds(right, environment)
        case Name() | Literal():
            return bool(_value(expression, environment))


def _value(operand: Operand, environment: Environment) -> object:
    if isinstance(operand, Literal):
        return operand.value
    if isinstance(operand, NamedValue):
        return operand.name
    sources: dict[Scope | None, Mapping[str, object]] = {
        "resource": environment.resources,
        "data": environment.data,
        "input": environment.inputs,
    }
    source = sources.get(operand.scope, {})
    if operand.root not in source:
        raise UnboundNameError(operand)
    value = source[operand.root]
    for name in operand.fields:
        value = cast(Mapping[str, object], value)[name] if isinstance(value, Mapping) else getattr(value, name)
    return value


# How tightly each form binds; an operand that binds less tightly than its place needs parentheses.
_IMPLIES, _OR, _AND, _NOT, _ATOM = range(5)


def to_text(expression: Expression) -> str:
    """Print the expression in the language, with no more parentheses than it needs."""
    return _print(expression, _IMPLIES)


def _print(expression: Expression, place: int) -> str:
    match expression:
        case Implies(left, right):
            text, binding = f"{_print(left, _OR)} => {_print(right, _IMPLIES)}", _IMPLIES
        case Or(left, right):
            text, binding = f"{_print(left, _OR)} or {_print(right, _AND)}", _OR
        case And(left, right):
            text, binding = f"{_print(left, _AND)} and {_print(right, _NOT)}", _AND
        case Not(operand):
            text, binding = f"not {_print(operand, _NOT)}", _NOT
        case Comparison(operator=sign, left=left, right=right):
            text, binding = f"{operand_text(left)} {sign} {operand_text(right)}", _ATOM
        case Name() | Literal():
            text, binding = operand_text(expression), _ATOM
    return f"({text})" if binding < place else text


def operand_text(operand: Operand) -> str:
    """Print one side of a comparison."""
    match operand:
        case Name(path=path):
            return path
        case NamedValue(name=name):
            return name
        case Literal(value=value):
            return literal_text(value)


def literal_text(value: bool | int | float | str) -> str:
    """Print a literal as the language writes it: `true`, `0.5`, `"text"`."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return '"' + "".join(_ESCAPES.get(character, character) for character in value) + '"'
    return repr(value)


_ESCAPES = {"\\": "\\\\", '"': '\\"', "\n": "\\n", "\t": "\\t"}
