"""Resolution of types, units, ranges and defaults."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from skillwing.dsl.checking.units import is_unit, similar_symbol, unknown_symbol
from skillwing.dsl.diagnostics.report import DiagnosticReport
from skillwing.dsl.expressions import Literal, NamedValue, literal_text
from skillwing.dsl.model import ArrayType, EnumType, Field, ScalarType, StructType, Type, Value
from skillwing.dsl.reading import syntax
from skillwing.dsl.spans import Word
from skillwing.dsl.suggest import closest, listed

SCALARS: Mapping[str, ScalarType] = {
    name: ScalarType(name)
    for name in (
        *("bool", "string", "float32", "float64"),
        *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)),
    )
}
_FAMILIAR = {"float": "float64", "double": "float64", "int": "int64", "uint": "uint64", "str": "string"}
_DEEPEST = 32


class Types:
    """The types of a skillset, by name. Structures are built on demand, so that their order does not matter."""

    def __init__(self, elements: Iterable[syntax.Element], report: DiagnosticReport) -> None:
        self._report = report
        self._structs: dict[str, syntax.StructSyntax] = {}
        self._named: dict[str, EnumType | StructType] = {}
        self._under_way: list[str] = []
        self.used: set[str] = set()
        self.untyped: set[str] = set()
        """Names whose declared types are wrong. Predicates on them are not checked."""
        seen: dict[str, Word] = {}
        for element in elements:
            if not isinstance(element, syntax.EnumSyntax | syntax.StructSyntax):
                continue
            name = element.name
            if name.text in SCALARS:
                report.add("SW016", name.span, f"`{name.text}` is a built-in type.", "Choose another name.")
            elif report.declare(seen, name, "type"):
                self._declare(element)
        self.all = tuple(self._built(name) for name in seen if name in self._structs or name in self._named)

    def _declare(self, element: syntax.EnumSyntax | syntax.StructSyntax) -> None:
        if isinstance(element, syntax.StructSyntax):
            self._structs[element.name.text] = element
            return
        seen: dict[str, Word] = {}
        values = tuple(value.text for value in element.values if self._report.declare(seen, value, "value"))
        if not values:
            message = f"The enum `{element.name.text}` has no value."
            self._report.add("SW015", element.name.span, message, "Name at least one.")
        self._named[element.name.text] = EnumType(element.name.text, values, element.name.span)

    def _built(self, name: str) -> EnumType | StructType:
        if name not in self._named:
            declaration = self._structs[name]
            self._under_way.append(name)
            members = self.fields(declaration.fields, f"field of {name}")
            self._under_way.pop()
            self._named[name] = StructType(name, members, declaration.name.span)
        return self._named[name]

    def resolve(self, use: syntax.TypeUse) -> Type | None:
        """Return the type; None if it is unknown, which is then reported."""
        resolved = self._resolve_name(use.name)
        for array in use.arrays:
            digits = array.text.strip("[] \t\r\n")
            length = int(digits) if digits else None
            if length == 0:
                self._report.add("SW026", array.span, "An array cannot have length 0.", "Write `[]` for any length.")
            resolved = resolved and ArrayType(resolved, length)
        return resolved

    def _resolve_name(self, word: Word) -> Type | None:
        name = word.text
        if name in SCALARS:
            return SCALARS[name]
        self.used.add(name)
        if name in self._under_way:
            message = f"The type `{name}` contains itself."
            self._report.add("SW024", word.span, message, "Refer to it by an identifier, such as an integer, instead.")
            return None
        if len(self._under_way) > _DEEPEST:
            message = f"Types are nested more than {_DEEPEST} levels deep here."
            self._report.add("SW029", word.span, message, "Use fewer levels.")
            return None
        if name in self._named or name in self._structs:
            return self._built(name)
        if name in _FAMILIAR:
            message = f"There is no type `{name}`."
            self._report.add("SW013", word.span, message, f"Did you mean `{_FAMILIAR[name]}`?")
        else:
            self._report.unknown("SW013", word, "type", (*SCALARS, *self._structs, *self._named))
        return None

    def fields(self, declarations: Iterable[syntax.FieldSyntax], kind: str) -> tuple[Field, ...]:
        """Resolve the fields of a block. Fields of unknown type are left out."""
        seen: dict[str, Word] = {}
        resolved = (self._field(item) for item in declarations if self._report.declare(seen, item.name, kind))
        return tuple(field for field in resolved if field is not None)

    def _field(self, declaration: syntax.FieldSyntax) -> Field | None:
        declared = self.resolve(declaration.type)
        unit = self.unit(declaration.unit)
        if declared is None:
            self.untyped.add(declaration.name.text)
            return None
        low, high = self.bounds(declaration.bounds, declared)
        name = declaration.name
        default = None
        if declaration.default is not None and not _is_number_by_mistake(declaration, declared):
            default = self._default(declaration.default, declared, low, high)
        modifiable = declaration.modifiable is not None
        return Field(name.text, declared, unit, low, high, default, name.span, modifiable)

    def unit(self, word: Word | None) -> str | None:
        """Return the unit without brackets and blanks; None for a wrong one."""
        if word is None:
            return None
        text = word.text[1:-1].strip()
        if not is_unit(text):
            message = f"`{word.text}` is not a unit."
            self._report.add("SW021", word.span, message, "Write it like `[m]`, `[m/s]`, `[m/s^2]`, `[1/s]` or `[%]`.")
            return None
        symbol = unknown_symbol(text)
        if symbol is not None:
            self._report.add("SW070", word.span, f"There is no unit `{symbol}`.", _unit_advice(symbol))
            return None
        return text

    def bounds(self, bounds: syntax.BoundsSyntax | None, declared: Type) -> tuple[float | None, float | None]:
        """Return the lowest and the highest value of a range."""
        if bounds is None:
            return None, None
        low, high = bounds.low.value, bounds.high.value
        span = bounds.low.span.to(bounds.high.span)
        if not (isinstance(declared, ScalarType) and declared.is_number):
            self._report.add("SW022", span, "Only numbers have a range.", "Remove the range.")
            return None, None
        if low > high:
            advice = f"Write `{bounds_text(high, low)}`."
            self._report.add("SW022", span, f"The range {bounds_text(low, high)} is empty.", advice)
            low, high = high, low  # as meant: defaults and predicates are judged by it
        if declared.bounds is not None:
            smallest, largest = declared.bounds
            if isinstance(low, float) or isinstance(high, float):
                message = f"The bounds of an `{declared.name}` are whole numbers."
                self._report.add("SW022", span, message, "Leave out the fraction, or use `float64`.")
            elif low < smallest or high > largest:
                message = f"The range does not fit `{declared.name}`, which runs from {smallest} to {largest}."
                self._report.add("SW022", span, message, "Narrow the range or take a wider type.")
            return low, high
        return float(low), float(high)

    def _default(
        self, given: Literal | NamedValue, declared: Type, low: float | None, high: float | None
    ) -> Value | None:
        written = given.name if isinstance(given, NamedValue) else literal_text(given.value)
        value = _converted(given, declared)
        if value is None:
            message = f"The default `{written}` is no {type_text(declared)}."
            self._report.add("SW023", given.span, message, _default_advice(given, declared))
            return None
        if isinstance(value, int | float) and not isinstance(value, bool):
            smallest, largest = _limits(declared, low, high)
            if not smallest <= value <= largest:
                message = f"The default `{written}` lies outside {bounds_text(smallest, largest)}."
                self._report.add("SW023", given.span, message, "Change the default or the range.")
        return value


def _unit_advice(symbol: str) -> str:
    meant = similar_symbol(symbol)
    return (
        f"Did you mean `{meant}`?" if meant else "Take a unit such as `m`, `s`, `m/s`, `rad` or `%`. A count has none."
    )


def type_text(declared: Type) -> str:
    """Print a type as the language writes it."""
    if isinstance(declared, ArrayType):
        return f"{type_text(declared.element)}[{'' if declared.length is None else declared.length}]"
    return declared.name


def bounds_text(low: float, high: float) -> str:
    """Print a range as the language writes it."""
    return f"{low}..{high}"


def _is_number_by_mistake(declaration: syntax.FieldSyntax, declared: Type) -> bool:
    """True if a field with a range and a numeric default has another type, which its range reports already."""
    is_number = isinstance(declared, ScalarType) and declared.is_number
    given = declaration.default
    return declaration.bounds is not None and not is_number and isinstance(given, Literal) and _is_numeric(given)


def _is_numeric(given: Literal) -> bool:
    return isinstance(given.value, int | float) and not isinstance(given.value, bool)


def _limits(declared: Type, low: float | None, high: float | None) -> tuple[float, float]:
    natural = declared.bounds if isinstance(declared, ScalarType) else None
    smallest, largest = natural or (float("-inf"), float("inf"))
    return smallest if low is None else low, largest if high is None else high


def _converted(given: Literal | NamedValue, declared: Type) -> Value | None:
    """The default as a value of the type; None if it is not one."""
    if isinstance(given, NamedValue):
        return given.name if isinstance(declared, EnumType) and given.name in declared.values else None
    value = given.value
    if not isinstance(declared, ScalarType):
        return None
    if declared.is_float and isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    written = "bool" if isinstance(value, bool) else "int" if isinstance(value, int) else type(value).__name__
    expected = "int" if declared.is_integer else {"string": "str"}.get(declared.name, declared.name)
    return value if written == expected else None


def _default_advice(given: Literal | NamedValue, declared: Type) -> str:
    match declared:
        case EnumType(values=values):
            guess = closest(given.name, values) if isinstance(given, NamedValue) else None
            return f"Did you mean `{guess}`?" if guess else f"Its values are {listed(values)}."
        case ArrayType() | StructType():
            return "Arrays and structures have no default: remove it."
        case ScalarType(name="bool"):
            return "Write `true` or `false`."
        case ScalarType(name="string"):
            return 'Write it in quotes, like `"text"`.'
        case ScalarType(is_integer=True):
            return "Write a whole number."
        case _:
            return "Write a number."
