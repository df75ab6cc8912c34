"""A robot that nobody commands where nobody should leave it: a drone in the air whose mission was killed."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import msgspec

from skillwing.dsl.model import Skillset
from skillwing.dsl.queries import could_start
from skillwing.services.client.connection import Target
from skillwing.services.diagnosis.consequences import causes, reactions_known
from skillwing.services.names import CLIENT, MISSION


class Unattended(msgspec.Struct, frozen=True, kw_only=True):
    """A state of a resource in which nobody should leave the robot. where: as the robot's table says it.

    ends_with: the skills that would bring it out of there and could start now; empty if none is known.
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
            return "Start the skill that brings it out of there."
        ways = " or ".join(f"`skillwing start {name}`" for name in self.ends_with)
        return f"End that with {ways}, or start what it is to do next."


def left_alone(
    target: Target, skillset: Skillset, states: Mapping[str, str], alive: Collection[str], running: Collection[str]
) -> tuple[Unattended, ...]:
    """The states in which a robot is left alone; none while a mission, or a client that owns goals, is there.

    As long as a skill has hold of it, or somebody else has, none that would bring it out of there could start. states:
    of the resources; alive: who holds an alive token; running: the skills that have a goal.
    """
    if MISSION in alive or any(name.startswith(CLIENT) for name in alive):
        return ()
    if not {resource.name for resource in skillset.resources} <= states.keys():
        return ()  # the manager has another version of the skillset, which is for others to tell
    found: list[Unattended] = []
    for resource in skillset.resources:
        name, state = resource.name, states[resource.name]
        told = target.not_to_be_left.get(name, {})
        if state not in told:
            continue
        others = [each for each in resource.states if each not in told]
        ways = causes(skillset, name, others, states, reactions_known(target.skillset, skillset))
        ready = [way for way in ways if way not in running and could_start(skillset.skill(way), skillset, states)]
        if ready or not (ways or running):
            where = told[state]
            found.append(
                Unattended(robot=target.robot, resource=name, state=state, where=where, ends_with=tuple(ready))
            )
    return tuple(found)
