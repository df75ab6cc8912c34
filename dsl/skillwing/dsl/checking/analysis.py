"""Checks on the meaning of a resolved skillset: what can never hold, never apply, never be reached.

Reasoning is by enumeration over the resources that a skill names, and errs on the side of silence: while a skill
runs, every other skill and the functional layer are assumed to do whatever their transitions allow.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from skillwing.dsl.checking.leaks import report_leaks
from skillwing.dsl.checking.statespace import (
    Possible,
    StateSpace,
    about_resources,
    described,
    holds,
    resources_of,
    satisfiable,
    start_applies,
)
from skillwing.dsl.diagnostics.report import Report
from skillwing.dsl.expressions import And, Expression, Implies, Not, Or
from skillwing.dsl.model import Effect, Event, Invariant, Predicate, Resource, Skill, Skillset
from skillwing.dsl.spans import Span
from skillwing.dsl.suggest import listed


def analyse(skillset: Skillset, report: Report) -> None:
    """Report what is wrong with the meaning of a skillset whose names and types are right."""
    space = StateSpace(skillset)
    named = _resources_named(skillset)
    for resource in skillset.resources:
        _resource(resource, resource.name in named, space, report)
    for event in skillset.events:
        _event(event, space, report)
    for skill in skillset.skills:
        _SkillAnalysis(skill, space, report).run()
    report_leaks(skillset, space, report)


def _resources_named(skillset: Skillset) -> frozenset[str]:
    guards = [expression for skill in skillset.skills for expression in _expressions(skill)]
    guards += [event.guard for event in skillset.events if event.guard is not None]
    effects = [effect for skill in skillset.skills for effect in skill.effects]
    effects += [event.effect for event in skillset.events]
    return resources_of(guards) | {name for effect in effects for name, _ in effect.transitions}


def _expressions(skill: Skill) -> Iterator[Expression]:
    yield from (check.expression for check in skill.preconditions.checks)
    yield from (invariant.expression for invariant in skill.invariants)
    yield from (result.post for result in skill.results if result.post is not None)


def _span_of(expression: Expression) -> Span | None:
    spans = list(_spans(expression))
    return spans[0].to(spans[-1]) if spans else None


def _spans(expression: Expression) -> Iterator[Span]:
    match expression:
        case And(left, right) | Or(left, right) | Implies(left, right):
            yield from _spans(left)
            yield from _spans(right)
        case Not(operand):
            yield from _spans(operand)
        case _ if expression.span is not None:
            yield expression.span
        case _:
            pass


# --- resources and events


def _resource(resource: Resource, is_named: bool, space: StateSpace, report: Report) -> None:
    for state in resource.states:
        if state not in space.reachable[resource.name]:
            message = f"No transition leads `{resource.name}` from `{resource.initial}` to `{state}`."
            advice = f"Add a transition such as `{resource.initial} -> {state}`, or remove the state."
            report.add("SW031", _mention(resource, state), message, advice)
    if not is_named:
        message = f"No skill and no event names the resource `{resource.name}`."
        report.add("SW082", resource.span, message, "Use it or remove it.")


def _mention(resource: Resource, state: str) -> Span | None:
    edges = [edge.span for edge in resource.transitions if state in (edge.source, edge.target)]
    return edges[0] if edges else resource.span


def _event(event: Event, space: StateSpace, report: Report) -> None:
    if event.guard is not None and about_resources(event.guard) and not satisfiable(event.guard, space):
        message = f"The guard of `{event.name}` can never hold."
        report.add("SW055", _span_of(event.guard), message, "Check the states it names.")
    for (name, target), span in zip(event.effect.transitions, event.effect.spans, strict=True):
        edges = [edge for edge in space.resource(name).transitions if edge.target == target]
        if any(edge.extern for edge in edges):
            continue
        if edges:
            message = f"`{name} -> {target}` is an internal transition, and events are external."
            advice = f"Declare it `extern {edges[0].source} -> {target}`, or leave it to a skill."
            report.add("SW044", span, message, advice)
        else:
            report.add("SW041", span, f"`{name}` has no transition to `{target}`.", _transitions_advice(name, space))


def _transitions_advice(name: str, space: StateSpace) -> str:
    edges = space.resource(name).transitions
    texts = [f"{'extern ' if edge.extern else ''}{edge.source} -> {edge.target}" for edge in edges]
    return f"Its transitions are {listed(texts)}."


# --- skills


class _SkillAnalysis:
    """Follows one skill from its preconditions through its start effect to its ends."""

    def __init__(self, skill: Skill, space: StateSpace, report: Report) -> None:
        self._skill = skill
        self._space = space
        self._report = report
        self._checks = [check for check in skill.preconditions.checks if about_resources(check.expression)]
        self._invariants = [item for item in skill.invariants if about_resources(item.expression)]
        self._start = skill.transitions(skill.preconditions.success)
        self._judged_wrong: set[Span] = set()

    def run(self) -> None:
        names = resources_of(check.expression for check in self._checks) | {name for name, _ in self._start}
        if not self._impossible("SW050", self._checks) and self._space.enumerable(names):
            self._from_the_start(names)
        self._impossible("SW051", self._invariants)

    def _impossible(self, code: str, predicates: Iterable[Predicate | Invariant]) -> bool:
        """Report the predicates that hold in no states at all."""
        found = False
        kind = "precondition" if code == "SW050" else "invariant"
        for predicate in predicates:
            if not satisfiable(predicate.expression, self._space):
                found = True
                message = f"The {kind} `{predicate.name}` of `{self._skill.name}` can never hold."
                span = _span_of(predicate.expression) or predicate.span
                self._report.add(
                    code, span, message, "A resource is in one state at a time; check the states it names."
                )
        return found

    def _from_the_start(self, names: frozenset[str]) -> None:
        skill, space = self._skill, self._space
        admitted = [
            states
            for states in space.assignments(names)
            if all(holds(check.expression, states) for check in self._checks)
        ]
        if not admitted:
            culprits = listed(check.name for check in self._checks)
            message = f"The preconditions {culprits} of `{skill.name}` can never hold together."
            self._report.add("SW054", self._checks[0].span, message, "Drop or change one of them.")
            return
        startable = [states for states in admitted if start_applies(skill, states, space)]
        if startable and len(startable) < len(admitted):
            self._warn_blocked_start(next(states for states in admitted if states not in startable))
        started = [{**states, **dict(self._start)} for states in startable]
        running = self._running(started)
        self._invariants_at_start(started)
        self._effects(admitted, running)
        self._posts(running)

    def _warn_blocked_start(self, states: dict[str, str]) -> None:
        effect = self._skill.effect(self._skill.preconditions.success or "")
        blocked = [
            (name, target)
            for name, target in effect.transitions
            if not self._space.resource(name).allows(states[name], target, extern=False)
        ]
        name, target = blocked[0]
        message = (
            f"`{self._skill.name}` can be admitted while `{name}` is {states[name]}, "
            f"from where the start effect `{effect.name}` cannot bring it to {target}."
        )
        advice = f"Add a precondition on `{name}`, or the transition `{states[name]} -> {target}`."
        self._report.add("SW084", effect.span, message, advice)

    # --- while it runs

    def _running(self, started: list[dict[str, str]]) -> Possible:
        """The states each resource can be in while the skill runs with all its invariants intact."""
        possible: dict[str, frozenset[str]] = dict(self._space.reachable)
        for name in started[0] if started else ():
            possible[name] = self._space.drift(name, {states[name] for states in started})
        for invariant in self._invariants:
            possible |= self._narrowed(invariant.expression, True, possible)
        return possible

    def _narrowed(self, expression: Expression, wanted: bool, possible: Possible) -> dict[str, frozenset[str]]:
        """The states of the resources named in which the expression can be as wanted; unchanged if in none."""
        names = resources_of([expression])
        fitting = [states for states in self._space.assignments(names, possible) if holds(expression, states) is wanted]
        return {name: frozenset(states[name] for states in fitting) for name in names} if fitting else {}

    def _invariants_at_start(self, started: list[dict[str, str]]) -> None:
        for invariant in self._invariants:
            if not started or not satisfiable(invariant.expression, self._space):
                continue
            names = resources_of([invariant.expression])
            known = {tuple(sorted((name, states[name]) for name in names & states.keys())) for states in started}
            free = names - started[0].keys()
            cases = [dict(fixed) | states for fixed in sorted(known) for states in self._space.assignments(free)]
            broken = [states for states in cases if not holds(invariant.expression, states)]
            if not broken:
                continue
            if len(broken) == len(cases):
                message = (
                    f"The invariant `{invariant.name}` of `{self._skill.name}` is false as soon as the skill starts."
                )
                advice = f"After preconditions and start effect it finds {described(broken[0])}."
                self._report.add("SW053", _span_of(invariant.expression), message, advice)
            else:
                message = (
                    f"`{self._skill.name}` can start while its invariant `{invariant.name}` is false: "
                    f"{described(broken[0])}."
                )
                advice = "Ask for the same in a precondition."
                self._report.add("SW085", _span_of(invariant.expression), message, advice)

    # --- effects

    def _effects(self, admitted: list[dict[str, str]], running: Possible) -> None:
        skill = self._skill
        before = dict(self._space.reachable) | {
            name: frozenset(states[name] for states in admitted) for name in admitted[0]
        }
        self._judge(skill.preconditions.success, before, "when it starts")
        self._judge(skill.preconditions.failure, self._space.reachable, "when it is refused")
        for invariant in skill.invariants:
            broken = dict(running)
            if about_resources(invariant.expression):
                wide = dict(running) | {
                    name: self._space.reachable[name] for name in resources_of([invariant.expression])
                }
                broken |= self._narrowed(invariant.expression, False, wide)
            self._judge(invariant.violation, broken, f"when `{invariant.name}` is violated")
        for result in skill.results:
            self._judge(result.apply, running, f"when it ends {result.name}")
        self._judge(skill.interrupt.apply, running, "when it is interrupted")
        self._judge(skill.lost, running, "when its manager is lost")

    def _judge(self, effect_name: str | None, possible: Possible, when: str) -> None:
        if effect_name is None:
            return
        effect = self._skill.effect(effect_name)
        for (name, target), span in zip(effect.transitions, effect.spans, strict=True):
            self._judge_transition(effect, (name, target), span, possible[name], when)

    def _judge_transition(
        self, effect: Effect, change: tuple[str, str], span: Span, states: frozenset[str], when: str
    ) -> None:
        name, target = change
        into = [edge for edge in self._space.resource(name).transitions if edge.target == target]
        if states == frozenset({target}) or any(edge.source in states and not edge.extern for edge in into):
            return
        if span in self._judged_wrong:
            return  # An effect that several ends apply is reported once.
        if any(edge.source in states and edge.extern for edge in into):
            code = "SW040"
            message = (
                f"`{effect.name}` drives `{name} -> {target}`, which is extern: only the functional layer may take it."
            )
            advice = "Remove it from the effect, or declare the transition without `extern`."
        elif target in states:
            return  # It can only ever find the resource there already, which changes nothing.
        elif all(edge.extern for edge in into):
            code = "SW041"
            message = f"`{name}` has no transition to `{target}` that a skill may take."
            advice = _transitions_advice(name, self._space)
        else:
            code = "SW042"
            places = " or ".join(sorted(states))
            message = (
                f"`{effect.name}` can never apply {when}: `{name}` is then {places}, with no transition to `{target}`."
            )
            advice = _transitions_advice(name, self._space)
        self._judged_wrong.add(span)
        self._report.add(code, span, message, advice)

    # --- postconditions

    def _posts(self, running: Possible) -> None:
        for result in self._skill.results:
            if result.post is None or not about_resources(result.post):
                continue
            after = dict(running) | {
                name: frozenset({target}) for name, target in self._skill.transitions(result.apply)
            }
            names = resources_of([result.post])
            if self._space.enumerable(names) and not any(
                holds(result.post, states) for states in self._space.assignments(names, after)
            ):
                message = f"The postcondition of `{result.name}` can never hold when `{self._skill.name}` ends so."
                advice = "Check it against the effect that the result applies."
                self._report.add("SW052", _span_of(result.post), message, advice)
