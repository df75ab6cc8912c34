"""Exploration of all that can happen in a small skillset, on the core of the resource manager."""

from __future__ import annotations

import copy
from collections import defaultdict
from dataclasses import dataclass, field
from itertools import count

from skillwing.dsl.expressions import Environment, Expression, evaluate, references
from skillwing.dsl.model import Skill, Skillset
from skillwing.services.core.events import ManagerGone
from skillwing.services.core.manager_state import Publication
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.resource_core import ResourceCore, Step
from skillwing.services.protocol import (
    BeginGoal,
    DataSample,
    Ended,
    EndGoal,
    EndKind,
    FireEvent,
    FireExtern,
    Granted,
    NotReady,
    Record,
    RecordKind,
    Violated,
)

Node = tuple[tuple[tuple[str, str], ...], tuple[str, ...], object]
MOST_NODES = 150


class TooLargeError(Exception):
    """The skillset has more than `MOST_NODES` nodes."""


@dataclass
class Playthrough:
    """The observations of a run.

    states: of each resource. rest: the states between steps, with the running skills. admitted: the states in which all
    preconditions held, with the verdict. applied: (skill, end) with an applied effect; judged: those that occurred.
    observed: (skill, result) of successful ends. fired: events. after: the nodes after each end.
    """

    states: dict[str, set[str]] = field(default_factory=lambda: defaultdict(set))
    rest: list[tuple[dict[str, str], tuple[str, ...]]] = field(default_factory=list)
    admitted: dict[str, list[tuple[dict[str, str], object]]] = field(default_factory=lambda: defaultdict(list))
    judged: set[tuple[str, str]] = field(default_factory=set)
    applied: set[tuple[str, str]] = field(default_factory=set)
    observed: set[tuple[str, str]] = field(default_factory=set)
    fired: set[str] = field(default_factory=set)
    after: dict[tuple[str, str], set[Node]] = field(default_factory=lambda: defaultdict(set))
    edges: dict[Node, set[Node]] = field(default_factory=dict)

    def hopeful(self, resource: str, states: set[str]) -> set[Node]:
        """Nodes from which the resource can still get to one of the states."""
        found = {node for node in self.edges if dict(node[0])[resource] in states}
        growing = True
        while growing:
            more = {node for node, onward in self.edges.items() if node not in found and onward & found}
            found |= more
            growing = bool(more)
        return found


def holds(expression: Expression, states: dict[str, str]) -> bool:
    return evaluate(expression, Environment(resources=states))


def about_resources(expression: Expression) -> bool:
    return all(name.scope == "resource" for name in references(expression))


def play(skillset: Skillset) -> Playthrough:
    return _Play(skillset).run()


