"""Robots of a mission, as far as the mission is built for them and checked against them."""

from __future__ import annotations

from dataclasses import dataclass

from skillwing.dsl.model import Skillset
from skillwing.services.rescue_goal import RescueGoal


@dataclass(frozen=True, slots=True)
class RobotModel:
    """Skillset and rescue goal of a robot."""

    skillset: Skillset
    rescue_goal: RescueGoal | None = None
