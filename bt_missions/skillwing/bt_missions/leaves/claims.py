"""Resources that a skill takes and needs, by its model."""

from __future__ import annotations

from skillwing.dsl.expressions import names_used
from skillwing.dsl.model import Skillset


def taken_by(skillset: Skillset, skill: str) -> dict[str, str]:
    """Resources that a goal of `skill` brings into a state at its start, and brings back when it ends."""
    model = skillset.skill(skill)
    return dict(model.transitions(model.preconditions.success))


def needed_by(skillset: Skillset, skill: str) -> frozenset[str]:
    """Resources whose states decide whether `skill` may start."""
    return frozenset[str]().union(*checks_of(skillset, skill).values())


def checks_of(skillset: Skillset, skill: str) -> dict[str, frozenset[str]]:
    """The resources that each precondition of `skill` names, by the name of the precondition."""
    checks = skillset.skill(skill).preconditions.checks
    return {check.name: names_used(check.expression, "resource") for check in checks}
