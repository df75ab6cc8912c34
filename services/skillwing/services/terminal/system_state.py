"""What is known of a running system, by which it is told how a refused skill can be made to start."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, TypeAlias

from skillwing.dsl import UnknownNameError
from skillwing.services.bus.reading import message_reader
from skillwing.services.diagnosis.consequences import reactions_known
from skillwing.services.errors import InvalidOptionError, RefusedError, UnansweredError
from skillwing.services.names import CLIENT, DATA_MANAGER, MISSION, MOCKED_WORLD, RESOURCE_MANAGER, skill_process
from skillwing.services.processes.launcher import ROUTER
from skillwing.services.protocol import (
    DataReading,
    MissionStatus,
    QueryData,
    QueryStates,
    Record,
    RecordKind,
    ResourceStates,
    State,
)
from skillwing.services.robot import RECORDER, find_robot

if TYPE_CHECKING:
    from skillwing.services.mocking.script import Reaction
    from skillwing.services.terminal.connection import System

LATE_WORD = 1.0
"""Wall seconds in which has to come what was published before we listened."""

Reporter: TypeAlias = Literal["robot", "mock", "nobody"]
"""Who stands below the managers and reports the states that skills do not change."""


@dataclass(frozen=True)
class Situation:
    """A system as it is now.

    states: of the resources. running: the skills that run, with the name of the mission that has started them, None
    for anybody else. unheard: data that were never received. published_by: as in the robot's table. reactions: what a
    mock of this robot does, which tells what follows from its skills.
    """

    robot: str
    reporter: Reporter
    states: Mapping[str, str]
    running: Mapping[str, str | None]
    unheard: Collection[str] = ()
    published_by: Mapping[str, tuple[str, ...]] = field(default_factory=dict[str, tuple[str, ...]])
    reactions: tuple[Reaction, ...] = ()


def situation(system: System) -> Situation:
    """Raises UnansweredError and RefusedError where nobody tells how the resources are."""
    states = system.ask(system.keys.resource_states, QueryStates(), ResourceStates).states
    alive = system.alive()
    unheard = _unheard(system)
    silent = len(unheard) == len(system.skillset.data)
    return Situation(
        robot=system.target.robot,
        reporter=_reporter(system, alive, silent=silent),
        states=states,
        running=running_skills(system, alive),
        unheard=unheard,
        published_by=_published_by(system),
        reactions=reactions_known(system.target.skillset, system.skillset),
    )


def running_skills(system: System, alive: Collection[str]) -> dict[str, str | None]:
    """As in `Situation`. alive: who holds an alive token."""
    askers: dict[str, str] = {}
    missions: list[str] = []

    def on_record(record: Record) -> None:
        if record.kind is RecordKind.GOAL and record.after == State.VALIDATING and record.goal_id is not None:
            askers[record.goal_id] = record.text

    system.bus.subscribe(system.keys.timeline, message_reader(Record, on_record), events=True)
    system.bus.subscribe(
        system.keys.mission_status,
        message_reader(MissionStatus, lambda told: missions.append(told.mission)),
        events=True,
    )
    skills = [skill.name for skill in system.skillset.skills if skill_process(skill.name) in alive]
    statuses = [status for status in map(system.goal, skills) if status and status.state is not State.TERMINATED]
    if MISSION not in alive:
        return dict.fromkeys(status.skill for status in statuses)
    system.bus.run_until(lambda: bool(missions) and all(status.goal_id in askers for status in statuses), LATE_WORD)
    by_mission = [status.skill for status in statuses if askers.get(status.goal_id) == f"asked by {MISSION}"]
    name = missions[-1] if missions else "unknown"
    return {status.skill: name if status.skill in by_mission else None for status in statuses}


def _unheard(system: System) -> list[str]:
    try:
        readings = [system.ask(system.keys.data(item.name), QueryData(), DataReading) for item in system.skillset.data]
    except (UnansweredError, RefusedError):
        return []
    return [reading.name for reading in readings if reading.t is None]


def _published_by(system: System) -> Mapping[str, tuple[str, ...]]:
    try:
        return find_robot(system.target.robot).published_by
    except (UnknownNameError, InvalidOptionError):
        return {}


def _reporter(system: System, alive: Collection[str], *, silent: bool) -> Reporter:
    """silent: no data have come at all. A process that we do not know may be a bridge, and is taken for one."""
    states = [entry.state for entry in system.entries(alive)]
    names = {name for state in states for name in (state.nodes or (state.name,))}
    if MOCKED_WORLD in names:
        return "mock"
    skills = {skill_process(skill.name) for skill in system.skillset.skills}
    above = {ROUTER, DATA_MANAGER, RESOURCE_MANAGER, RECORDER, MISSION, *skills}
    below = {name for name in names if name not in above and not name.startswith(CLIENT)}
    return "nobody" if silent and not below else "robot"
