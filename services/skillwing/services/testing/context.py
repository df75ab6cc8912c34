"""The context of a test, held to the model: in which states resources may be, and which values data may have."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping

import msgspec

from skillwing.dsl.model import Resource, Skillset, UnknownNameError
from skillwing.services.core.values import fit
from skillwing.services.errors import SkillwingError


class ContextError(SkillwingError):
    """A test asks for a context that the skillset does not know. problems: a sentence for each thing that is wrong."""

    def __init__(self, skillset: str, problems: Iterable[str]) -> None:
        self.problems = tuple(problems)
        super().__init__(f"The context does not fit `{skillset}`: {' '.join(self.problems)}")


def checked_states(skillset: Skillset, states: Mapping[str, str]) -> dict[str, str]:
    """States by resource, all of them declared. Raises ContextError with every problem."""
    problems: list[str] = []
    for name, state in states.items():
        try:
            resource = skillset.resource(name)
            if state not in resource.states:
                raise UnknownNameError(f"state of {name}", state, resource.states)
        except UnknownNameError as error:
            problems.append(str(error))
    if problems:
        raise ContextError(skillset.name, problems)
    return dict(states)


def checked_data(skillset: Skillset, data: Mapping[str, object]) -> dict[str, object]:
    """Values by datum, fitted to the types of the model; structs become mappings. Raises ContextError."""
    problems: list[str] = []
    values: dict[str, object] = {}
    for name, value in data.items():
        try:
            item = skillset.datum(name)
        except UnknownNameError as error:
            problems.append(str(error))
        else:
            values[name], found = fit(msgspec.to_builtins(value), item.type, name)
            problems += [problem.sentence for problem in found]
    if problems:
        raise ContextError(skillset.name, problems)
    return values


def extern_way(resource: Resource, source: str, target: str) -> tuple[str, ...] | None:
    """The states that the functional layer has to drive a resource through, the target last; None if it cannot.

    The shortest way, by breadth-first search over the extern transitions.
    """
    ways: dict[str, tuple[str, ...]] = {source: ()}
    open_states = deque([source])
    while open_states and target not in ways:
        here = open_states.popleft()
        for edge in resource.transitions:
            if edge.extern and edge.source == here and edge.target not in ways:
                ways[edge.target] = (*ways[here], edge.target)
                open_states.append(edge.target)
    return ways.get(target)
