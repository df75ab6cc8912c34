"""Resolution of predicates: the resource, datum or input behind each name, and the types of both sides."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from skillwing.dsl.checking.types import type_text
from skillwing.dsl.checking.units import OtherDimension, OtherScale, difference
from skillwing.dsl.diagnostics.report import DiagnosticReport
from skillwing.dsl.expressions import (
    And,
    Comparison,
    Expression,
    Implies,
    Literal,
    Name,
    NamedValue,
    Not,
    Operand,
    Or,
    Scope,
    depth,
    operand_text,
)
from skillwing.dsl.model import DataItem, EnumType, Field, Resource, ScalarType, StructType, Type
from skillwing.dsl.reading.syntax import CoinedWord, PredicateSyntax
from skillwing.dsl.spans import Span

_BOOL = ScalarType("bool")
_TEXT = ScalarType("string")
_NUMBER = ScalarType("float64")
_DEEPEST = 100


@dataclass(frozen=True, slots=True)
class VisibleNames:
    """The names that a predicate may use. Inputs hide data of the same name.

    untyped: names with a wrong type, which is reported elsewhere. Predicates that use one are not checked.
    """

    resources: Mapping[str, Resource]
    data: Mapping[str, DataItem]
    inputs: Mapping[str, Field]
    untyped: frozenset[str] | set[str] = frozenset()


class Predicates:
    """A resolver of the predicates in one place. Problems go to the report."""

    def __init__(self, names: VisibleNames, report: DiagnosticReport) -> None:
        self._known = names
        self._report = report

    def resolve(self, predicate: PredicateSyntax) -> Expression | None:
        """Return the expression with every name resolved, or None if nothing of it can be judged.

        If some sides of an `and` are wrong, the others are returned: the whole holds only if they hold. The report then
        notes the predicate as lost.
        """
        if depth(predicate.expression) > _DEEPEST:
            message = f"This predicate is nested more than {_DEEPEST} levels deep."
            self._report.add("SW029", predicate.span, message, "Split it into several.")
            return None
        resolved, is_whole = self._conjunction(predicate.expression, predicate.kind == "resource")
        if not is_whole:
            self._report.lost.append(predicate.span)
        return resolved

    def _conjunction(self, expression: Expression, on_resources: bool) -> tuple[Expression | None, bool]:
        """The part of a conjunction that resolves, and whether this is all of it."""
        if not isinstance(expression, And):
            resolved = self._expression(expression, on_resources)
            return resolved, resolved is not None
        left, left_is_whole = self._conjunction(expression.left, on_resources)
        right, right_is_whole = self._conjunction(expression.right, on_resources)
        part = right if left is None else left if right is None else And(left, right)
        return part, left_is_whole and right_is_whole

    def _expression(self, expression: Expression, on_resources: bool) -> Expression | None:
        match expression:
            case And(left, right) | Or(left, right) | Implies(left, right):
                # Both sides are looked at even if the first is wrong.
                sides = self._expression(left, on_resources), self._expression(right, on_resources)
                return None if sides[0] is None or sides[1] is None else type(expression)(sides[0], sides[1])
            case Not(operand):
                resolved = self._expression(operand, on_resources)
                return None if resolved is None else Not(resolved)
            case Comparison(left=left, right=right) if self._is_untyped(left) or self._is_untyped(right):
                return None
            case Comparison():
                return self._state_comparison(expression) if on_resources else self._data_comparison(expression)
            case Name() | Literal():
                return self._bare(expression, on_resources)

    # --- resource=(...)

    def _state_comparison(self, comparison: Comparison) -> Comparison | None:
        left, right = comparison.left, comparison.right
        subject, state = (left, right) if not self._names_resource(right) else (right, left)
        if self._names_resource(left) and self._names_resource(right):
            # A state may be called like a resource.
            if operand_text(right) in self._known.resources[operand_text(left)].states:
                subject, state = left, right
            elif operand_text(left) not in self._known.resources[operand_text(right)].states:
                message = "A resource is compared with a state, not with a resource."
                advice = f"Compare it with one of {_states(self._known.resources[operand_text(left)])}."
                self._report.add("SW020", comparison.span, message, advice)
                return None
        resource = self._resource(subject)
        if resource is None:
            return None
        if comparison.operator not in {"==", "!="}:
            message = f"States have no order, so `{comparison.operator}` says nothing about `{resource.name}`."
            self._report.add("SW020", comparison.span, message, "Use `==` or `!=`.")
            return None
        if not isinstance(state, Name) or state.fields:
            message = f"`{operand_text(state)}` is not a state of `{resource.name}`."
            self._report.add("SW020", state.span, message, f"Compare with one of {_states(resource)}.")
            return None
        if state.path not in resource.states:
            self._report.unknown("SW011", _word(state), f"state of `{resource.name}`", resource.states)
            return None
        name, symbol = Name(resource.name, "resource", subject.span), NamedValue(state.path, state.span)
        sides = (name, symbol) if subject is left else (symbol, name)
        return Comparison(comparison.operator, *sides, span=comparison.span)

    def _names_resource(self, operand: Operand) -> bool:
        return isinstance(operand, Name) and operand.path in self._known.resources

    def _resource(self, operand: Operand) -> Resource | None:
        if not isinstance(operand, Name):
            message = f"`{operand_text(operand)}` is not a resource."
            self._report.add("SW020", operand.span, message, "Write `RESOURCE == STATE`.")
            return None
        if operand.path in self._known.resources:
            return self._known.resources[operand.path]
        if operand.root in self._known.data or operand.root in self._known.inputs:
            kind = "an input" if operand.root in self._known.inputs else "a datum"
            message = f"`{operand.root}` is {kind}, not a resource."
            self._report.add("SW027", operand.span, message, _data_advice(operand))
            return None
        self._report.unknown("SW010", _word(operand), "resource", self._known.resources)
        return None

    # --- data=(...)

    def _data_comparison(self, comparison: Comparison) -> Comparison | None:
        left, right = comparison.left, comparison.right
        left_symbol, right_symbol = self._enum_value(left, right), self._enum_value(right, left)
        if left_symbol or right_symbol:
            return self._enum_comparison(comparison, left_symbol, right_symbol)
        if resources := [side for side in (left, right) if self._names_resource(side) and self._scope(side) is None]:
            self._typed(resources[0])
            return None
        typed_left = self._typed(left)
        typed_right = None if typed_left is None and self._may_be_value(right) else self._typed(right)
        if typed_left is None or typed_right is None:
            return None
        (resolved_left, left_type), (resolved_right, right_type) = typed_left, typed_right
        if not _comparable(left_type, right_type):
            message = (
                f"`{operand_text(left)}` is {_a(left_type)}, "
                f"`{operand_text(right)}` {_a(right_type)}: they cannot be compared."
            )
            self._report.add("SW020", comparison.span, message, _comparison_advice(left_type, right_type))
            return None
        self._compare_units(comparison)
        ordered = comparison.operator not in {"==", "!="}
        if ordered and not (isinstance(left_type, ScalarType) and left_type.is_number):
            message = f"`{comparison.operator}` compares numbers, and a {type_text(left_type)} is none."
            self._report.add("SW020", comparison.span, message, "Use `==` or `!=`.")
            return None
        return Comparison(comparison.operator, resolved_left, resolved_right, comparison.span)

    def _compare_units(self, comparison: Comparison) -> None:
        left, right = self._unit_of(comparison.left), self._unit_of(comparison.right)
        if left is None or right is None:
            return
        found = difference(left, right)
        subject = f"`{operand_text(comparison.left)}` is in `{left}`, `{operand_text(comparison.right)}` in `{right}`"
        match found:
            case OtherDimension():
                advice = f"Compare numbers of one dimension: {found.left} is not {found.right}."
                self._report.add("SW071", comparison.span, f"{subject}: they cannot be compared.", advice)
            case OtherScale(factor=None):
                advice = "The zeros of the two differ: declare both in one unit."
                self._report.add("SW072", comparison.span, f"{subject}, and nothing is converted.", advice)
            case OtherScale(factor=factor):
                advice = f"1 {left} is {factor:.6g} {right}: declare both in one unit."
                self._report.add("SW072", comparison.span, f"{subject}, and nothing is converted.", advice)
            case None:
                pass

    def _unit_of(self, operand: Operand) -> str | None:
        """The unit of a datum or an input, or of its field; None for no unit."""
        if not isinstance(operand, Name):
            return None
        declared: Field | DataItem | None = self._known.inputs.get(operand.root) or self._known.data.get(operand.root)
        for name in operand.fields:
            members = declared.type.fields if declared is not None and isinstance(declared.type, StructType) else ()
            declared = next((member for member in members if member.name == name), None)
        return None if declared is None else declared.unit

    def _enum_value(self, operand: Operand, other: Operand) -> EnumType | None:
        """The enum of `other` if `operand` is a single undeclared word, which can then only be one of its values."""
        if not isinstance(operand, Name) or operand.fields or self._scope(operand) is not None:
            return None
        if not isinstance(other, Name) or self._scope(other) is None:
            return None
        declared = self._type_of(other, quiet=True)
        return declared if isinstance(declared, EnumType) else None

    def _may_be_value(self, operand: Operand) -> bool:
        """True if an operand would be the value of an enum if the other side were known."""
        return isinstance(operand, Name) and not operand.fields and self._scope(operand) is None

    def _enum_comparison(
        self, comparison: Comparison, left_enum: EnumType | None, right_enum: EnumType | None
    ) -> Comparison | None:
        sides: list[Operand] = []
        for operand, enum in ((comparison.left, left_enum), (comparison.right, right_enum)):
            if enum is None:
                typed = self._typed(operand)
                if typed is not None:
                    sides.append(typed[0])
            elif operand_text(operand) in enum.values:
                sides.append(NamedValue(operand_text(operand), operand.span))
            else:
                self._report.unknown("SW015", _word(operand), f"value of `{enum.name}`", enum.values)
        if comparison.operator not in {"==", "!="}:
            message = f"The values of an enum have no order, so `{comparison.operator}` says nothing."
            self._report.add("SW020", comparison.span, message, "Use `==` or `!=`.")
            return None
        return Comparison(comparison.operator, sides[0], sides[1], comparison.span) if len(sides) == 2 else None

    def _typed(self, operand: Operand) -> tuple[Operand, Type] | None:
        match operand:
            case Literal(value=bool()):
                return operand, _BOOL
            case Literal(value=str()):
                return operand, _TEXT
            case Literal():
                return operand, _NUMBER
            case NamedValue():
                return None
            case Name():
                declared = self._type_of(operand)
                if declared is None:
                    return None
                return Name(operand.path, self._scope(operand), operand.span), declared

    def _is_untyped(self, operand: Operand) -> bool:
        return isinstance(operand, Name) and not self._known.untyped.isdisjoint((operand.root, *operand.fields))

    def _scope(self, operand: Operand) -> Scope | None:
        if not isinstance(operand, Name):
            return None
        if operand.root in self._known.inputs:
            return "input"
        return "data" if operand.root in self._known.data else None

    def _type_of(self, name: Name, quiet: bool = False) -> Type | None:
        """The type of a datum or input, or of its field. Problems are reported unless `quiet`."""
        if self._is_untyped(name):
            return None
        source = self._known.inputs.get(name.root) or self._known.data.get(name.root)
        if source is None:
            if not quiet:
                self._report_unknown(name)
            return None
        declared = source.type
        for field in name.fields:
            if not isinstance(declared, StructType):
                if not quiet:
                    whole = name.path.partition(f".{field}")[0]
                    message = f"`{whole}` is {_a(declared)}, which has no fields."
                    self._report.add("SW015", name.span, message, f"Compare `{whole}` itself.")
                return None
            members: Iterable[Field] = declared.fields
            types = {member.name: member.type for member in members}
            if field not in types:
                if not quiet:
                    kind = f"field of `{type_text(declared)}`"
                    self._report.unknown("SW015", CoinedWord(field, _span(name)), kind, types)
                return None
            declared = types[field]
        return declared

    def _report_unknown(self, name: Name) -> None:
        if name.root in self._known.resources:
            message = f"`{name.root}` is a resource."
            advice = "Write `resource=(...)` for predicates on resources."
            self._report.add("SW027", name.span, message, advice)
            return
        known = (*self._known.inputs, *self._known.data)
        self._report.unknown("SW014", CoinedWord(name.root, _span(name)), "datum or input", known)

    # --- without comparison

    def _bare(self, expression: Name | Literal, on_resources: bool) -> Name | Literal | None:
        if isinstance(expression, Literal) and isinstance(expression.value, bool):
            return expression
        if on_resources:
            resource = self._resource(expression)
            if resource is not None:
                message = f"`{resource.name}` alone says nothing."
                self._report.add("SW028", expression.span, message, f"Compare it with one of {_states(resource)}.")
            return None
        typed = self._typed(expression)
        if typed is None:
            return None
        resolved, declared = typed
        if declared != _BOOL or not isinstance(resolved, Name):
            message = f"`{operand_text(expression)}` is {_a(declared)}, not a predicate."
            self._report.add("SW028", expression.span, message, "Compare it with something, such as `> 0`.")
            return None
        return resolved


def _comparable(left: Type, right: Type) -> bool:
    if isinstance(left, ScalarType) and isinstance(right, ScalarType):
        return left == right or (left.is_number and right.is_number)
    return isinstance(left, EnumType) and left == right


def _comparison_advice(left: Type, right: Type) -> str:
    for declared in (left, right):
        if isinstance(declared, StructType):
            return f"Compare one of its fields: {', '.join(f'`.{field.name}`' for field in declared.fields)}."
        if isinstance(declared, EnumType):
            return f"Compare with one of {', '.join(f'`{value}`' for value in declared.values)}."
    return "Compare a number with a number, a text with a text, a bool with `true` or `false`."


def _data_advice(operand: Operand) -> str:
    """Advice for a predicate on data or inputs, which ONERA's robot language cannot express."""
    if _span(operand).file.endswith(".rl"):
        return "Predicates of this language name resources only: rewrite it by `skillwing convert`, or use a resource."
    return "Write `data=(...)` for predicates on data or inputs."


def _states(resource: Resource) -> str:
    return ", ".join(f"`{state}`" for state in resource.states)


def _word(operand: Operand) -> CoinedWord:
    return CoinedWord(operand_text(operand), _span(operand))


def _span(operand: Operand) -> Span:
    return operand.span or Span("", 1, 1, 1, 1)


def _a(kind: Type) -> str:
    """A type with its article: `an int8`, `a uint8`."""
    text = type_text(kind)
    return f"{'an' if text[:1].lower() in 'aeio' else 'a'} {text}"
