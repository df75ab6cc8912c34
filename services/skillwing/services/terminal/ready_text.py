"""Text of `skillwing ready`: reasons why skills cannot start, and remedies."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from skillwing.services.protocol import FailingCheck, Holder, MissingState, SkillReady


def reasons(skill: SkillReady) -> Iterator[str]:
    """A sentence for each thing that keeps a skill from a start."""
    if skill.running is not None:
        yield f"The skill runs {goal_text(skill.running)}."
    yield from skill.inputs.values()
    yield from (f"{check.name}: {check.reason}" for check in skill.failing)


def holders(check: FailingCheck) -> Iterator[str]:
    """A sentence for each resource of a failing precondition that a goal holds."""
    for missing in check.missing:
        if (holder := missing.holder) is not None:
            text = f"`{holder.skill}` holds `{missing.resource}` for {goal_text(holder)}"
            yield f"{check.name}: {text}; `skillwing interrupt {holder.skill}` ends it."


def events(check: FailingCheck) -> Iterator[str]:
    """A sentence for each event that could be fired now."""
    for missing in check.missing:
        for event in missing.events:
            yield f"{check.name}: the event `{event}` brings `{missing.resource}` to {_wanted(missing)}."


def unheld(skill: SkillReady) -> list[str]:
    """Names of the failing preconditions in which no goal holds a resource."""
    return [check.name for check in skill.failing if not any(missing.holder for missing in check.missing)]


def notes(skill: SkillReady) -> Iterator[str]:
    """A sentence on the preconditions that the answer leaves open."""
    if skill.unchecked:
        names = ", ".join(skill.unchecked)
        yield f"Not checked without inputs: {names}. Give them: `skillwing ready {skill.skill} NAME=VALUE`."


def goal_text(holder: Holder) -> str:
    """A goal and its client."""
    return f"goal {holder.goal_id}" + (f" of {holder.owner}" if holder.owner else "")


def lines(skill: SkillReady, advice: Sequence[str] = ()) -> Iterator[str]:
    """The lines of an answer about one skill. advice: on the preconditions of `unheld`."""
    yield f"{skill.skill} is ready." if skill.ready else f"{skill.skill} is not ready."
    yield from (f"  {sentence}" for sentence in reasons(skill))
    for check in skill.failing:
        yield from (f"  {sentence}" for sentence in (*holders(check), *events(check)))
    yield from (f"  {sentence}" for sentence in (*advice, *notes(skill)))


def rows(skills: Iterable[SkillReady], unmanaged: Iterable[str]) -> list[tuple[str, str, str]]:
    """The rows of the table of all skills. unmanaged: skills without a manager."""
    gone = set(unmanaged)
    return [_row(skill, ["No manager of it runs."] if skill.skill in gone else []) for skill in skills]


def _row(skill: SkillReady, more: Sequence[str]) -> tuple[str, str, str]:
    ready = skill.ready and not more
    why = [*more, *reasons(skill)] or list(notes(skill))
    return skill.skill, "yes" if ready else "no", " ".join(why)


def _wanted(missing: MissingState) -> str:
    return " or ".join(missing.wanted)
