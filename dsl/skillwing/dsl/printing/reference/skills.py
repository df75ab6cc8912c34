"""The part of a reference page that describes a skill."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

from skillwing.dsl.expressions import literal_text
from skillwing.dsl.model import EnumType, Field, Skill, Skillset
from skillwing.dsl.printing.reference.descriptions import Descriptions
from skillwing.dsl.printing.reference.markdown import code, prose, table
from skillwing.dsl.printing.reference.words import Units, changes, in_words, range_in_words, type_in_words, units_of


class SkillSection:
    """Writer of the sections of skills. link: makes the link to a declared type."""

    def __init__(self, skillset: Skillset, described: Descriptions, link: Callable[[str], str]) -> None:
        self._skillset = skillset
        self._described = described
        self._link = link

    def lines(self, skill: Skill) -> Iterator[str]:
        units = units_of(self._skillset.data, skill.inputs)
        yield f"### skill {skill.name}"
        yield ""
        yield from prose(self._described.of(skill.span))
        yield from self.fields("Input", skill.inputs)
        yield from self._start(skill, units)
        yield from self._run(skill, units)
        yield from self._end(skill, units)
        yield from self.fields("Output", skill.outputs)

    def fields(self, head: str, fields: Iterable[Field]) -> Iterator[str]:
        """A table of fields."""
        rows = [
            (
                code(field.name),
                type_in_words(field.type, self._link) + (", modifiable" if field.modifiable else ""),
                field.unit or "",
                range_in_words(field),
                _default(field),
                self._described.of(field.span),
            )
            for field in fields
        ]
        yield from table((head, "Type", "Unit", "Range", "Default", "Meaning"), rows)

    def _start(self, skill: Skill, units: Units) -> Iterator[str]:
        conditions = skill.preconditions
        rows = [
            (code(check.name), in_words(check.expression, units), self._described.of(check.span))
            for check in conditions.checks
        ]
        yield from table(("To start", "It has to hold that", "Meaning"), rows)
        if taken := skill.transitions(conditions.success):
            yield f"With the start, in one step: {changes(taken)}."
            yield ""
        if given := skill.transitions(conditions.failure):
            yield f"When it is not ready: {changes(given)}."
            yield ""

    def _run(self, skill: Skill, units: Units) -> Iterator[str]:
        rows = [
            (
                code(invariant.name),
                in_words(invariant.expression, units),
                changes(skill.transitions(invariant.violation)),
                self._described.of(invariant.span),
            )
            for invariant in skill.invariants
        ]
        yield from table(("While it runs", "It has to hold that", "Otherwise it ends, and", "Meaning"), rows)
        if skill.progress_period is not None:
            yield from self.fields(f"Feedback, each {skill.progress_period:g} s", skill.feedback)

    def _end(self, skill: Skill, units: Units) -> Iterator[str]:
        rows = [
            (
                code(result.name),
                "success" if result.success else "failure",
                changes(skill.transitions(result.apply)),
                "" if result.post is None else in_words(result.post, units),
                self._described.of(result.span),
            )
            for result in skill.results
        ]
        stopped = f"interrupted, forced after {skill.interrupt.timeout:g} s"
        rows.append((stopped, "", changes(skill.transitions(skill.interrupt.apply)), "", ""))
        rows.append(("its manager is lost", "", changes(skill.transitions(skill.lost)), "", ""))
        yield from table(("It ends", "As a", "Then", "And it has to hold that", "Meaning"), rows)
        if skill.deadline is not None:
            yield f"It is interrupted if it has not ended after {skill.deadline:g} s."
            yield ""


def _default(field: Field) -> str:
    if field.default is None:
        return ""
    return code(str(field.default) if isinstance(field.type, EnumType) else literal_text(field.default))
