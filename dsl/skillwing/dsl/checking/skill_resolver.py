"""Resolution of one skill: its effects, guards, results and ends."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TypeVar, get_args

from skillwing.dsl.checking.declarations import Declarations
from skillwing.dsl.checking.results import marked_as_meant
from skillwing.dsl.diagnostics.report import DiagnosticReport
from skillwing.dsl.expressions import Expression, names_used
from skillwing.dsl.model import (
    DEFAULT_DISPATCH_TIMEOUT,
    DEFAULT_INTERRUPT_TIMEOUT,
    Effect,
    Interrupt,
    Invariant,
    OwnerPolicy,
    Precondition,
    Predicate,
    Result,
    Skill,
)
from skillwing.dsl.queries import unapplied_effects
from skillwing.dsl.reading import syntax
from skillwing.dsl.spans import Word
from skillwing.dsl.suggest import listed

_Named = TypeVar(
    "_Named", syntax.FieldSyntax, syntax.EffectSyntax, syntax.CheckSyntax, syntax.InvariantSyntax, syntax.ResultSyntax
)

_NO_RELEASE = "Declare an effect that gives back what the start takes, and write `interrupt { apply=EFFECT }` with it."

_FIXED = "Remove `modifiable`, or judge a modification in `validate`: conditions keep the inputs of the start."

_OWNER_POLICIES: Mapping[str, OwnerPolicy] = {policy: policy for policy in get_args(OwnerPolicy)}


def resolve_skill(declaration: syntax.SkillSyntax, declarations: Declarations) -> Skill:
    """Build the model of a skill. Problems go to the report of the declarations."""
    return _SkillResolver(_sections(declaration, declarations.report), declarations).skill(declaration.name)


def _sections(declaration: syntax.SkillSyntax, report: DiagnosticReport) -> dict[str, syntax.Section]:
    """The sections by keyword. Of one that is given twice, both are read, and names of the first hide others."""
    sections: dict[str, syntax.Section] = {}
    for section in declaration.sections:
        word = section.keyword
        first = sections.setdefault(word.text, section)
        if first is not section:
            message = f"The skill `{declaration.name.text}` has `{word.text}` twice."
            related = (first.keyword.span, "first given here")
            report.add("SW017", word.span, message, "Merge the two.", related)
            sections[word.text] = _merged(first, section)
    return sections


def _merged(first: syntax.Section, second: syntax.Section) -> syntax.Section:
    match first, second:
        case syntax.FieldsSection(), syntax.FieldsSection():
            return replace(first, fields=_joined(first.fields, second.fields))
        case syntax.EffectSection(), syntax.EffectSection():
            return replace(first, effects=_joined(first.effects, second.effects))
        case syntax.PreconditionSection(), syntax.PreconditionSection():
            success, failure = first.success or second.success, first.failure or second.failure
            return replace(first, checks=_joined(first.checks, second.checks), success=success, failure=failure)
        case syntax.InvariantSection(), syntax.InvariantSection():
            return replace(first, invariants=_joined(first.invariants, second.invariants))
        case syntax.ResultSection(), syntax.ResultSection():
            return replace(first, results=_joined(first.results, second.results))
        case _:
            return first


def _joined(first: tuple[_Named, ...], second: tuple[_Named, ...]) -> tuple[_Named, ...]:
    names = {item.name.text for item in first}
    return (*first, *(item for item in second if item.name.text not in names))


def _conditions(skill: Skill) -> Iterator[tuple[str, Expression]]:
    """The preconditions, invariants and postconditions of a skill by name; a postcondition has its result's."""
    yield from ((check.name, check.expression) for check in skill.preconditions.checks)
    yield from ((invariant.name, invariant.expression) for invariant in skill.invariants)
    yield from ((result.name, result.post) for result in skill.results if result.post is not None)


