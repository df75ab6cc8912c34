"""A model as source text, for `convert` and for new skills."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import chain

from skillwing.dsl.checking.types import bounds_text, type_text
from skillwing.dsl.expressions import Expression, literal_text, names_used, to_text
from skillwing.dsl.model import (
    DEFAULT_DISPATCH_TIMEOUT,
    DEFAULT_INTERRUPT_TIMEOUT,
    DataItem,
    Effect,
    EnumType,
    Event,
    Field,
    Invariant,
    Precondition,
    Resource,
    Result,
    Skill,
    Skillset,
    StructType,
    Transition,
    Type,
    Value,
)
from skillwing.dsl.printing.formatting import format_source


def to_source(skillset: Skillset) -> str:
    """Return `.skillset` text with the same meaning, in the style of the formatter.

    Reading it gives an equal model, for every model that a source can express. In a source, an interruption without an
    effect applies the one that all results share. The loss of a manager then applies that of an interruption.
    """
    elements = [
        *(_type(declared) for declared in skillset.types),
        *([_block("data", (_datum(item) for item in skillset.data))] if skillset.data else []),
        *(_resource(resource) for resource in skillset.resources),
        *(_event(event) for event in skillset.events),
        *(skill_source(skill) for skill in skillset.skills),
    ]
    return format_source(_block(f"skillset {skillset.name}", ["\n\n".join(elements)]))


def skill_source(skill: Skill) -> str:
    """A skill as it stands in a skillset, its sections in their usual order, not yet formatted."""
    return _block(f"skill {skill.name}", _sections(skill))


def _block(heading: str, statements: Iterable[str]) -> str:
    return "\n".join([f"{heading} {{", *statements, "}"])


def _inline(heading: str, statements: Iterable[str]) -> str:
    return f"{heading} {{ {' '.join(statements)} }}"


# --- types and data


def _type(declared: EnumType | StructType) -> str:
    if isinstance(declared, EnumType):
        return _inline(f"enum {declared.name}", declared.values)
    return _inline(f"type {declared.name}", map(_field, declared.fields))


def _field(field: Field) -> str:
    default = "" if field.default is None else f" = {_default(field.default, field.type)}"
    modifiable = " modifiable" if field.modifiable else ""
    return f"{field.name}: {type_text(field.type)}{_unit(field.unit)}{_bounds(field)}{default}{modifiable}"


def _unit(unit: str | None) -> str:
    return "" if unit is None else f" [{unit}]"


def _bounds(item: Field | DataItem) -> str:
    return "" if item.low is None or item.high is None else f" in {bounds_text(item.low, item.high)}"


def _default(value: Value, declared: Type) -> str:
    return str(value) if isinstance(declared, EnumType) else literal_text(value)


def _datum(item: DataItem) -> str:
    period = "" if item.period is None else f" period={item.period}"
    return f"{item.name}: {type_text(item.type)}{_unit(item.unit)}{_bounds(item)}{period}"


# --- resources and events


def _resource(resource: Resource) -> str:
    states = [] if resource.states == _mentioned(resource) else [_inline("state", resource.states)]
    edges = map(_transition, resource.transitions)
    return _block(f"resource {resource.name}", [*states, f"initial {resource.initial}", *edges])


def _mentioned(resource: Resource) -> tuple[str, ...]:
    """The states in the order of their first mention, which is their order if there is no list."""
    edges = chain.from_iterable((edge.source, edge.target) for edge in resource.transitions)
    return tuple(dict.fromkeys([resource.initial, *edges]))


def _transition(edge: Transition) -> str:
    return f"{'extern ' if edge.extern else ''}{edge.source} -> {edge.target}"


def _changes(effect: Effect) -> list[str]:
    return [f"{resource} -> {target}" for resource, target in effect.transitions]


def _event(event: Event) -> str:
    guard = [] if event.guard is None else [f"guard {_predicate(_kind(event.guard), event.guard)}"]
    return _block(f"event {event.name}", [*guard, _inline("effect", _changes(event.effect))])


# --- skills


def _sections(skill: Skill) -> Iterator[str]:
    if skill.progress_period is not None:
        progress = f"progress={skill.progress_period}"
        yield _inline(progress, map(_field, skill.feedback)) if skill.feedback else progress
    for keyword, fields in (("input", skill.inputs), ("output", skill.outputs)):
        if fields:
            yield _inline(keyword, map(_field, fields)) if len(fields) == 1 else _block(keyword, map(_field, fields))
    if skill.effects:
        yield _block("effect", map(_effect, skill.effects))
    if skill.preconditions != Precondition():
        yield _block("precondition", _precondition(skill.preconditions))
    if skill.invariants:
        yield _block("invariant", map(_invariant, skill.invariants))
    if skill.results:
        yield _block("result", map(_result, skill.results))
    yield from _ends(skill)
    if skill.deadline is not None:
        yield f"deadline={skill.deadline}"
    if skill.dispatch_timeout != DEFAULT_DISPATCH_TIMEOUT:
        yield f"dispatch_timeout={skill.dispatch_timeout}"
    if skill.owner_lost != "interrupt":
        yield f"owner_lost={skill.owner_lost}"


def _effect(effect: Effect) -> str:
    changes = _changes(effect)
    return f"{effect.name}: {changes[0]}" if len(changes) == 1 else _inline(effect.name, changes)


def _predicate(kind: str, expression: Expression) -> str:
    return f"{kind}=({to_text(expression)})"


def _precondition(precondition: Precondition) -> Iterator[str]:
    for check in precondition.checks:
        yield f"{check.name}: {_predicate(check.kind, check.expression)}"
    if precondition.success is not None:
        yield f"success {precondition.success}"
    if precondition.failure is not None:
        yield f"failure {precondition.failure}"


def _invariant(invariant: Invariant) -> str:
    violation = "" if invariant.violation is None else f" violation={invariant.violation}"
    return f"{invariant.name}: {_predicate(invariant.kind, invariant.expression)}{violation}"


def _result(result: Result) -> str:
    apply = "" if result.apply is None else f" apply={result.apply}"
    post = "" if result.post is None else f" post {_predicate(_kind(result.post), result.post)}"
    colon = ":" if apply or post else ""
    return f"{'success' if result.success else 'failure'} {result.name}{colon}{apply}{post}"


def _kind(expression: Expression) -> str:
    return "resource" if names_used(expression, "resource") else "data"


def _ends(skill: Skill) -> Iterator[str]:
    """`interrupt` and `lost`, as far as they differ from the defaults."""
    interrupt = skill.interrupt
    agreed = {result.apply for result in skill.results}
    options: list[str] = []
    if interrupt.apply is not None and agreed != {interrupt.apply}:
        options.append(f"apply={interrupt.apply}")
    if interrupt.timeout != DEFAULT_INTERRUPT_TIMEOUT:
        options.append(f"timeout={interrupt.timeout}")
    if options:
        yield _inline("interrupt", options)
    if skill.lost is not None and skill.lost != interrupt.apply:
        yield _inline("lost", [f"apply={skill.lost}"])
