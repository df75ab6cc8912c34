"""Analysis of a skill, from its preconditions through its start effect to its ends."""

from __future__ import annotations

from skillwing.dsl.checking.effect_analysis import EffectAnalysis
from skillwing.dsl.checking.impossible_guards import (
    report_check,
    report_checks,
    report_invariant,
    report_invariants,
    report_post,
)
from skillwing.dsl.checking.reachability.knowledge import Knowledge, SkillSituations, ends_of
from skillwing.dsl.checking.reachability.relations import Relation
from skillwing.dsl.checking.reachability.situations import Situations
from skillwing.dsl.checking.reachability.statespace import StateSpace, closure
from skillwing.dsl.checking.wording import (
    described,
    possible_states,
    span_of,
)
from skillwing.dsl.diagnostics.report import DiagnosticReport
from skillwing.dsl.expressions import to_text
from skillwing.dsl.model import Invariant, Skill
from skillwing.dsl.queries import unapplied_effects


class SkillAnalysis:
    """The analysis of one skill. startable: the situations in which it can start."""

    def __init__(self, skill: Skill, knowledge: Knowledge, space: StateSpace, report: DiagnosticReport) -> None:
        self._skill = skill
        self._knowledge = knowledge
        self._known: SkillSituations = knowledge.of(skill)
        self._space = space
        self._report = report
        self._effect_analysis = EffectAnalysis(space, knowledge.always, report)
        self._behaviour = space.behaviour(skill)
        self._admitted = self._known.idle.where_all(self._behaviour.judged_checks)
        self.startable = self._admitted.able(self._behaviour.start)

    def run(self) -> None:
        self._preconditions()
        self._invariants()
        self._effects()
        self._posts()
        if self._admitted.loose or self._known.running.loose:
            message = f"The predicates of `{self._skill.name}` tie too many resources together to be judged."
            self._report.add("SW088", self._skill.span, message, "Let each predicate name fewer resources.")

    # --- the start

    def _preconditions(self) -> None:
        skill, idle = self._skill, self._known.idle
        impossible = False
        for check, relation in zip(skill.preconditions.checks, self._behaviour.checks, strict=True):
            if relation is not None and idle.where(relation).empty:
                impossible = True
                report_check(skill.name, check, relation, idle, self._report)
        if impossible:
            return
        if self._admitted.empty:
            paired = zip(skill.preconditions.checks, self._behaviour.checks, strict=True)
            judged = [check for check, relation in paired if relation is not None]
            report_checks(skill.name, judged, self._behaviour.judged_checks, idle, self._report)
        elif not self.startable.empty:
            self._blocked_start()

    def _blocked_start(self) -> None:
        blocked = self._admitted.unable(self._behaviour.start)
        if blocked.empty:
            return
        effect = self._skill.effect(self._skill.preconditions.success or "")
        stuck = ((name, target, blocked.states(name) - sources) for name, target, sources in self._behaviour.start)
        name, target, states = next(item for item in stuck if item[2])
        state = min(states)
        message = (
            f"`{self._skill.name}` can be admitted while `{name}` is {state}, "
            f"from where the start effect `{effect.name}` cannot bring it to {target}."
        )
        advice = f"Add a check such as `{name}: resource=({name} != {state})`, or the transition `{state} -> {target}`."
        self._report.add("SW084", effect.span, message, advice)

    # --- invariants

    def _invariants(self) -> None:
        paired = zip(self._skill.invariants, self._behaviour.invariants, strict=True)
        judged = [(invariant, guard) for invariant, (guard, _) in paired if guard is not None]
        wrong = [self._never_holds(invariant, guard) for invariant, guard in judged]
        if any(wrong):
            return
        if not self._known.started.empty and self._known.running.empty:
            report_invariants(self._skill.name, [invariant for invariant, _ in judged], self._report)
            return
        for invariant, guard in judged:
            self._may_be_broken(invariant, guard)

    def _never_holds(self, invariant: Invariant, relation: Relation) -> bool:
        """Report an invariant that never holds, or that fails at the start; return whether it was reported."""
        name, span = self._skill.name, span_of(invariant.expression) or invariant.span
        started = self._known.started
        if self._knowledge.always.where(relation).empty:
            report_invariant(name, invariant, relation, self._knowledge.always, self._report)
            return True
        if not started.empty and started.where(relation).empty:
            message = f"The invariant `{invariant.name}` of `{name}` is false as soon as the skill starts."
            found = described(started.example(relation.names))
            advice = f"After preconditions and start effect it finds {found}: ask for that, or change the start effect."
            self._report.add("SW053", span, message, advice)
            return True
        return False

    def _may_be_broken(self, invariant: Invariant, relation: Relation) -> None:
        broken = self._known.entered.where(relation, wanted=False)
        if not broken.empty:
            found = described(broken.example(relation.names))
            message = f"`{self._skill.name}` can start while its invariant `{invariant.name}` is false: {found}."
            advice = (
                f"Ask for the same in a precondition: `{invariant.name}: resource=({to_text(invariant.expression)})`."
            )
            self._report.add("SW085", span_of(invariant.expression), message, advice)

    # --- effects

    def _effects(self) -> None:
        skill, known = self._skill, self._known
        self._judge(skill.preconditions.success, self._admitted, "when it starts")
        self._judge(skill.preconditions.failure, known.refused(self._behaviour), "when it is refused")
        for invariant, broken in zip(skill.invariants, known.violated, strict=True):
            self._judge(invariant.violation, broken, f"when `{invariant.name}` is violated")
        for result in skill.results:
            self._judge(result.apply, known.running, f"when it ends {result.name}")
        self._judge(skill.interrupt.apply, known.running, "when it is interrupted")
        self._judge(skill.lost, known.running, "when its manager is lost")
        for effect in unapplied_effects(skill):
            self._effect_analysis.judge_alone(effect, self._knowledge.always)

    def _judge(self, effect_name: str | None, situations: Situations, when: str) -> None:
        if effect_name is not None:
            self._effect_analysis.judge(self._skill.effect(effect_name), situations, when)

    # --- postconditions

    def _posts(self) -> None:
        for result, (changes, relation) in zip(self._skill.results, self._behaviour.results, strict=True):
            if result.post is None or relation is None:
                continue
            name, span = self._skill.name, span_of(result.post)
            anywhere, here = self._knowledge.always.after(changes), self._known.running.after(changes)
            if not anywhere.empty and anywhere.where(relation).empty:
                report_post(name, result.name, result.post, relation, anywhere, self._report)
            elif not here.empty and here.where(relation).empty:
                message = (
                    f"Nobody can ever observe `S_{result.name}`: when `{name}` ends so, the postcondition is false."
                )
                advice = f"Then {possible_states(relation.names, here)}: ask for that, or remove the result."
                self._report.add("SW061", span, message, advice)


