"""Exact knowledge of a few resources and skills: exploration of all situations.

A node is the state of the resource manager between two steps: the state of each resource, and the running goals. Its
successors follow from all steps of managers, clients and the functional layer (docs/semantics.md): extern transitions
and events, starts and refusals, and ends of goals. After each step the invariants are enforced until none is violated.
Data and inputs are not considered: a predicate on them may be true or false at any time.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TypeAlias

from skillwing.dsl.checking.reachability.knowledge import SkillSituations
from skillwing.dsl.checking.reachability.relations import Row
from skillwing.dsl.checking.reachability.situations import Changes, Situations
from skillwing.dsl.checking.reachability.statespace import Guard, StateSpace
from skillwing.dsl.model import Resource, Skill

_Node: TypeAlias = tuple[Row, tuple[str, ...]]
"""The states of all resources, and the running skills: those with invariants in the order of their grants."""


@dataclass(slots=True)
class Budget:
    """The budget of an exploration. situations: nodes; outcomes: pairs of a step and a successor node."""

    situations: int
    outcomes: int

    def spend(self, situations: int = 0, outcomes: int = 0) -> None:
        self.situations -= situations
        self.outcomes -= outcomes
        if self.situations < 0 or self.outcomes < 0:
            raise TooManyError


class TooManyError(Exception):
    """The budget of an exploration is spent."""


class _Test:
    """A predicate on rows. known: whether it names resources only; otherwise it may be true or false at any time."""

    def __init__(self, space: StateSpace, guard: Guard) -> None:
        self.known = guard is not None
        self._rows = guard.rows if guard else frozenset[Row]()
        self._columns = [space.names.index(name) for name in guard.names] if guard else []

    def fails(self, row: Row) -> bool:
        return self.known and tuple([row[column] for column in self._columns]) not in self._rows


class _Effect:
    """An effect on rows."""

    def __init__(self, space: StateSpace, changes: Changes) -> None:
        self._changes = [(space.names.index(name), target, sources) for name, target, sources in changes]

    def apply(self, row: Row) -> Row | None:
        """The row after the effect; None if it cannot be applied."""
        changed = list(row)
        for column, target, sources in self._changes:
            if row[column] not in sources:
                return None
            changed[column] = target
        return tuple(changed)


class _Player:
    """A skill in the exploration. Its ends are in the order of `knowledge.ends_of`."""

    def __init__(self, skill: Skill, space: StateSpace) -> None:
        behaviour = space.behaviour(skill)
        self.name = skill.name
        self.checks = [_Test(space, check) for check in behaviour.checks]
        self.start = _Effect(space, behaviour.start)
        self.refusal = _Effect(space, behaviour.refusal)
        asked = [*(effect for effect, _ in behaviour.results), behaviour.interrupt, behaviour.lost]
        self.ends = [_Effect(space, changes) for changes in asked]
        self.invariants = [(_Test(space, guard), _Effect(space, changes)) for guard, changes in behaviour.invariants]


class Exploration:
    """Exact knowledge (`knowledge.Knowledge`). Raises TooManyError when the budget is spent."""

    exact = True

    def __init__(self, space: StateSpace, budget: Budget) -> None:
        self._space = space
        self._budget = budget
        self._players = {skill.name: _Player(skill, space) for skill in space.skillset.skills}
        self._events = [
            (_Test(space, space.guard(event.guard)), _Effect(space, space.event(event)))
            for event in space.skillset.events
        ]
        self._externs = [_extern_targets(space.resource(name)) for name in space.names]
        self._settled: dict[tuple[_Node, str | None], frozenset[_Node]] = {}
        self._visited: set[Row] = set()
        self._entered: dict[str, set[Row]] = defaultdict(set)
        self._started: dict[str, set[Row]] = defaultdict(set)
        self._violated: dict[tuple[str, int], set[Row]] = defaultdict(set)
        self._ended: dict[tuple[str, int], set[_Node]] = defaultdict(set)
        self._predecessors: dict[_Node, set[_Node]] = {}
        self._explore()
        self.always = self._situations(self._visited)
        self.resting = self._situations(row for row, _ in self._predecessors)

    # --- what is known

    def of(self, skill: Skill) -> SkillSituations:
        name = skill.name
        return SkillSituations(
            idle=self._situations(row for row, running in self._predecessors if name not in running),
            entered=self._situations(self._entered[name]),
            started=self._situations(self._started[name]),
            running=self._situations(row for row, running in self._predecessors if name in running),
            violated=tuple(self._situations(self._violated[name, at]) for at in range(len(skill.invariants))),
        )

    def stuck(self, skill: Skill, name: str, origins: frozenset[str]) -> list[frozenset[str]]:
        column = self._space.names.index(name)
        hopeful = self._leading_to(node for node in self._predecessors if node[0][column] in origins)
        player = self._players[skill.name]
        count = len(player.ends) + len(player.invariants)
        return [
            frozenset(node[0][column] for node in self._ended[skill.name, end] if node not in hopeful)
            for end in range(count)
        ]

    def _leading_to(self, nodes: Iterable[_Node]) -> set[_Node]:
        reached = set(nodes)
        frontier = list(reached)
        while frontier:
            onward = self._predecessors[frontier.pop()] - reached
            reached |= onward
            frontier += onward
        return reached

    def _situations(self, rows: Iterable[Row]) -> Situations:
        return Situations.enumerated(self._space.names, rows)

    # --- playing

    def _explore(self) -> None:
        initial = tuple(self._space.resource(name).initial for name in self._space.names)
        first: _Node = (initial, ())
        self._predecessors[first] = set()
        frontier: list[_Node] = [first]
        while frontier:
            node = frontier.pop()
            for successor in self._successors(node):
                if successor not in self._predecessors:
                    self._budget.spend(situations=1)
                    self._predecessors[successor] = set()
                    frontier.append(successor)
                self._predecessors[successor].add(node)

    def _successors(self, node: _Node) -> Iterator[_Node]:
        row, running = node
        yield from self._settle(row, running)  # Time passes, and data may break what holds on them.
        for column, targets in enumerate(self._externs):
            for target in targets.get(row[column], ()):
                yield from self._settle((*row[:column], target, *row[column + 1 :]), running)
        for guard, changes in self._events:
            if not guard.fails(row) and (after := changes.apply(row)) is not None:
                yield from self._settle(after, running)
        for player in self._players.values():
            if player.name in running:
                for end, effect in enumerate(player.ends):
                    after = self._applied(row, _without(running, player.name), effect)
                    self._ended[player.name, end] |= after
                    yield from after
            else:
                yield from self._asked_to_start(row, running, player)

    def _asked_to_start(self, row: Row, running: tuple[str, ...], player: _Player) -> Iterator[_Node]:
        failing = any(check.fails(row) for check in player.checks)
        after = None if failing else player.start.apply(row)
        if after is not None:
            self._entered[player.name].add(after)
            yield from self._settle(after, self._granted(running, player), player.name)
        if after is None or not all(check.known for check in player.checks):
            yield from self._applied(row, running, player.refusal)

    def _granted(self, running: tuple[str, ...], player: _Player) -> tuple[str, ...]:
        """The goals after a grant. Goals without invariants come last, in order of their names, because their order has
        no effect.
        """
        judged = [name for name in running if self._players[name].invariants]
        others = [name for name in running if not self._players[name].invariants]
        if player.invariants:
            return (*judged, player.name, *others)
        return (*judged, *sorted([*others, player.name]))

    def _applied(
        self, row: Row, running: tuple[str, ...], effect: _Effect, fresh: str | None = None
    ) -> frozenset[_Node]:
        """The row after an effect. An effect that cannot be applied changes nothing."""
        return self._settle(effect.apply(row) or row, running, fresh)

    def _settle(self, row: Row, running: tuple[str, ...], fresh: str | None = None) -> frozenset[_Node]:
        """Enforce the invariants until none is violated. fresh: a goal whose invariants were not evaluated before."""
        key = ((row, running), fresh)
        if key not in self._settled:
            self._visited.add(row)
            outcomes = frozenset(self._judged(row, running, fresh))
            self._settled[key] = outcomes
            self._budget.spend(outcomes=len(outcomes))
        return self._settled[key]

    def _judged(self, row: Row, running: tuple[str, ...], fresh: str | None) -> Iterator[_Node]:
        for name in running:
            if name == fresh:
                self._started[name].add(row)
            player = self._players[name]
            for place, (test, effect) in enumerate(player.invariants):
                if test.known and not test.fails(row):
                    continue
                self._violated[name, place].add(row)
                still_fresh = None if name == fresh else fresh
                after = self._applied(row, _without(running, name), effect, still_fresh)
                self._ended[name, len(player.ends) + place] |= after
                yield from after
                if test.known:
                    return  # It is false, so the goal has ended. One on data may as well have held.
        yield row, running


def _extern_targets(resource: Resource) -> dict[str, list[str]]:
    """The targets of the extern transitions of a resource, by source."""
    targets: dict[str, list[str]] = defaultdict(list)
    for edge in resource.transitions:
        if edge.extern:
            targets[edge.source].append(edge.target)
    return dict(targets)


def _without(running: tuple[str, ...], name: str) -> tuple[str, ...]:
    return tuple([other for other in running if other != name])