class _SkillResolver:
    """The resolver of one skill. sections: by keyword, each at most once."""

    def __init__(self, sections: dict[str, syntax.Section], whole: Declarations) -> None:
        self._sections = sections
        self._whole = whole
        self._report = whole.report
        self._effects: dict[str, Effect] = {}
        self._misnamed_effect = False
        self._inputs = whole.fields(sections.get("input"), "input")
        self._predicates = whole.predicates(self._inputs)

    def skill(self, name: Word) -> Skill:
        whole, sections = self._whole, self._sections
        self._declare_effects()
        progress = sections.get("progress")
        results = self._results(name)
        interrupt = self._interrupt(name, results)
        lost = sections.get("lost")
        applies = lost.applies if isinstance(lost, syntax.EndSection) else ()
        skill = Skill(
            name=name.text,
            progress_period=self._limit("progress"),
            feedback=whole.fields(progress, "feedback field"),
            inputs=self._inputs,
            outputs=whole.fields(sections.get("output"), "output"),
            effects=tuple(self._effects.values()),
            preconditions=self._preconditions(),
            invariants=tuple(self._invariants()),
            results=results,
            interrupt=interrupt,
            lost=self._effect_name(applies[0].effect) if applies else interrupt.apply,
            deadline=self._limit("deadline"),
            dispatch_timeout=self._limit("dispatch_timeout") or DEFAULT_DISPATCH_TIMEOUT,
            owner_lost=self._owner_policy(),
            span=name.span,
        )
        self._missing_interrupt(skill)
        self._fixed_inputs(skill)
        self._unused_effects(skill)
        return skill

    def _limit(self, keyword: str) -> float | None:
        section = self._sections.get(keyword)
        match section:
            case syntax.LimitSection(seconds=number) | syntax.ProgressSection(period=number):
                return self._whole.seconds(number, "period" if keyword == "progress" else keyword)
            case _:
                return None

    def _owner_policy(self) -> OwnerPolicy:
        section = self._sections.get("owner_lost")
        if not isinstance(section, syntax.PolicySection):
            return "interrupt"
        word = section.policy
        if word.text not in _OWNER_POLICIES:
            self._report.unknown("SW015", word, "policy for a lost owner", _OWNER_POLICIES)
        return _OWNER_POLICIES.get(word.text, "interrupt")

    def _fixed_inputs(self, skill: Skill) -> None:
        """Report modifiable inputs in predicates. These are judged with the inputs of the start."""
        section = self._sections.get("input")
        fields = section.fields if isinstance(section, syntax.FieldsSection) else ()
        words = {item.name.text: item.modifiable for item in fields if item.modifiable is not None}
        for name, word in words.items():
            users = [subject for subject, guard in _conditions(skill) if name in names_used(guard, "input")]
            if users:
                message = f"{listed(users)} of `{skill.name}` {'name' if users[1:] else 'names'} `{name}`."
                self._report.add("SW056", word.span, f"{message} It cannot be modifiable.", _FIXED)

    # --- effects

    def _declare_effects(self) -> None:
        section = self._sections.get("effect")
        if not isinstance(section, syntax.EffectSection):
            return
        seen: dict[str, Word] = {}
        for declaration in section.effects:
            effect = self._whole.effect(declaration)
            if self._report.declare(seen, declaration.name, "effect"):
                self._effects[effect.name] = effect

    def _effect_name(self, word: Word | None) -> str | None:
        if word is None or word.text in self._effects:
            return None if word is None else word.text
        self._misnamed_effect = True
        self._report.unknown("SW012", word, "effect", self._effects)
        return None

    def _unused_effects(self, skill: Skill) -> None:
        if self._misnamed_effect:
            return
        for effect in unapplied_effects(skill):
            message = f"Nothing in `{skill.name}` applies the effect `{effect.name}`."
            self._report.add("SW081", effect.span, message, "Apply it or remove it.")

    # --- guards

    def _preconditions(self) -> Precondition:
        section = self._sections.get("precondition")
        if not isinstance(section, syntax.PreconditionSection):
            return Precondition()
        seen: dict[str, Word] = {}
        checks: list[Predicate] = []
        for check in section.checks:
            expression = self._predicates.resolve(check.predicate)
            if self._report.declare(seen, check.name, "precondition") and expression is not None:
                checks.append(Predicate(check.name.text, check.predicate.kind, expression, check.name.span))
        for which, words in (("success", section.success), ("failure", section.failure)):
            for extra in words[1:]:
                message = f"There are two `{which}` effects here."
                self._report.add("SW017", extra.span, message, "Join them in one effect, `e { a -> X  b -> Y }`.")
        success = self._effect_name(section.success[0]) if section.success else None
        failure = self._effect_name(section.failure[0]) if section.failure else None
        return Precondition(tuple(checks), success, failure)

    def _invariants(self) -> Iterator[Invariant]:
        section = self._sections.get("invariant")
        if not isinstance(section, syntax.InvariantSection):
            return
        seen: dict[str, Word] = {}
        for item in section.invariants:
            expression = self._predicates.resolve(item.predicate)
            violation = self._effect_name(item.violation)
            if self._report.declare(seen, item.name, "invariant") and expression is not None:
                yield Invariant(item.name.text, item.predicate.kind, expression, violation, item.name.span)

    # --- ends

    def _results(self, skill: Word) -> tuple[Result, ...]:
        section = self._sections.get("result")
        if not isinstance(section, syntax.ResultSection):
            return ()
        items = marked_as_meant(section.results, self._report)
        marked = {item.partition for item in items if item.partition is not None}
        missing = "success" if marked == {"failure"} else "failure"
        for item in items if marked else ():
            if item.partition is None:
                message = f"`{item.name.text}` is neither `success` nor `failure`, other results of `{skill.text}` are."
                self._report.add("SW062", item.name.span, message, f"Write `{missing} {item.name.text}: ...`.")
        seen: dict[str, Word] = {}
        results: list[Result] = []
        for item in items:
            apply = self._effect_name(item.apply.effect) if item.apply else None
            post = self._predicates.resolve(item.post) if item.post else None
            if self._report.declare(seen, item.name, "result"):
                success = item.partition == "success" if marked else not results
                results.append(Result(item.name.text, success, apply, post, item.name.span))
        return tuple(results)

    def _interrupt(self, skill: Word, results: tuple[Result, ...]) -> Interrupt:
        section = self._sections.get("interrupt")
        given = section if isinstance(section, syntax.EndSection) else None
        timeouts = [self._whole.seconds(number, "timeout") for number in given.timeouts] if given else []
        timeout = timeouts[0] if timeouts else DEFAULT_INTERRUPT_TIMEOUT
        for extra in (*given.applies[1:], *given.timeouts[1:]) if given else ():
            span = extra.span if isinstance(extra, syntax.Number) else extra.effect.span
            self._report.add(
                "SW017", span, f"The `interrupt` of `{skill.text}` says this twice.", "Keep one of the two."
            )
        if given is not None and given.applies:
            return Interrupt(self._effect_name(given.applies[0].effect), timeout)
        agreed = {result.apply for result in results}
        return Interrupt(agreed.pop() if len(agreed) == 1 else None, timeout)

    def _missing_interrupt(self, skill: Skill) -> None:
        """Report a missing interrupt effect. It may be omitted if all results agree on one effect."""
        section = self._sections.get("interrupt")
        if self._misnamed_effect or (isinstance(section, syntax.EndSection) and section.applies):
            return
        differ = len({result.apply for result in skill.results}) > 1
        takes = bool(skill.transitions(skill.preconditions.success))
        if differ or (takes and not skill.results):
            reason = "its results apply different effects" if differ else "it takes resources and has no result"
            message = f"`{skill.name}` does not say what an interruption applies, and {reason}."
            # The start effect would keep what the interrupted goal held.
            releasing = [name for name in self._effects if name != skill.preconditions.success]
            choices = " or ".join(f"`interrupt {{ apply={name} }}`" for name in releasing)
            advice = f"Write {choices}." if releasing else _NO_RELEASE
            self._report.add("SW060", skill.span, message, advice)
