"""State of a running system: the facts from which advice on a skill that may not start is made."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, TypeAlias

from skillwing.dsl import UnknownNameError
from skillwing.services.bus.reading import message_reader
from skillwing.services.client.causal_feed import follow_records
from skillwing.services.diagnosis.consequences import reactions_known
from skillwing.services.errors import InvalidOptionError, NoReplyError, RefusedError
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

LATE_MESSAGES = 1.0
"""Wall seconds in which messages from before the subscription arrive."""

Reporter: TypeAlias = Literal["robot", "mock", "nobody"]
"""Source of the states that skills do not change: the robot, a mock of it, or nobody."""


@dataclass(frozen=True)
class RunningMission:
    """A mission that runs. rescue: as in its status."""

    name: str
    rescue: str = ""


@dataclass(frozen=True)
class SystemState:
    """Present state of a system.

    states: of the resources. running: the running skills, each with its mission, None without one. unheard:
    data that were never received. published_by: as in the robot's table. reactions: of this robot's mock, which show
    the effects of its skills.
    """

    robot: str
    reporter: Reporter
    states: Mapping[str, str]
    running: Mapping[str, RunningMission | None]
    unheard: Collection[str] = ()
    published_by: Mapping[str, tuple[str, ...]] = field(default_factory=dict[str, tuple[str, ...]])
    reactions: tuple[Reaction, ...] = ()


def system_state(system: System) -> SystemState:
    """The present state of a system. Raises NoReplyError and RefusedError without states of the resources.

    The states are asked for last: they are those after the goals, so no goal seems to be over before its effects.
    """
    alive = system.alive()
    unheard = _unheard(system)
    running = running_skills(system, alive)
    states = system.ask(system.keys.resource_states, QueryStates(), ResourceStates).states
    silent = len(unheard) == len(system.skillset.data)
    return SystemState(
        robot=system.target.robot,
        reporter=_reporter(system, alive, silent=silent),
        states=states,
        running=running,
        unheard=unheard,
        published_by=_published_by(system),
        reactions=reactions_known(system.target.skillset, system.skillset),
    )


def running_skills(system: System, alive: Collection[str]) -> dict[str, RunningMission | None]:
    """The running skills, as in `SystemState`. alive: holders of alive tokens."""
    askers: dict[str, str] = {}
    missions: list[RunningMission] = []

    def on_record(record: Record) -> None:
        if record.kind is RecordKind.GOAL and record.after == State.VALIDATING and record.goal_id is not None:
            askers[record.goal_id] = record.text

    follow_records(system.bus, system.keys, on_record)
    system.bus.subscribe(
        system.keys.mission_status,
        message_reader(MissionStatus, lambda status: missions.append(RunningMission(status.mission, status.rescue))),
        events=True,
    )
    skills = [skill.name for skill in system.skillset.skills if skill_process(skill.name) in alive]
    statuses = [status for status in map(system.goal, skills) if status and status.state is not State.TERMINATED]
    if MISSION not in alive:
        return dict.fromkeys(status.skill for status in statuses)
    system.bus.run_until(lambda: bool(missions) and all(status.goal_id in askers for status in statuses), LATE_MESSAGES)
    # With keys the name of a person or a robot's process comes first: `alice (mission)`, `m600.mission`.
    ends = (f" {MISSION}", f"({MISSION})", f".{MISSION}")
    by_mission = [status.skill for status in statuses if askers.get(status.goal_id, "").endswith(ends)]
    mission = missions[-1] if missions else RunningMission("unknown")
    return {status.skill: mission if status.skill in by_mission else None for status in statuses}


def _unheard(system: System) -> list[str]:
    try:
        readings = [system.ask(system.keys.data(item.name), QueryData(), DataReading) for item in system.skillset.data]
    except (NoReplyError, RefusedError):
        return []
    return [reading.name for reading in readings if reading.t is None]


def _published_by(system: System) -> Mapping[str, tuple[str, ...]]:
    try:
        return find_robot(system.target.table or system.target.robot).published_by
    except (UnknownNameError, InvalidOptionError):
        return {}


def _reporter(system: System, alive: Collection[str], *, silent: bool) -> Reporter:
    """The source of reported states. silent: no data at all. An unknown process counts as a bridge."""
    states = [entry.state for entry in system.process_statuses(alive)]
    names = {name for state in states for name in (state.nodes or (state.name,))}
    if MOCKED_WORLD in names:
        return "mock"
    skills = {skill_process(skill.name) for skill in system.skillset.skills}
    above = {ROUTER, DATA_MANAGER, RESOURCE_MANAGER, RECORDER, MISSION, *skills}
    below = {name for name in names if name not in above and not name.startswith(CLIENT)}
    return "nobody" if silent and not below else "robot"
