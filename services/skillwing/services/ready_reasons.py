"""Reasons why a skill is not ready, as sentences: the same for every command and every leaf."""

from __future__ import annotations

from collections.abc import Iterator

from skillwing.services.protocol import Holder, SkillReady


def reasons(skill: SkillReady, *, with_holders: bool = True) -> Iterator[str]:
    """A sentence for each thing that keeps a skill from a start, and for each goal that holds a missing resource."""
    if skill.running is not None:
        yield f"The skill runs {goal_text(skill.running)}."
    yield from skill.inputs.values()
    for check in skill.failing:
        yield f"{check.name}: {check.reason}"
        if with_holders:
            yield from (f"{holding(each.resource, each.holder)}." for each in check.missing if each.holder)


def holding(resource: str, holder: Holder, mission: str | None = None) -> str:
    """A clause on the goal that holds a resource. mission: name of the mission that started it, if that is known."""
    return f"`{holder.skill}` holds `{resource}` for {goal_text(holder, mission)}"


def goal_text(holder: Holder, mission: str | None = None) -> str:
    """A goal by its mission if that is known, else by its id and its client."""
    if mission is not None:
        return f"mission `{mission}`"
    return f"goal {holder.goal_id}" + (f" of {holder.owner}" if holder.owner else "")
