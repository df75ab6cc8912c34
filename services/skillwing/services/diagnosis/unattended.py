"""Unattended robots: a drone in the air, for example, whose mission was killed."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import msgspec

from skillwing.dsl.model import Skillset
from skillwing.dsl.queries import could_start
from skillwing.services.client.connection import Target
from skillwing.services.diagnosis.consequences import causes, reactions_known
from skillwing.services.names import CLIENT, MISSION


class Unattended(msgspec.Struct, frozen=True, kw_only=True):
    """A state of a resource in which nobody should leave the robot. where: words of the robot's table.

    ends_with: skills that would end that state and could start now; empty if none is known.
    """

    robot: str
    resource: str
    state: str
    where: str
    ends_with: tuple[str, ...] = ()

    @property
    def what(self) -> str:
        return f"{self.robot} is {self.where}, and nobody commands it."

    @property
    def remedy(self) -> str:
        if not self.ends_with:
            return "Start the skill that ends that."
        ways = " or ".join(f"`skillwing start {name}`" for name in self.ends_with)
        return f"End that with {ways}, or start its next skill."


def unattended_states(
    target: Target, skillset: Skillset, states: Mapping[str, str], alive: Collection[str], running: Collection[str]
) -> tuple[Unattended, ...]:
    """The states in which a robot is unattended; none during a mission, or with a client that owns goals.

    While a skill or the safety pilot holds the robot, no skill that would end the state could start, and nothing is
    reported. states: of the resources. alive: holders of alive tokens. running: skills with a goal.
    """
    if MISSION in alive or any(name.startswith(CLIENT) for name in alive):
        return ()
    if not {resource.name for resource in skillset.resources} <= states.keys():
        return ()  # the manager has another version of the skillset, which `doctor` reports
    found: list[Unattended] = []
    for resource in skillset.resources:
        name, state = resource.name, states[resource.name]
        words = target.not_to_be_left.get(name, {})
        if state not in words:
            continue
        others = [each for each in resource.states if each not in words]
        ways = causes(skillset, name, others, states, reactions_known(target.skillset, skillset))
        ready = [way for way in ways if way not in running and could_start(skillset.skill(way), skillset, states)]
        if ready or not (ways or running):
            where = words[state]
            found.append(
                Unattended(robot=target.robot, resource=name, state=state, where=where, ends_with=tuple(ready))
            )
    return tuple(found)