class _Play:
    def __init__(self, skillset: Skillset) -> None:
        self._skillset = skillset
        model = (skillset, *skillset.skills, *skillset.resources, *skillset.data)
        self._shared: dict[int, object] = {id(part): part for part in model}  # what no copy of a core copies
        self._seen = Playthrough()
        self._ids = count()
        self._cores: dict[Node, ResourceCore] = {}
        self._frontier: list[Node] = []
        self._here: Node

    def run(self) -> Playthrough:
        core = ResourceCore(self._skillset, source="play", new_record_id=lambda: "record")
        for name, state in core.states.items():
            self._seen.states[name].add(state)
        self._here = _node(core, None)
        self._arrive(core, None)
        while self._frontier:
            self._here = self._frontier.pop()
            self._play_from(self._here[2])
        return self._seen

    def _core(self) -> ResourceCore:
        return copy.deepcopy(self._cores[self._here], dict(self._shared))

    def _arrive(self, core: ResourceCore, datum: object) -> Node:
        node = _node(core, datum)
        if node not in self._cores:
            if len(self._cores) >= MOST_NODES:
                raise TooLargeError
            self._cores[node] = core
            self._seen.edges[node] = set()
            self._seen.rest.append((dict(core.states), node[1]))
            self._frontier.append(node)
        self._seen.edges[self._here].add(node)
        return node

    def _note(self, step: Step, core: ResourceCore, datum: object) -> Node:
        node = self._arrive(core, datum)
        for publication in step.publications:
            self._publication(publication, node)
        return node

    def _publication(self, publication: Publication, node: Node) -> None:
        if isinstance(publication, Record):
            if publication.kind is RecordKind.RESOURCE:
                self._seen.states[publication.subject].add(publication.after)
        elif isinstance(publication, Violated):
            end = publication.skill, f"`{publication.invariant}` is violated"
            self._seen.judged.add(end)
            if "could not be applied" not in publication.reason:
                self._seen.applied.add(end)
            self._seen.after[publication.skill, f"violation of `{publication.invariant}`"].add(node)

    def _play_from(self, datum: object) -> None:
        skillset = self._skillset
        for resource in skillset.resources:
            for state in resource.states:
                request = FireExtern(resource=resource.name, target=state, source="play")
                if resource.allows(dict(self._here[0])[resource.name], state, extern=True):
                    core = self._core()
                    self._note(core.step(request, 0.0), core, datum)
        for event in skillset.events:
            core = self._core()
            try:
                step = core.step(FireEvent(event=event.name, source="play"), 0.0)
            except RefusedError:
                continue
            self._seen.fired.add(event.name)
            self._note(step, core, datum)
        for item in skillset.data:
            for value in (True, False):
                core = self._core()
                self._note(core.step(DataSample(name=item.name, value=value, t=0.0), 0.0), core, value)
        for skill in skillset.skills:
            if skill.name in self._here[1]:
                self._end(skill, datum)
            else:
                self._begin(skill, datum)

    def _begin(self, skill: Skill, datum: object) -> None:
        core = self._core()
        before = dict(core.states)
        request = BeginGoal(
            goal_id=f"g{next(self._ids)}",
            skill=skill.name,
            inputs={},
            manager=skill.name,
            owner="play",
            schema=self._skillset.schema_hash,
        )
        step = core.step(request, 0.0)
        verdict = step.reply
        failing = (
            {name for name in verdict.failing if not name.startswith("effect")} if isinstance(verdict, NotReady) else {}
        )
        if not failing:
            self._seen.admitted[skill.name].append((before, verdict))
            if not isinstance(verdict, NotReady):
                self._seen.applied.add((skill.name, "it starts"))
        if isinstance(verdict, NotReady) and skill.preconditions.failure is not None:
            self._seen.judged.add((skill.name, "it is refused"))
            if f"effect {skill.preconditions.failure}" not in verdict.failing or not failing:
                self._refusal(skill, before)
        assert isinstance(verdict, Granted | Violated | NotReady)
        self._note(step, core, datum)

    def _refusal(self, skill: Skill, before: dict[str, str]) -> None:
        changes = skill.transitions(skill.preconditions.failure)
        if all(self._skillset.resource(name).allows(before[name], target, extern=False) for name, target in changes):
            self._seen.applied.add((skill.name, "it is refused"))

    def _end(self, skill: Skill, datum: object) -> None:
        ends = [
            (f"it ends {result.name}", f"result `{result.name}`", EndKind.RESULT, result.name)
            for result in skill.results
        ]
        ends += [("it is interrupted", "interruption", EndKind.INTERRUPT, None)]
        for when, label, how, result in ends:
            core = self._core()
            (grant,) = (grant for grant in core.grants if grant.skill.name == skill.name)
            request = EndGoal(goal_id=grant.goal_id, skill=skill.name, token=grant.token, how=how, result=result)
            step = core.step(request, 0.0)
            assert isinstance(step.reply, Ended)
            self._seen.judged.add((skill.name, when))
            if "could not be applied" not in step.reply.reason:
                self._seen.applied.add((skill.name, when))
            if result is not None and step.reply.held:
                self._seen.observed.add((skill.name, result))
            self._seen.after[skill.name, label].add(self._note(step, core, datum))
        core = self._core()
        step_lost = core.step(ManagerGone(skill.name), 0.0)
        when = skill.name, "its manager is lost"
        self._seen.judged.add(when)
        changes = skill.transitions(skill.lost)
        states = dict(self._here[0])
        if all(self._skillset.resource(name).allows(states[name], target, extern=False) for name, target in changes):
            self._seen.applied.add(when)
        self._seen.after[skill.name, "loss of its manager"].add(self._note(step_lost, core, datum))


def _node(core: ResourceCore, datum: object) -> Node:
    return tuple(sorted(core.states.items())), tuple(grant.skill.name for grant in core.grants), datum
