"""Every key between the processes of a robot and its clients: `CHANNELS`.

`protocol.Keys` spells the keys, and a message's class has its fields. This table says which belong together.
`protocol_page/protocol.md.template` explains each key.
"""

from __future__ import annotations

from skillwing.dsl.model import Skillset
from skillwing.services import names
from skillwing.services.protocol import (
    CLOCK_DONE_KEY,
    CLOCK_KEY,
    AbortMission,
    AttachManager,
    ClockDone,
    ClockTick,
    DataReading,
    DataSample,
    ErrorCode,
    FireEvent,
    FireExtern,
    GoalCall,
    GoalProgress,
    GoalStatus,
    GoalVerdict,
    InterruptGoal,
    Keys,
    Lost,
    MissionStatus,
    MockCall,
    MockedData,
    MockedGoal,
    MockedWorldCall,
    MockPlan,
    ModifyGoal,
    NodesExited,
    PauseMission,
    QueryData,
    QueryGoal,
    QueryMission,
    QueryReady,
    QueryRobot,
    QueryStates,
    ReadyReport,
    Record,
    ResourceStates,
    ResourceStep,
    ResumeMission,
    RobotDescription,
    StartGoal,
    StartMission,
    TreeSnapshot,
    Violated,
)
from skillwing.services.wire.channel import EVERYBODY, PROCESSES, Channel, Each, Kind, Role

RESOURCES, DATA, SKILL = (Role.RESOURCE_MANAGER,), (Role.DATA_MANAGER,), (Role.SKILL_MANAGER,)
BRIDGE, WORLD = (Role.FUNCTIONAL_LAYER, Role.MOCKED_WORLD), (Role.MOCKED_WORLD,)
"""The robot bridge is a process of the functional layer; the mocked world takes its place."""
COMMANDERS = (Role.CLIENT, Role.OPERATOR, Role.MISSION, Role.SKILL_MANAGER)
"""Roles that start skills. A skill manager does if its skill is a behavior tree of others."""
MISSIONS = (Role.MISSION, Role.CLIENT, Role.OPERATOR)
"""A mission on board has its own role. One on the ground has that of its client."""
LAUNCHER = (Role.LAUNCHER,)
"""The launcher also publishes the end of a mission whose process it has seen die."""
PERSONS, OPERATORS = (Role.CLIENT, Role.OPERATOR), (Role.OPERATOR,)
CHANGERS = (*BRIDGE, *OPERATORS)

UNKNOWN = (ErrorCode.UNKNOWN_GOAL,)
STARTS = (ErrorCode.SCHEMA_MISMATCH, ErrorCode.TOO_LATE)
MODIFICATIONS = (
    *(ErrorCode.SCHEMA_MISMATCH, ErrorCode.UNKNOWN_NAME, ErrorCode.UNKNOWN_GOAL),
    *(ErrorCode.NOT_ALLOWED, ErrorCode.TOO_LATE, ErrorCode.UNAVAILABLE),
)
UNDECIDED = (ErrorCode.UNAVAILABLE,)
NO_MISSION = (ErrorCode.NOT_ALLOWED,)
ON_BOARD = (ErrorCode.NOT_ALLOWED, ErrorCode.UNAVAILABLE)
ASKED = (ErrorCode.SCHEMA_MISMATCH, ErrorCode.UNKNOWN_NAME, ErrorCode.UNAVAILABLE)
CHANGES = (ErrorCode.SCHEMA_MISMATCH, ErrorCode.UNKNOWN_NAME, ErrorCode.NOT_ALLOWED, ErrorCode.UNAVAILABLE)
ATTACHMENTS = (ErrorCode.SCHEMA_MISMATCH, ErrorCode.REPLACED, ErrorCode.UNAVAILABLE)
GRANTS = (
    *(ErrorCode.SCHEMA_MISMATCH, ErrorCode.UNKNOWN_NAME, ErrorCode.UNKNOWN_GOAL),
    *(ErrorCode.STALE_TOKEN, ErrorCode.REPLACED, ErrorCode.UNAVAILABLE),
)

