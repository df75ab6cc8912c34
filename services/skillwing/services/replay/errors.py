"""What can be wrong with steps that were written down."""

from __future__ import annotations

from skillwing.services.errors import SkillwingError


class BadStepsError(SkillwingError):
    """Files of steps that are not there, are damaged, or mean something else to this Skillwing."""