def report_leaks(
    skill: Skill, startable: Situations, knowledge: Knowledge, space: StateSpace, report: DiagnosticReport
) -> None:
    """Warn of each resource that a skill takes at its start and may never give back.

    startable: the situations in which the skill can start. A resource without a way back by its own transitions, such
    as a parachute, is for single use and no leak.
    """
    for name, taken in skill.transitions(skill.preconditions.success):
        origins = startable.states(name) - {taken}
        left: set[str] = set()
        labels: list[str] = []
        stuck = knowledge.stuck(skill, name, origins) if origins else []
        for (label, effect), states in zip(ends_of(skill), stuck, strict=bool(origins)):
            # States in which the skill itself leaves it; another author brings it to all others.
            own = {taken, *(target for changed, target in skill.transitions(effect) if changed == name)}
            promised = {state for state in states & own if _leads_back(name, state, origins, space)}
            if promised:
                left |= promised
                labels.append(label)
        if left:
            message = (
                f"`{skill.name}` takes `{name}` and leaves it {' or '.join(sorted(left))} when it ends by "
                f"{' or '.join(labels)}; nothing brings it back to {' or '.join(sorted(origins))}."
            )
            if left == {taken}:
                advice = f"Apply an effect with `{name} -> {min(origins)}` there too."
            else:
                advice = f"Let a skill that can start then bring `{name}` from {min(left)} to {min(origins)}."
            report.add("SW080", skill.span, message, advice)


def _leads_back(name: str, state: str, origins: frozenset[str], space: StateSpace) -> bool:
    edges = ((edge.source, edge.target) for edge in space.resource(name).transitions)
    return bool(closure((state,), edges) & origins)
