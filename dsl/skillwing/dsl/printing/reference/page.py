"""The whole reference page of a skillset."""

from __future__ import annotations

from collections.abc import Iterator

from skillwing.dsl.checking.types import SCALARS
from skillwing.dsl.model import EnumType, Event, Resource, Skill, Skillset, StructType
from skillwing.dsl.printing.pictures.mermaid import to_mermaid
from skillwing.dsl.printing.pictures.subjects import resource_diagram
from skillwing.dsl.printing.reference.descriptions import Descriptions
from skillwing.dsl.printing.reference.markdown import code, link, prose, table
from skillwing.dsl.printing.reference.skills import SkillSection
from skillwing.dsl.printing.reference.words import changes, in_words, range_in_words, type_in_words, units_of
from skillwing.dsl.queries import changed_by, guarded_by


def reference_page(skillset: Skillset, text: str, file: str) -> str:
    """Return the page in Markdown.

    text: the source of the skillset, whose comments become descriptions. file: its name.
    """
    return "\n".join(_Page(skillset, Descriptions(text, file), file).lines()).rstrip("\n") + "\n"


def _link(name: str) -> str:
    """The name of a type, with a link to its description if the skillset declares it."""
    return code(name) if name in SCALARS else link(code(name), f"type {name}")


class _Page:
    def __init__(self, skillset: Skillset, described: Descriptions, file: str) -> None:
        self._skillset = skillset
        self._described = described
        self._file = file
        self._skills = SkillSection(skillset, described, _link)

    def lines(self) -> Iterator[str]:
        skillset = self._skillset
        yield f"<!-- Made from {self._file} by `skillwing docs`. Do not edit: change the skillset instead. -->"
        yield ""
        yield f"# The skillset {skillset.name}"
        yield ""
        yield from prose(self._described.of_file)
        yield from self._overview()
        if skillset.types:
            yield from ("## Types", "")
            for declared in skillset.types:
                yield from self._type(declared)
        if skillset.data:
            yield from ("## Data", "")
            yield from self._data()
        if skillset.resources:
            yield from ("## Resources", "")
            yield "Dashed transitions are `extern`: only the functional layer takes them."
            yield ""
            for resource in skillset.resources:
                yield from self._resource(resource)
        if skillset.events:
            yield from ("## Events", "")
            yield from self._events()
        if skillset.skills:
            yield from ("## Skills", "")
            for skill in skillset.skills:
                yield from self._skills.lines(skill)

    def _overview(self) -> Iterator[str]:
        rows = [
            (link(code(skill.name), f"skill {skill.name}"), self._summary(skill), _endings(skill))
            for skill in self._skillset.skills
        ]
        yield from table(("Skill", "Does", "Ends"), rows)

    def _summary(self, skill: Skill) -> str:
        """The first sentence of the description."""
        first, stop, _ = self._described.of(skill.span).replace("\n", " ").partition(". ")
        return first + stop.strip()

    def _type(self, declared: EnumType | StructType) -> Iterator[str]:
        yield f"### type {declared.name}"
        yield ""
        yield from prose(self._described.of(declared.span))
        if isinstance(declared, EnumType):
            yield f"One of {', '.join(map(code, declared.values))}."
            yield ""
        else:
            yield from self._skills.fields("Field", declared.fields)

    def _data(self) -> Iterator[str]:
        rows = [
            (
                code(item.name),
                type_in_words(item.type, _link),
                item.unit or "",
                range_in_words(item),
                "" if item.period is None else f"{item.period:g} s",
                "" if item.stale_after is None else f"{item.stale_after:g} s",
                self._described.of(item.span),
            )
            for item in self._skillset.data
        ]
        yield from table(("Datum", "Type", "Unit", "Range", "Published each", "Stale after", "Meaning"), rows)

    def _resource(self, resource: Resource) -> Iterator[str]:
        yield f"### resource {resource.name}"
        yield ""
        yield from prose(self._described.of(resource.span))
        yield from ("```mermaid", to_mermaid(resource_diagram(resource)).rstrip("\n"), "```", "")
        for verb, names in self._users(resource):
            if names:
                yield from (f"{verb} by {', '.join(map(code, names))}.", "")

    def _users(self, resource: Resource) -> Iterator[tuple[str, list[str]]]:
        """The skills that change the resource, and those that only read its state."""
        skills = self._skillset.skills
        changing = [skill.name for skill in skills if resource.name in changed_by(skill)]
        asking = [skill.name for skill in skills if resource.name in guarded_by(skill)]
        yield "Changed", changing
        yield "Asked for its state", [name for name in asking if name not in changing]

    def _events(self) -> Iterator[str]:
        rows = [
            (code(event.name), self._guard(event), changes(event.effect.transitions), self._described.of(event.span))
            for event in self._skillset.events
        ]
        yield from table(("Event", "Only if", "Then", "Meaning"), rows)

    def _guard(self, event: Event) -> str:
        return "" if event.guard is None else in_words(event.guard, units_of(self._skillset.data))


def _endings(skill: Skill) -> str:
    """The results. A skill without a success runs until it is interrupted."""
    names = [code(result.name) for result in skill.results]
    return ", ".join(names if any(result.success for result in skill.results) else [*names, "interrupted"])
