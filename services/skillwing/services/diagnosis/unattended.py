"""Unattended robots: away from their rescue goal, for example after their mission was killed."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import msgspec

from skillwing.dsl.model import Skillset
from skillwing.dsl.queries import could_start
from skillwing.services.client.connection import Target
from skillwing.services.names import CLIENT, MISSION


class Unattended(msgspec.Struct, frozen=True, kw_only=True):
    """A robot away from its rescue goal that nobody commands. where: words of the robot's table.

    ends_with: the skill that leads to the goal, and can start now.
    """

    robot: str
    resource: str
    state: str
    where: str
    ends_with: str

    @property
    def what(self) -> str:
        return f"{self.robot} is {self.where}, and nobody commands it."

    @property
    def remedy(self) -> str:
        return f"End that with `skillwing start {self.ends_with}`, or start its next skill."


def unattended_state(
    target: Target, skillset: Skillset, states: Mapping[str, str], alive: Collection[str], running: Collection[str]
) -> Unattended | None:
    """The state in which a robot is unattended; None during a mission, or with a client that owns goals.

    While a skill or a person holds the robot, the skill that leads to the goal could not start: nothing is reported.
    states: of the resources. alive: holders of alive tokens. running: skills with a goal.
    """
    goal = target.rescue_goal
    if (
        goal is None
        or any(goal.problems(skillset))
        or MISSION in alive
        or any(name.startswith(CLIENT) for name in alive)
    ):
        return None
    if not {resource.name for resource in skillset.resources} <= states.keys():
        return None  # the manager has another version of the skillset, which `doctor` reports
    state = states[goal.resource]
    if state not in goal.away or goal.skill in running:
        return None
    if not could_start(skillset.skill(goal.skill), skillset, states):
        return None
    return Unattended(
        robot=target.robot, resource=goal.resource, state=state, where=goal.away[state], ends_with=goal.skill
    )
