"""Analysis of effects: transitions that a skill may not take, or that do not exist."""

from __future__ import annotations

from skillwing.dsl.checking.reachability.situations import Situations
from skillwing.dsl.checking.reachability.statespace import StateSpace
from skillwing.dsl.checking.wording import alternatives, possible_states, transitions_of
from skillwing.dsl.diagnostics.report import DiagnosticReport
from skillwing.dsl.model import Effect
from skillwing.dsl.spans import Span


class EffectAnalysis:
    """The analysis of the effects of one skill. always: all situations of the skillset."""

    def __init__(self, space: StateSpace, always: Situations, report: DiagnosticReport) -> None:
        self._space = space
        self._always = always
        self._report = report
        self._judged_wrong: set[Span] = set()

    def judge(self, effect: Effect, situations: Situations, when: str) -> None:
        """Report an effect that can never apply. situations: those in which it is applied; when: the same in words."""
        comes_about = not situations.empty
        possible = situations if comes_about else self._always
        wrong = self._judge_transitions(effect, possible, when, comes_about)
        if comes_about and not wrong and situations.able(self._space.changes(effect.transitions)).empty:
            message = f"`{effect.name}` can never apply {when}: its transitions are never open all at once."
            names = [name for name, _ in effect.transitions]
            self._add_once("SW042", effect.span, message, f"Then {possible_states(names, situations)}.")

    def judge_alone(self, effect: Effect, situations: Situations) -> None:
        """Report the transitions of an effect that no skill may take, wherever it is applied."""
        self._judge_transitions(effect, situations, "", False)

    def _judge_transitions(self, effect: Effect, situations: Situations, when: str, comes_about: bool) -> bool:
        places = list(zip(effect.transitions, effect.spans, strict=True))
        wrong = [
            self._judge_transition(effect, *place, situations.states(place[0][0]), when, comes_about)
            for place in places
        ]
        return any(wrong)

    def _judge_transition(
        self, effect: Effect, change: tuple[str, str], span: Span, states: frozenset[str], when: str, comes_about: bool
    ) -> bool:
        """Report a transition that cannot be taken from any of the states.

        Return whether it was reported, or left open because of an error elsewhere.
        """
        name, target = change
        resource = self._space.resource(name)
        into = [edge for edge in resource.transitions if edge.target == target]
        if states <= {target} or any(edge.source in states and not edge.extern for edge in into):
            return False
        open_to_skills = not all(edge.extern for edge in into)
        if any(edge.source in states and edge.extern for edge in into):
            if open_to_skills and name in self._space.unconstrained:
                return True  # The states are too many: the resource may only be where the skill may move it.
            message = (
                f"`{effect.name}` drives `{name} -> {target}`, which is extern: only the functional layer may take it."
            )
            advice = "Remove it from the effect, or declare the transition without `extern`."
            self._add_once("SW040", span, message, advice)
        elif target in states:
            return False  # It can only ever find the resource there already, which changes nothing.
        elif not open_to_skills:
            message = f"`{name}` has no transition to `{target}` that a skill may take."
            self._add_once(
                "SW041",
                span,
                message,
                f"{transitions_of(resource)} Add `{min(states)} -> {target}`, or name another state.",
            )
        elif comes_about:
            message = (
                f"`{effect.name}` can never apply {when}: "
                f"`{name}` is then {alternatives(states)}, with no transition to `{target}`."
            )
            advice = f"{transitions_of(resource)} Add `{min(states)} -> {target}`, or name another state."
            self._add_once("SW042", span, message, advice)
        return True

    def _add_once(self, code: str, span: Span | None, message: str, advice: str) -> None:
        """Report an effect that several ends apply only once."""
        if span is None or span not in self._judged_wrong:
            if span is not None:
                self._judged_wrong.add(span)
            self._report.add(code, span, message, advice)
