"""The context of a test, checked against the model: states of resources, values of data."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping
from functools import lru_cache
from pathlib import Path

import msgspec

from skillwing.dsl import load
from skillwing.dsl.model import Resource, Skillset, UnknownNameError
from skillwing.services.core.values import fit
from skillwing.services.errors import SkillwingError


class ContextError(SkillwingError):
    """A context does not fit the skillset. problems: a sentence for each problem."""

    def __init__(self, skillset: str, problems: Iterable[str]) -> None:
        self.problems = tuple(problems)
        super().__init__(f"The context does not fit `{skillset}`: {' '.join(self.problems)}")


def checked_states(skillset: Skillset, states: Mapping[str, str]) -> dict[str, str]:
    """States by resource. Raises ContextError with all problems."""
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
    """Values by datum, fitted to the types of the model. Structs become mappings. Raises ContextError."""
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
    """The shortest chain of extern transitions, as states, the target last; None if there is none."""
    ways: dict[str, tuple[str, ...]] = {source: ()}
    open_states = deque([source])
    while open_states and target not in ways:
        here = open_states.popleft()
        for edge in resource.transitions:
            if edge.extern and edge.source == here and edge.target not in ways:
                ways[edge.target] = (*ways[here], edge.target)
                open_states.append(edge.target)
    return ways.get(target)


def model_of(skillset: Skillset | str | Path) -> Skillset:
    """A model as it is, or that of a file. Raises OSError and SkillsetError as `load` does.

    An unchanged file is read once for all tests of a process.
    """
    if isinstance(skillset, Skillset):
        return skillset
    path = Path(skillset).resolve()
    return _read(path, path.stat().st_mtime_ns)


@lru_cache(maxsize=32)
def _read(path: Path, modified: int) -> Skillset:
    del modified
    return load(path)
