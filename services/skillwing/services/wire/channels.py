"""Every key of a robot: what travels there, who offers it, who uses it, and which refusals to expect.

How a key is spelt is said in `protocol.Keys`, what a message holds in the message's class; what the two have to do
with each other is said here, and only here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from skillwing.dsl.model import Skillset
from skillwing.services import names, protocol
from skillwing.services.protocol import CLOCK_DONE_KEY, CLOCK_KEY, ErrorCode, Keys, Message


class Kind(StrEnum):
    """How a key is used. What is offered at it: answers, publications, or the fact of being alive."""

    QUERY = "query"
    EVENTS = "events"
    STREAM = "stream"
    TOKEN = "liveliness token"


class Each(StrEnum):
    """What the changing part of a key names."""

    SKILL = "skill"
    RESOURCE = "resource"
    DATUM = "datum"
    EVENT = "event"
    PROCESS = "process"


@dataclass(frozen=True, slots=True)
class Channel:
    """One row of the table.

    key: spells the key for one name; each: what that name is of, None where there is a single key. message: the
    request or publication, a class or a union of tagged ones; None for a token. reply: of a query. refusals: besides
    `ANY_QUERY`. internal: between processes of Skillwing only; others may listen, and have no business to speak.
    """

    key: Callable[[Keys, str], str]
    kind: Kind
    offered_by: str
    used_by: str
    meaning: str
    each: Each | None = None
    message: type[Message] | Any = None
    reply: type[Message] | Any = None
    refusals: tuple[ErrorCode, ...] = ()
    internal: bool = False

    @property
    def pattern(self) -> str:
        """The key with placeholders: `SKILLSET/skill/SKILL/start`."""
        return self.key(Keys("SKILLSET"), self.each.upper() if self.each else "")

    def keys(self, skillset: Skillset) -> tuple[str, ...]:
        """The keys that there are in a robot with this skillset."""
        return tuple(self.key(Keys(skillset.name), name) for name in _names(skillset, self.each))


ANY_QUERY = (ErrorCode.BAD_REQUEST, ErrorCode.INTERNAL)
"""Refusals that every query has to expect."""

RESOURCES = "resource manager"
DATA = "data manager"
SKILL = "the skill's manager"
CLIENTS = "clients: missions, the command line, yours"

CHANNELS = (
    # --- skills ---
    Channel(
        Keys.start,
        Kind.QUERY,
        SKILL,
        CLIENTS,
        "Start a goal. Answered at once with its state, which is hardly ever the end already; follow `status`.",
        each=Each.SKILL,
        message=protocol.StartGoal,
        reply=protocol.GoalStatus,
        refusals=(ErrorCode.SCHEMA_MISMATCH, ErrorCode.TOO_LATE),
    ),
    Channel(
        Keys.interrupt,
        Kind.QUERY,
        SKILL,
        CLIENTS,
        "Ask a goal to end. Answered at once; the goal is over when its status says so.",
        each=Each.SKILL,
        message=protocol.InterruptGoal,
        reply=protocol.GoalStatus,
        refusals=(ErrorCode.UNKNOWN_GOAL,),
    ),
    Channel(
        Keys.goal,
        Kind.QUERY,
        SKILL,
        CLIENTS,
        "Ask how a goal is doing, also one that is over: the last 1000 are remembered.",
        each=Each.SKILL,
        message=protocol.QueryGoal,
        reply=protocol.GoalStatus,
        refusals=(ErrorCode.UNKNOWN_GOAL,),
    ),
    Channel(
        Keys.status,
        Kind.EVENTS,
        SKILL,
        CLIENTS,
        "Every change of every goal of the skill; the one with `terminal` is the goal's last.",
        each=Each.SKILL,
        message=protocol.GoalStatus,
    ),
    Channel(
        Keys.progress,
        Kind.STREAM,
        SKILL,
        CLIENTS,
        "Feedback of the running goal, at the skill's `progress` period.",
        each=Each.SKILL,
        message=protocol.GoalProgress,
    ),
    # --- resources ---
    Channel(
        lambda keys, _: keys.resource_states,
        Kind.QUERY,
        RESOURCES,
        CLIENTS,
        "The states of all resources at one instant.",
        message=protocol.QueryStates,
        reply=protocol.ResourceStates,
    ),
    Channel(
        Keys.resource,
        Kind.EVENTS,
        RESOURCES,
        CLIENTS,
        "Every change of a resource.",
        each=Each.RESOURCE,
        message=protocol.ResourceChange,
    ),
    Channel(
        lambda keys, _: keys.resource_extern,
        Kind.QUERY,
        RESOURCES,
        "robot bridge, operators",
        "Report that the robot has brought a resource to another state. The reply holds the states after everything "
        "that this broke.",
        message=protocol.FireExtern,
        reply=protocol.ResourceStates,
        refusals=(
            ErrorCode.SCHEMA_MISMATCH,
            ErrorCode.UNKNOWN_NAME,
            ErrorCode.NOT_ALLOWED,
            ErrorCode.UNAVAILABLE,
        ),
    ),
    Channel(
        Keys.event,
        Kind.QUERY,
        RESOURCES,
        "robot bridge, operators",
        "Fire an event of the skillset: its guard and all its transitions, or nothing.",
        each=Each.EVENT,
        message=protocol.FireEvent,
        reply=protocol.ResourceStates,
        refusals=(
            ErrorCode.SCHEMA_MISMATCH,
            ErrorCode.UNKNOWN_NAME,
            ErrorCode.NOT_ALLOWED,
            ErrorCode.UNAVAILABLE,
        ),
    ),
    # --- data ---
    Channel(
        Keys.data,
        Kind.STREAM,
        "robot bridge",
        "data manager, resource manager, clients",
        "Values of a datum, at its period at least: after three periods without one it is stale.",
        each=Each.DATUM,
        message=protocol.DataSample,
    ),
    Channel(
        Keys.data,
        Kind.QUERY,
        DATA,
        CLIENTS,
        "The latest value of a datum, and whether it still counts.",
        each=Each.DATUM,
        message=protocol.QueryData,
        reply=protocol.DataReading,
        refusals=(ErrorCode.UNKNOWN_NAME,),
    ),
    # --- who is there, and what happened ---
    Channel(
        Keys.alive,
        Kind.TOKEN,
        "every process, and every client that owns goals",
        "everybody",
        f"Is there as long as the process is. Managers are called `{names.RESOURCE_MANAGER}`, `{names.DATA_MANAGER}` "
        f"and `{names.skill_process('SKILL')}`, clients `{names.CLIENT}NAME`.",
        each=Each.PROCESS,
    ),
    Channel(
        lambda keys, _: keys.timeline,
        Kind.EVENTS,
        "every process",
        "recorders, viewers, clients",
        "One record for each change of anything, with its cause.",
        message=protocol.Record,
    ),
    Channel(
        lambda keys, _: CLOCK_KEY,
        Kind.STREAM,
        "the simulator, where there is one",
        "every process of a simulated robot",
        "Robot time. A robot without this key lives in wall time: Unix time in seconds.",
        message=protocol.ClockTick,
    ),
    Channel(
        lambda keys, name: f"{CLOCK_DONE_KEY}/{name}",
        Kind.STREAM,
        "every process of a simulated robot",
        "the simulator",
        "Where time runs as fast as its followers keep up: how far this one has come. The first one joins it to those "
        "that time waits for; a liveliness token of the same key says when it has gone.",
        each=Each.PROCESS,
        internal=True,
        message=protocol.ClockDone,
    ),
    # --- missions ---
    Channel(
        lambda keys, _: keys.mission_status,
        Kind.EVENTS,
        "mission",
        "viewers, clients",
        "How the mission is doing.",
        message=protocol.MissionStatus,
    ),
    Channel(
        lambda keys, _: keys.mission_tree,
        Kind.EVENTS,
        "mission",
        "viewers",
        "The mission's behaviour tree after each tick that changed it.",
        message=protocol.TreeSnapshot,
    ),
    Channel(
        lambda keys, _: keys.mission_abort,
        Kind.QUERY,
        "mission",
        CLIENTS,
        "Call the running mission off.",
        message=protocol.AbortMission,
        reply=protocol.MissionStatus,
    ),
    Channel(
        lambda keys, _: keys.mission_pause,
        Kind.QUERY,
        "mission",
        CLIENTS,
        "Make the running mission stand still.",
        message=protocol.PauseMission,
        reply=protocol.MissionStatus,
    ),
    Channel(
        lambda keys, _: keys.mission_resume,
        Kind.QUERY,
        "mission",
        CLIENTS,
        "Let a paused mission go on.",
        message=protocol.ResumeMission,
        reply=protocol.MissionStatus,
    ),
    # --- between managers ---
    Channel(
        lambda keys, _: keys.resource_goal,
        Kind.QUERY,
        RESOURCES,
        "skill managers",
        "Begin a goal (preconditions and start effect as one step), renew its grant or end it. Or commit the outcome "
        "of a goal that was never granted.",
        message=protocol.GoalCall,
        reply=protocol.GoalVerdict,
        refusals=(
            ErrorCode.SCHEMA_MISMATCH,
            ErrorCode.UNKNOWN_NAME,
            ErrorCode.UNKNOWN_GOAL,
            ErrorCode.STALE_TOKEN,
            ErrorCode.REPLACED,
            ErrorCode.UNAVAILABLE,
        ),
        internal=True,
    ),
    Channel(
        Keys.leader,
        Kind.TOKEN,
        RESOURCES,
        RESOURCES,
        "Stands as long as this process is the active resource manager. The mark is its own, and grows with time.",
        each=Each.PROCESS,
        internal=True,
    ),
    Channel(
        Keys.candidate,
        Kind.TOKEN,
        RESOURCES,
        RESOURCES,
        "Stands while this process waits to become the active resource manager.",
        each=Each.PROCESS,
        internal=True,
    ),
    Channel(
        lambda keys, _: keys.resource_attach,
        Kind.QUERY,
        RESOURCES,
        "skill managers",
        "A manager has started; what an earlier process of its name holds is lost.",
        message=protocol.AttachManager,
        reply=protocol.ResourceStates,
        refusals=(ErrorCode.SCHEMA_MISMATCH, ErrorCode.REPLACED, ErrorCode.UNAVAILABLE),
        internal=True,
    ),
    Channel(
        Keys.verdict,
        Kind.EVENTS,
        RESOURCES,
        "the skill's manager, robot bridge",
        "A goal that the resource manager has ended. The robot is to refuse its fencing token from now on.",
        each=Each.SKILL,
        message=protocol.Violated | protocol.Lost,
        internal=True,
    ),
    # --- mocks ---
    Channel(
        Keys.mocked_skill,
        Kind.QUERY,
        "a mocked skill's manager",
        "`skillwing script`, tests",
        "See or change how the goals of a mocked skill go (docs/mocks.md).",
        each=Each.SKILL,
        message=protocol.MockCall,
        reply=protocol.MockPlan,
        refusals=(ErrorCode.NOT_ALLOWED,),
    ),
    Channel(
        lambda keys, _: keys.mocked_world,
        Kind.QUERY,
        "mocked world",
        "`skillwing script`, tests",
        "See or change the data that the mocked world publishes.",
        message=protocol.MockedWorldCall,
        reply=protocol.MockedData,
    ),
    Channel(
        Keys.mocked_goal,
        Kind.EVENTS,
        "a mocked skill's manager",
        "mocked world",
        "The goals that a mocked skill has begun.",
        each=Each.SKILL,
        message=protocol.MockedGoal,
        internal=True,
    ),
)


def _names(skillset: Skillset, each: Each | None) -> tuple[str, ...]:
    match each:
        case None:
            return ("",)
        case Each.SKILL:
            return tuple(skill.name for skill in skillset.skills)
        case Each.RESOURCE:
            return tuple(resource.name for resource in skillset.resources)
        case Each.DATUM:
            return tuple(datum.name for datum in skillset.data)
        case Each.EVENT:
            return tuple(event.name for event in skillset.events)
        case Each.PROCESS:
            managers = (names.RESOURCE_MANAGER, names.DATA_MANAGER)
            return (*managers, *(names.skill_process(skill.name) for skill in skillset.skills))
