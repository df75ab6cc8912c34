"""Text of `skillwing ready`: reasons why skills cannot start, and remedies."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

from skillwing.services.protocol import SkillReady
from skillwing.services.ready_reasons import reasons


def lines(skill: SkillReady, advice: Sequence[str] | None, trouble: str = "") -> Iterator[str]:
    """The lines of an answer about one skill.

    advice: as of `ready_advice`, which names holders; None for unknown. trouble: a sentence on its manager, if there is
    one without which no start succeeds.
    """
    yield f"{skill.skill} is ready." if skill.ready and not trouble else f"{skill.skill} is not ready."
    why = [*([trouble] if trouble else []), *reasons(skill, with_holders=advice is None)]
    yield from (f"  {sentence}" for sentence in (*why, *(advice or ()), *notes(skill)))


def notes(skill: SkillReady) -> Iterator[str]:
    """A sentence on the preconditions that the answer leaves open."""
    if skill.unchecked:
        names = ", ".join(skill.unchecked)
        yield f"Not checked without inputs: {names}. Give them: `skillwing ready {skill.skill} NAME=VALUE`."


def rows(skills: Iterable[SkillReady], troubles: Mapping[str, str]) -> list[tuple[str, str, str]]:
    """The rows of the table of all skills. troubles: sentences on managers, as in `lines`, by skill."""
    return [_row(skill, [troubles[skill.skill]] if skill.skill in troubles else []) for skill in skills]


def _row(skill: SkillReady, more: Sequence[str]) -> tuple[str, str, str]:
    ready = skill.ready and not more
    why = [*more, *reasons(skill)] or list(notes(skill))
    return skill.skill, "yes" if ready else "no", " ".join(why)
