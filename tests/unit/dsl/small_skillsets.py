"""Random skillsets small enough to be played through, as source texts that say where each element stands."""

from __future__ import annotations

from dataclasses import dataclass, field

from hypothesis import strategies as st

STATES = ("A", "B", "C")


@dataclass
class Source:
    """A text under construction. lines: of each element, counted from 1."""

    text: list[str] = field(default_factory=list[str])
    lines: dict[str, int] = field(default_factory=dict[str, int])

    def add(self, line: str, element: str | None = None) -> None:
        self.text.append(line)
        if element is not None:
            self.lines[element] = len(self.text)

    def __str__(self) -> str:
        return "\n".join(self.text) + "\n"


@st.composite
def sources(draw: st.DrawFn) -> Source:
    """One to two skills on one to three resources, with every construct that touches resources."""
    source = Source()
    source.add("skillset s {")
    resources = {f"r{number}": STATES[: draw(st.integers(2, 3))] for number in range(draw(st.integers(1, 3)))}
    with_data = draw(st.integers(0, 3)) == 0
    if with_data:
        source.add("data { d: bool }")
    for name, states in resources.items():
        pairs = [(a, b) for a in states for b in states if a != b]
        some = st.lists(st.sampled_from(pairs), min_size=1, max_size=len(pairs), unique=True)
        edges = draw(st.just(pairs) | some)
        kinds = draw(st.sampled_from([("",), ("extern ",), ("", "", "extern ")]))
        texts = [f"{draw(st.sampled_from(kinds))}{a} -> {b}" for a, b in edges]
        source.add(f"resource {name} {{ state {{ {' '.join(states)} }} initial A {' '.join(texts)} }}", name)
    for number in range(draw(st.integers(0, 1))):
        _event(draw, source, f"e{number}", resources)
    for number in range(draw(st.integers(1, 2))):
        _skill(draw, source, f"k{number}", resources, with_data and number == 0)
    source.add("}")
    return source


def _skill(draw: st.DrawFn, source: Source, name: str, resources: dict[str, tuple[str, ...]], with_data: bool) -> None:
    effects = [f"x{number}" for number in range(draw(st.integers(0, 3)))]
    some_effect = st.sampled_from([*effects, "nothing"])
    source.add(f"skill {name} {{", name)
    source.add("effect { nothing {}")
    for effect in effects:
        source.add(f"{effect} {{ {_changes(draw, resources)} }}", f"{name}.{effect}")
    source.add("}")
    source.add("precondition {")
    for number in range(draw(st.integers(0, 2))):
        source.add(f"p{number}: {_predicate(draw, resources)}", f"{name}.p{number}")
    if with_data and draw(st.booleans()):
        source.add("fresh: data=(d)", f"{name}.fresh")
        with_data = False
    source.add(f"success {draw(some_effect)}")
    if draw(st.booleans()):
        source.add(f"failure {draw(some_effect)}")
    source.add("}")
    source.add("invariant {")
    for number in range(draw(st.integers(0, 2))):
        invariant = f"i{number}: {_predicate(draw, resources)} violation={draw(some_effect)}"
        source.add(invariant, f"{name}.i{number}")
    if with_data:
        source.add(f"kept: data=(d) violation={draw(some_effect)}", f"{name}.kept")
    source.add("}")
    source.add("result {")
    for number in range(draw(st.integers(1, 2))):
        post = f" post {_predicate(draw, resources)}" if draw(st.booleans()) else ""
        side = "success" if number == 0 else "failure"
        source.add(f"{side} R{number}: apply={draw(some_effect)}{post}", f"{name}.R{number}")
    source.add("}")
    source.add(f"interrupt {{ apply={draw(some_effect)} }} lost {{ apply={draw(some_effect)} }} }}")


def _event(draw: st.DrawFn, source: Source, name: str, resources: dict[str, tuple[str, ...]]) -> None:
    guard = f"guard {_predicate(draw, resources)}" if draw(st.booleans()) else ""
    source.add(f"event {name} {{ {guard} effect {{ {_changes(draw, resources)} }} }}", name)


def _changes(draw: st.DrawFn, resources: dict[str, tuple[str, ...]]) -> str:
    names = draw(st.lists(st.sampled_from(sorted(resources)), min_size=1, max_size=2, unique=True))
    return " ".join(f"{name} -> {draw(st.sampled_from(resources[name]))}" for name in names)


def _predicate(draw: st.DrawFn, resources: dict[str, tuple[str, ...]]) -> str:
    return f"resource=({_expression(draw, resources)})"


def _expression(draw: st.DrawFn, resources: dict[str, tuple[str, ...]]) -> str:
    name = draw(st.sampled_from(sorted(resources)))
    atom = f"{name} {draw(st.sampled_from(['==', '==', '!=']))} {draw(st.sampled_from(resources[name]))}"
    match draw(st.integers(0, 4)):
        case 0:
            return f"{atom} and {_expression(draw, resources)}"
        case 1:
            return f"({atom} or {_expression(draw, resources)})"
        case _:
            return atom
