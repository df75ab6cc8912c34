"""Wording of findings: their spans, and states in sentences."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from skillwing.dsl.checking.reachability.situations import Situations
from skillwing.dsl.expressions import Expression, terms
from skillwing.dsl.model import Resource
from skillwing.dsl.spans import Span
from skillwing.dsl.suggest import listed


def span_of(expression: Expression) -> Span | None:
    """The span from the first to the last comparison of a predicate."""
    spans = [term.span for term in terms(expression) if term.span is not None]
    return spans[0].to(spans[-1]) if spans else None


def possible_states(names: Collection[str], situations: Situations) -> str:
    """The possible states of some resources in words: "`wheels` can be PARKED or DRIVING, `drill` can be UP"."""
    return ", ".join(f"`{name}` can be {alternatives(situations.states(name))}" for name in sorted(names)) or "none"


def possible_together(names: Collection[str], situations: Situations) -> str:
    """The same, with one possible combination if there are several resources."""
    apart = possible_states(names, situations)
    if len(names) < 2 or situations.empty:
        return apart
    return f"{apart}, but not in every combination; one that comes about is {described(situations.example(names))}"


def ask_for_possible(names: Collection[str], situations: Situations, when: str = "") -> str:
    """Advice on a predicate that holds in none of the situations."""
    if not names:
        return "It names nothing that could make it true: write what is meant, or remove it."
    return f"Ask for states that come about: {possible_together(names, situations)}{when}."


def alternatives(states: Collection[str]) -> str:
    return " or ".join(sorted(states)) or "nothing"


def described(states: Mapping[str, str]) -> str:
    """The states of some resources in words: "`drill == UP` and `wheels == PARKED`"."""
    return listed(f"{name} == {state}" for name, state in sorted(states.items())) if states else "always"


def transitions_of(resource: Resource) -> str:
    """The transitions of a resource in words."""
    texts = [f"{'extern ' if edge.extern else ''}{edge.source} -> {edge.target}" for edge in resource.transitions]
    if not texts:
        return "It has no transitions."
    return f"Its only transition is {listed(texts)}." if len(texts) == 1 else f"Its transitions are {listed(texts)}."
