"""Every key between the processes of a robot and its clients: `CHANNELS`.

`protocol.Keys` spells the keys, and a message's class has its fields. This table says which belong together.
`protocol.md.template` explains each key.
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
    PauseMission,
    QueryData,
    QueryGoal,
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
    TreeSnapshot,
    Violated,
)
from skillwing.services.wire.channel import Channel, Each, Kind

RESOURCES, DATA, SKILL, BRIDGE = "resource manager", "data manager", "the skill's manager", "robot bridge"
MISSION, MOCKED, WORLD = "mission", "a mocked skill's manager", "mocked world"
CLIENTS, OPERATORS, SKILLS = ("clients: missions, the command line, yours",), (BRIDGE, "operators"), ("skill managers",)
VIEWERS, SCRIPTS = ("viewers", "clients"), ("`skillwing script`", "tests")
SIMULATOR, SIMULATED = "the simulator, where there is one", "every process of a simulated robot"

UNKNOWN = (ErrorCode.UNKNOWN_GOAL,)
STARTS = (ErrorCode.SCHEMA_MISMATCH, ErrorCode.TOO_LATE)
MODIFICATIONS = (
    *(ErrorCode.SCHEMA_MISMATCH, ErrorCode.UNKNOWN_NAME, ErrorCode.UNKNOWN_GOAL),
    *(ErrorCode.NOT_ALLOWED, ErrorCode.TOO_LATE, ErrorCode.UNAVAILABLE),
)
UNDECIDED = (ErrorCode.UNAVAILABLE,)
ASKED = (ErrorCode.SCHEMA_MISMATCH, ErrorCode.UNKNOWN_NAME, ErrorCode.UNAVAILABLE)
CHANGES = (ErrorCode.SCHEMA_MISMATCH, ErrorCode.UNKNOWN_NAME, ErrorCode.NOT_ALLOWED, ErrorCode.UNAVAILABLE)
ATTACHMENTS = (ErrorCode.SCHEMA_MISMATCH, ErrorCode.REPLACED, ErrorCode.UNAVAILABLE)
GRANTS = (
    *(ErrorCode.SCHEMA_MISMATCH, ErrorCode.UNKNOWN_NAME, ErrorCode.UNKNOWN_GOAL),
    *(ErrorCode.STALE_TOKEN, ErrorCode.REPLACED, ErrorCode.UNAVAILABLE),
)

PUBLIC = (
    Channel(Keys.start, Kind.QUERY, SKILL, CLIENTS, StartGoal, GoalStatus, STARTS, Each.SKILL),
    Channel(Keys.interrupt, Kind.QUERY, SKILL, CLIENTS, InterruptGoal, GoalStatus, UNKNOWN, Each.SKILL),
    Channel(Keys.modify, Kind.QUERY, SKILL, CLIENTS, ModifyGoal, GoalStatus, MODIFICATIONS, Each.SKILL),
    Channel(Keys.goal, Kind.QUERY, SKILL, CLIENTS, QueryGoal, GoalStatus, UNKNOWN, Each.SKILL),
    Channel(Keys.status, Kind.EVENTS, SKILL, CLIENTS, GoalStatus, each=Each.SKILL),
    Channel(Keys.progress, Kind.STREAM, SKILL, CLIENTS, GoalProgress, each=Each.SKILL),
    Channel(
        lambda keys, _: keys.resource_states, Kind.QUERY, RESOURCES, CLIENTS, QueryStates, ResourceStates, UNDECIDED
    ),
    Channel(
        lambda keys, _: keys.resource_robot, Kind.QUERY, RESOURCES, CLIENTS, QueryRobot, RobotDescription, UNDECIDED
    ),
    Channel(lambda keys, _: keys.resource_ready, Kind.QUERY, RESOURCES, CLIENTS, QueryReady, ReadyReport, ASKED),
    Channel(lambda keys, _: keys.resource_steps, Kind.EVENTS, RESOURCES, CLIENTS, ResourceStep),
    Channel(
        lambda keys, _: keys.resource_extern, Kind.QUERY, RESOURCES, OPERATORS, FireExtern, ResourceStates, CHANGES
    ),
    Channel(Keys.event, Kind.QUERY, RESOURCES, OPERATORS, FireEvent, ResourceStates, CHANGES, Each.EVENT),
    Channel(Keys.data, Kind.STREAM, BRIDGE, (DATA, RESOURCES, "clients"), DataSample, each=Each.DATUM),
    Channel(Keys.data, Kind.QUERY, DATA, CLIENTS, QueryData, DataReading, (ErrorCode.UNKNOWN_NAME,), Each.DATUM),
    Channel(
        Keys.alive, Kind.TOKEN, "every process, and every client that owns goals", ("everybody",), each=Each.PROCESS
    ),
    Channel(lambda keys, _: keys.timeline, Kind.EVENTS, "every process", ("recorders", *VIEWERS), Record),
    Channel(CLOCK_KEY, Kind.STREAM, SIMULATOR, (SIMULATED,), ClockTick),
    Channel(lambda keys, _: keys.mission_status, Kind.EVENTS, MISSION, VIEWERS, MissionStatus),
    Channel(lambda keys, _: keys.mission_tree, Kind.EVENTS, MISSION, ("viewers",), TreeSnapshot),
    Channel(lambda keys, _: keys.mission_abort, Kind.QUERY, MISSION, CLIENTS, AbortMission, MissionStatus),
    Channel(lambda keys, _: keys.mission_pause, Kind.QUERY, MISSION, CLIENTS, PauseMission, MissionStatus),
    Channel(lambda keys, _: keys.mission_resume, Kind.QUERY, MISSION, CLIENTS, ResumeMission, MissionStatus),
    Channel(Keys.mocked_skill, Kind.QUERY, MOCKED, SCRIPTS, MockCall, MockPlan, (ErrorCode.NOT_ALLOWED,), Each.SKILL),
    Channel(lambda keys, _: keys.mocked_world, Kind.QUERY, WORLD, SCRIPTS, MockedWorldCall, MockedData),
)
INTERNAL = (
    Channel(CLOCK_DONE_KEY, Kind.STREAM, SIMULATED, ("the simulator",), ClockDone, each=Each.PROCESS),
    Channel(lambda keys, _: keys.resource_goal, Kind.QUERY, RESOURCES, SKILLS, GoalCall, GoalVerdict, GRANTS),
    Channel(Keys.leader, Kind.TOKEN, RESOURCES, (RESOURCES,), each=Each.PROCESS),
    Channel(Keys.candidate, Kind.TOKEN, RESOURCES, (RESOURCES,), each=Each.PROCESS),
    Channel(
        lambda keys, _: keys.resource_attach, Kind.QUERY, RESOURCES, SKILLS, AttachManager, ResourceStates, ATTACHMENTS
    ),
    Channel(Keys.verdict, Kind.EVENTS, RESOURCES, (SKILL, BRIDGE), Violated | Lost, each=Each.SKILL),
    Channel(Keys.mocked_goal, Kind.EVENTS, MOCKED, (WORLD,), MockedGoal, each=Each.SKILL),
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
