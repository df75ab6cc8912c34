"""Approximate knowledge of a skillset of any size, resource by resource.

For each resource there are two least sets: its possible states, and its possible moves with their authors. They are
closed under

- extern transitions and events whose guards can hold;
- effects of skills, where they can be applied: at a start that the preconditions admit, at an end of a goal that can be
  running, at a refusal.

While a skill runs, a resource can have each state that other authors reach without breaking an invariant of the skill.
Resources that a predicate of the skill relates stay related until another author moves one (`situations.py`). No
possible situation is left out. Some impossible ones are included: two resources that always move together, for
instance, are followed one by one.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator
from typing import TypeAlias

from skillwing.dsl.checking.reachability.knowledge import SkillSituations
from skillwing.dsl.checking.reachability.situations import Changes, Situations
from skillwing.dsl.checking.reachability.statespace import Behaviour, StateSpace, closure
from skillwing.dsl.model import Skill

_Move: TypeAlias = tuple[str, str]


class _Moves:
    """The moves of each resource, with their authors: the one skill that makes a move, or None for any other author."""

    def __init__(self, names: Iterable[str]) -> None:
        self._authors: dict[str, dict[_Move, Behaviour | None]] = {name: {} for name in names}

    def add(self, name: str, move: _Move, author: Behaviour | None) -> bool:
        """Add moves; return whether one of them is new."""
        authors = self._authors[name]
        if move not in authors:
            authors[move] = author
            return True
        if authors[move] is None or authors[move] is author:
            return False
        authors[move] = None
        return True

    def by_others(self, name: str, behaviour: Behaviour) -> list[_Move]:
        """The moves with another author than the skill of this behaviour."""
        return [move for move, author in self._authors[name].items() if author is not behaviour]


class Approximation:
    """Approximate knowledge (`knowledge.Knowledge`)."""

    exact = False

    def __init__(self, space: StateSpace) -> None:
        self._space = space
        self._behaviours = Counter(space.behaviour(skill) for skill in space.skillset.skills)
        self._known: dict[Behaviour, SkillSituations] = {}
        self._states: dict[str, frozenset[str]] = {}
        self._moves = _Moves(space.names)
        self._forced = _Moves(space.names)
        """The moves that violation effects make."""
        self._news = dict.fromkeys(space.names, 0)
        self._externs()
        self._close()
        self.always = self.resting = Situations.independent(self._states)
        self._movers = self._by_resource()
        self._onwards: dict[tuple[str, str], frozenset[str]] = {}

    # --- what is known

    def of(self, skill: Skill) -> SkillSituations:
        return self._known[self._space.behaviour(skill)]

    def stuck(self, skill: Skill, name: str, origins: frozenset[str]) -> list[frozenset[str]]:
        found: list[frozenset[str]] = []
        for changes, situations in _ends(self._space.behaviour(skill), self.of(skill)):
            given_back = any(changed == name and target in origins for changed, target, _ in changes)
            left = frozenset[str]() if given_back else situations.after(changes).states(name)
            found.append(frozenset([state for state in left if not origins & self._recoverable(name, state)]))
        return found

    def _recoverable(self, name: str, state: str) -> frozenset[str]:
        """The states that a resource can reach after the goal, by itself or by skills that can start there."""
        reached = {state}
        frontier = [state]
        while frontier:
            onward = self._onward(name, frontier.pop()) - reached
            reached |= onward
            frontier += onward
        return frozenset(reached)

    def _onward(self, name: str, state: str) -> frozenset[str]:
        if (name, state) not in self._onwards:
            targets = {target for source, target in self._extern_edges(name) if source == state}
            here = self.always.freed(name, (state,))
            for behaviour, moved in self._movers[name]:
                if not moved <= targets and not _startable(behaviour, here).empty:
                    targets |= moved
                targets |= {target for changed, target, _ in behaviour.refusal if changed == name}
            self._onwards[name, state] = frozenset(targets)
        return self._onwards[name, state]

    def _by_resource(self) -> dict[str, list[tuple[Behaviour, frozenset[str]]]]:
        """The changes of each resource, with their target states."""
        movers: dict[str, list[tuple[Behaviour, frozenset[str]]]] = {name: [] for name in self._space.names}
        for behaviour in self._behaviours:
            targets: dict[str, set[str]] = defaultdict(set)
            for name, target, _ in (change for effect in behaviour.effects() for change in effect):
                targets[name].add(target)
            for name, states in targets.items():
                movers[name].append((behaviour, frozenset(states)))
        return movers

    # --- the least fixed point

    def _externs(self) -> None:
        for name in self._space.names:
            edges = self._extern_edges(name)
            for edge in edges:
                self._moves.add(name, edge, None)
            if name in self._space.unconstrained:
                edges = [(edge.source, edge.target) for edge in self._space.resource(name).transitions]
                for edge in edges:
                    self._moves.add(name, edge, None)
                    self._forced.add(name, edge, None)
            self._states[name] = closure({self._space.resource(name).initial}, edges)

    def _extern_edges(self, name: str) -> list[_Move]:
        return [(edge.source, edge.target) for edge in self._space.resource(name).transitions if edge.extern]

    def _close(self) -> None:
        """Apply each behaviour, and again whenever a resource that it names has new states or moves.

        Events add nothing here, because each of their transitions can also happen alone.
        """
        tried: dict[Behaviour, int] = {}
        changed = True
        while changed:
            changed = False
            for behaviour in self._behaviours:
                news = sum([self._news[name] for name in behaviour.names])
                if tried.get(behaviour) != news:
                    tried[behaviour] = news
                    changed = True
                    self._try(behaviour)

    def _try(self, behaviour: Behaviour) -> None:
        idle = Situations.independent({name: self._states[name] for name in behaviour.names})
        author = behaviour if self._behaviours[behaviour] == 1 else None
        startable = _startable(behaviour, idle)
        entered = startable.after(behaviour.start)
        started = self._drifted(behaviour, entered, self._forced)
        running = self._running(behaviour, started)
        known = SkillSituations(idle, entered, started, running, self._violated(behaviour, started, running))
        self._known[behaviour] = known
        self._apply(behaviour.start, startable, author)
        if behaviour.refusal:
            self._apply(behaviour.refusal, known.refused(behaviour), author)
        unforced = len(behaviour.results) + 2
        for end, (changes, situations) in enumerate(_ends(behaviour, known)):
            self._apply(changes, situations, author, forced=end >= unforced)

    def _apply(self, changes: Changes, situations: Situations, author: Behaviour | None, forced: bool = False) -> None:
        applicable = situations.able(changes)
        for name, target, _ in changes:
            for state in applicable.states(name) - {target}:
                news = self._moves.add(name, (state, target), author)
                news |= forced and self._forced.add(name, (state, target), author)
                if target not in self._states[name]:
                    news = True
                    self._states[name] |= closure((target,), self._extern_edges(name))
                self._news[name] += news

    # --- while a goal is under way

    def _drifted(self, behaviour: Behaviour, situations: Situations, moves: _Moves) -> Situations:
        """The situations after moves of others, regardless of invariants."""
        for name in behaviour.names:
            states = situations.states(name)
            grown = closure(states, moves.by_others(name, behaviour))
            if grown != states:
                situations = situations.freed(name, grown)
        return situations

    def _running(self, behaviour: Behaviour, started: Situations) -> Situations:
        """The situations between two steps of a running goal, with all invariants intact."""
        invariants = behaviour.judged_invariants
        at_first = started.where_all(invariants)
        permitted = self._drifted(behaviour, at_first, self._moves).where_all(invariants)
        grown = at_first
        for name in behaviour.names:
            states = at_first.states(name)
            reached = self._reached(behaviour, name, states, permitted.states(name))
            if reached != states:
                grown = grown.freed(name, reached)
        return grown.where_all(invariants)

    def _reached(
        self, behaviour: Behaviour, name: str, states: frozenset[str], permitted: frozenset[str]
    ) -> frozenset[str]:
        """The states that a resource reaches by moves of others that leave the invariants intact.

        A forbidden state may still be passed within one step: it may end an older goal, whose violation effect then
        restores the invariant.
        """
        forced = set(self._forced.by_others(name, behaviour))
        moves = self._moves.by_others(name, behaviour)
        return closure(states, [move for move in moves if move[0] in permitted or move in forced])

    def _violated(self, behaviour: Behaviour, started: Situations, running: Situations) -> tuple[Situations, ...]:
        """The situations at the violation of each invariant: right after the start, or one step later."""
        stepped = running
        for name in behaviour.names:
            states = running.states(name)
            moves = self._moves.by_others(name, behaviour)
            after = states | {target for source, target in moves if source in states}
            after = closure(after, self._forced.by_others(name, behaviour))
            if after != states:
                stepped = stepped.freed(name, after)
        found: list[Situations] = []
        for guard, _ in behaviour.invariants:
            if guard is None:
                found.append(stepped.union(started))
            else:
                found.append(stepped.where(guard, wanted=False).union(started.where(guard, wanted=False)))
                stepped, started = stepped.where(guard), started.where(guard)
        return tuple(found)


def _startable(behaviour: Behaviour, situations: Situations) -> Situations:
    return situations.where_all(behaviour.judged_checks).able(behaviour.start)


def _ends(behaviour: Behaviour, known: SkillSituations) -> Iterator[tuple[Changes, Situations]]:
    """The effect of each end, in the order of `knowledge.ends_of`, with the situations in which it is applied."""
    yield from ((effect, known.running) for effect, _ in behaviour.results)
    yield behaviour.interrupt, known.running
    yield behaviour.lost, known.running
    yield from ((effect, broken) for (_, effect), broken in zip(behaviour.invariants, known.violated, strict=True))