PUBLIC = (
    Channel(Keys.start, Kind.QUERY, SKILL, COMMANDERS, StartGoal, GoalStatus, STARTS, Each.SKILL),
    Channel(Keys.interrupt, Kind.QUERY, SKILL, COMMANDERS, InterruptGoal, GoalStatus, UNKNOWN, Each.SKILL),
    Channel(Keys.modify, Kind.QUERY, SKILL, COMMANDERS, ModifyGoal, GoalStatus, MODIFICATIONS, Each.SKILL),
    Channel(Keys.goal, Kind.QUERY, SKILL, EVERYBODY, QueryGoal, GoalStatus, UNKNOWN, Each.SKILL),
    Channel(Keys.status, Kind.EVENTS, SKILL, EVERYBODY, GoalStatus, each=Each.SKILL),
    Channel(Keys.progress, Kind.STREAM, SKILL, EVERYBODY, GoalProgress, each=Each.SKILL),
    Channel(
        lambda keys, _: keys.resource_states, Kind.QUERY, RESOURCES, EVERYBODY, QueryStates, ResourceStates, UNDECIDED
    ),
    Channel(
        lambda keys, _: keys.resource_robot, Kind.QUERY, RESOURCES, EVERYBODY, QueryRobot, RobotDescription, UNDECIDED
    ),
    Channel(lambda keys, _: keys.resource_ready, Kind.QUERY, RESOURCES, EVERYBODY, QueryReady, ReadyReport, ASKED),
    Channel(lambda keys, _: keys.resource_steps, Kind.EVENTS, RESOURCES, EVERYBODY, ResourceStep),
    Channel(lambda keys, _: keys.resource_extern, Kind.QUERY, RESOURCES, CHANGERS, FireExtern, ResourceStates, CHANGES),
    Channel(Keys.event, Kind.QUERY, RESOURCES, CHANGERS, FireEvent, ResourceStates, CHANGES, Each.EVENT),
    Channel(Keys.data, Kind.STREAM, BRIDGE, EVERYBODY, DataSample, each=Each.DATUM),
    Channel(Keys.data, Kind.QUERY, DATA, EVERYBODY, QueryData, DataReading, (ErrorCode.UNKNOWN_NAME,), Each.DATUM),
    Channel(Keys.alive, Kind.TOKEN, (*PROCESSES, *PERSONS), EVERYBODY, each=Each.PROCESS),
    Channel(lambda keys, _: keys.timeline, Kind.EVENTS, (*PROCESSES, *PERSONS), EVERYBODY, Record),
    Channel(CLOCK_KEY, Kind.STREAM, (Role.FUNCTIONAL_LAYER,), EVERYBODY, ClockTick),
    Channel(lambda keys, _: keys.mission_status, Kind.EVENTS, (*MISSIONS, *LAUNCHER), EVERYBODY, MissionStatus),
    Channel(
        lambda keys, _: keys.mission_status, Kind.QUERY, LAUNCHER, EVERYBODY, QueryMission, MissionStatus, NO_MISSION
    ),
    Channel(lambda keys, _: keys.mission_start, Kind.QUERY, LAUNCHER, PERSONS, StartMission, MissionStatus, ON_BOARD),
    Channel(lambda keys, _: keys.mission_tree, Kind.EVENTS, MISSIONS, EVERYBODY, TreeSnapshot),
    Channel(lambda keys, _: keys.mission_abort, Kind.QUERY, MISSIONS, PERSONS, AbortMission, MissionStatus),
    Channel(lambda keys, _: keys.mission_pause, Kind.QUERY, MISSIONS, PERSONS, PauseMission, MissionStatus),
    Channel(lambda keys, _: keys.mission_resume, Kind.QUERY, MISSIONS, PERSONS, ResumeMission, MissionStatus),
    Channel(
        Keys.mocked_skill,
        Kind.QUERY,
        SKILL,
        (*WORLD, *OPERATORS),
        MockCall,
        MockPlan,
        (ErrorCode.NOT_ALLOWED,),
        Each.SKILL,
    ),
    Channel(lambda keys, _: keys.mocked_world, Kind.QUERY, WORLD, OPERATORS, MockedWorldCall, MockedData),
)
INTERNAL = (
    Channel(
        CLOCK_DONE_KEY, Kind.STREAM, (*PROCESSES, *PERSONS), (Role.FUNCTIONAL_LAYER,), ClockDone, each=Each.PROCESS
    ),
    Channel(lambda keys, _: keys.resource_goal, Kind.QUERY, RESOURCES, SKILL, GoalCall, GoalVerdict, GRANTS),
    Channel(Keys.leader, Kind.TOKEN, RESOURCES, RESOURCES, each=Each.PROCESS),
    Channel(Keys.candidate, Kind.TOKEN, RESOURCES, RESOURCES, each=Each.PROCESS),
    Channel(
        lambda keys, _: keys.resource_attach, Kind.QUERY, RESOURCES, SKILL, AttachManager, ResourceStates, ATTACHMENTS
    ),
    Channel(Keys.verdict, Kind.EVENTS, RESOURCES, (*SKILL, *BRIDGE), Violated | Lost, each=Each.SKILL),
    Channel(lambda keys, _: keys.exits, Kind.EVENTS, LAUNCHER, (*RESOURCES, *SKILL), NodesExited),
    Channel(Keys.mocked_goal, Kind.EVENTS, SKILL, WORLD, MockedGoal, each=Each.SKILL),
)
"""Keys on which only processes of Skillwing publish and ask. Others may listen."""
CHANNELS = (*PUBLIC, *INTERNAL)


def keys_in(skillset: Skillset, channel: Channel) -> tuple[str, ...]:
    """The keys of a row in a robot with this skillset."""
    named = {
        None: ("",),
        Each.SKILL: tuple(skill.name for skill in skillset.skills),
        Each.DATUM: tuple(datum.name for datum in skillset.data),
        Each.EVENT: tuple(event.name for event in skillset.events),
        Each.PROCESS: (
            *(names.RESOURCE_MANAGER, names.DATA_MANAGER),
            *(names.skill_process(skill.name) for skill in skillset.skills),
        ),
    }
    return tuple(channel.spell(Keys(skillset.name), name) for name in named[channel.each])
