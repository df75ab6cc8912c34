"""Resolution of syntax nodes into the model: the meaning of each name, the type of each element.

The order follows the dependencies: types, data, resources, then events and skills.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeVar

from skillwing.dsl.checking.declarations import Declarations
from skillwing.dsl.checking.skill_resolver import resolve_skill
from skillwing.dsl.diagnostics.report import DiagnosticReport
from skillwing.dsl.model import Event, Skill, Skillset
from skillwing.dsl.naming import class_name
from skillwing.dsl.reading import syntax
from skillwing.dsl.spans import Word

_Element = TypeVar("_Element")


def resolve(root: syntax.SkillsetSyntax, report: DiagnosticReport) -> Skillset:
    """Build the model. Problems go to the report; the model then lacks the parts without a meaning."""
    report.diagnostics += root.remarks
    return _Resolver(root, report).skillset()


class _Resolver:
    def __init__(self, root: syntax.SkillsetSyntax, report: DiagnosticReport) -> None:
        self._root = root
        self._report = report
        self._declarations = Declarations(root, report)

    def skillset(self) -> Skillset:
        root = self._root
        self._report.declare({}, root.name, "skillset")
        events, skills = tuple(self._events()), tuple(self._skills())
        self._colliding_classes()
        self._unused_types()
        return Skillset(
            name=root.name.text,
            types=self._declarations.types.all,
            data=tuple(self._declarations.data.values()),
            resources=tuple(self._declarations.resources.values()),
            events=events,
            skills=skills,
            span=root.name.span,
        )

    def _elements(self, kind: type[_Element]) -> Iterator[_Element]:
        return (element for element in self._root.elements if isinstance(element, kind))

    # --- events

    def _events(self) -> Iterator[Event]:
        seen: dict[str, Word] = {}
        predicates = self._declarations.predicates()
        for declaration in self._elements(syntax.EventSyntax):
            self._report.declare(seen, declaration.name, "event")
            guards = [item for item in declaration.items if isinstance(item, syntax.GuardSyntax)]
            blocks = [item for item in declaration.items if isinstance(item, syntax.EventEffectSyntax)]
            for extra in guards[1:]:
                message = f"The event `{declaration.name.text}` has two guards."
                self._report.add("SW017", extra.predicate.span, message, "Join them with `and`.")
            changes = tuple(change for block in blocks for change in block.changes)
            name = declaration.name
            guard = predicates.resolve(guards[0].predicate) if guards else None
            yield Event(name.text, guard, self._declarations.effect(syntax.EffectSyntax(name, changes)), name.span)

    # --- skills

    def _skills(self) -> Iterator[Skill]:
        seen: dict[str, Word] = {}
        for declaration in self._elements(syntax.SkillSyntax):
            self._report.declare(seen, declaration.name, "skill")
            yield resolve_skill(declaration, self._declarations)

    # --- across the file

    def _colliding_classes(self) -> None:
        """Report different names that would become one Python class in generated code."""
        named = [element.name for element in self._elements(syntax.StructSyntax)]
        named += [element.name for element in self._elements(syntax.EnumSyntax)]
        classes = [(class_name(name.text), name) for name in named]
        for skill in self._elements(syntax.SkillSyntax):
            stem = class_name(skill.name.text)
            classes += [(stem + suffix, skill.name) for suffix in ("Inputs", "Outputs", "Feedback", "Result")]
        resources = self._elements(syntax.ResourceSyntax)
        classes += [(class_name(resource.name.text) + "State", resource.name) for resource in resources]
        seen: dict[str, Word] = {}
        for name, word in classes:
            first = seen.setdefault(name, word)
            if first.text != word.text:
                message = f"`{word.text}` and `{first.text}` would both become the class `{name}`."
                self._report.add("SW019", word.span, message, "Rename one of them.", (first.span, "the other one"))
                return

    def _unused_types(self) -> None:
        for declared in () if self._root.is_library else self._declarations.types.all:
            if declared.name not in self._declarations.types.used:
                message = f"Nothing has the type `{declared.name}`."
                self._report.add("SW083", declared.span, message, "Use it or remove it.")
