"""Managers of the leases. A goal runs until it is interrupted, and has nothing to stop: the watch frees the place."""

from __future__ import annotations

from typing import Any, TypeAlias

from skillwing.services.managers.hooks import SkillHooks

Hold: TypeAlias = SkillHooks[Any, Any, Any]


class HoldPad(Hold):
    skill = "hold_pad"


class HoldCorridor(Hold):
    skill = "hold_corridor"


class HoldWay(Hold):
    skill = "hold_way"


class HoldCharger(Hold):
    skill = "hold_charger"
