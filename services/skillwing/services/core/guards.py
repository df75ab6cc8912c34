"""Evaluation of guards, and sentences that explain why one does not hold."""

from __future__ import annotations

from collections.abc import Mapping
from typing import cast

from skillwing.dsl.expressions import Environment, Expression, Name, evaluate, references, to_text
from skillwing.services.core.values import sendable_text


def explain_failure(expression: Expression, environment: Environment) -> str | None:
    """None if the expression holds, else a sentence with the values that it names."""
    if evaluate(expression, environment):
        return None
    facts = dict.fromkeys(_fact(name, environment) for name in references(expression))
    return f"`{to_text(expression)}` does not hold: {', '.join(facts) or 'it never does'}."


def _fact(name: Name, environment: Environment) -> str:
    if name.scope == "data" and name.root not in environment.data:
        return f"{name.root} is stale or was never published"
    source = {"resource": environment.resources, "data": environment.data}.get(name.scope or "", environment.inputs)
    value: object = source.get(name.root)
    for part in name.fields:
        value = cast(Mapping[str, object], value)[part] if isinstance(value, Mapping) else getattr(value, part)
    return f"{name.path} is {value:g}" if isinstance(value, float) else sendable_text(f"{name.path} is {value}")
