"""The skill manager: the shell around `SkillCore`, and what developers of skills derive from."""

from __future__ import annotations

from skillwing.services.hooks import Goal, SkillHooks

__all__ = ["Goal", "SkillHooks"]
