"""The wire protocol: every message and key that crosses a process boundary, defined once.

Payloads are MessagePack. `encode` and `decode` are the only way in and out. They refuse unknown fields, wrong types,
non-finite numbers, other protocol versions and oversized payloads with a `ProtocolError`. Times `t` are robot time in
seconds. Ids of goals are UUIDv7 strings that the client chooses. Ids of timeline records name the process that wrote
them, so that a `cause` leads across processes.
"""

from __future__ import annotations

import math
import re
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated, Any, Literal, TypeAlias, TypeVar

import msgspec

PROTOCOL_VERSION = 2
MAX_MESSAGE_BYTES = 1 << 20
ROOM_FOR_THE_REST = 1 << 14
"""Bytes of a message reserved for everything but the one value of a developer in it."""
LONGEST_LABEL = 200
LONGEST_SENTENCE = 2000
"""Characters of a refusal's sentence that are sent."""
LONGEST_OWNER_GRACE = 60.0
"""Longest time in seconds for which a goal may run on after its owner is gone."""
MAX_NESTING = 32
"""Deepest nesting of a decoded payload; a deeper one is refused before it is walked."""

CLOCK_KEY = "fl/clock"
"""Key of the `ClockTick` of the owner of robot time: part of the functional layer, but every process follows it."""
CLOCK_DONE_KEY = "fl/clock/done"
"""Prefix of the keys of followers of robot time, one for each process: `ClockDone`, and a liveliness token."""


class ProtocolError(Exception):
    """A payload that is not a valid message; `str()` is a sentence for people."""


Label: TypeAlias = Annotated[str, msgspec.Meta(max_length=LONGEST_LABEL)]
"""An id or a name. Its length is bounded, because its receiver remembers or repeats it."""


FARTHEST_TIME = 9.0e9
Time: TypeAlias = Annotated[float, msgspec.Meta(ge=-FARTHEST_TIME, le=FARTHEST_TIME)]
"""Robot time in seconds. 64 bits of nanoseconds can hold it, so that every receiver can compute with it."""


class Message(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Base of all messages. `v` is the protocol version of the sender."""

    v: int = PROTOCOL_VERSION


M = TypeVar("M", bound=Message)
_encoder = msgspec.msgpack.Encoder()
_decoders: dict[Any, msgspec.msgpack.Decoder[Any]] = {}
_learning = threading.Lock()


def encode(message: Message) -> bytes:
    """The MessagePack bytes of `message`.

    Raises `ProtocolError` for a message that no receiver would accept: with values that have no MessagePack form, with
    numbers that are not finite, or with too many bytes.
    """
    return _encoded(message)


def require_sendable(value: object, limit: int = MAX_MESSAGE_BYTES - ROOM_FOR_THE_REST) -> None:
    """Raise `ProtocolError` if `value` has more than `limit` bytes; by default, if no message could hold it."""
    _encoded(value, limit)


def _encoded(value: object, limit: int = MAX_MESSAGE_BYTES) -> bytes:
    try:
        payload = _encoder.encode(value)
    except (TypeError, ValueError, OverflowError, RecursionError) as error:
        raise ProtocolError(f"the message holds a value that cannot be sent: {error}") from error
    _require_length(payload, limit)
    if _may_be_unsound(payload):
        require_finite(value)
    return payload


def _require_length(payload: bytes, limit: int) -> None:
    if len(payload) > limit:
        raise ProtocolError(f"the message has {len(payload)} bytes; at most {limit} are accepted")


def learn(kind: Any) -> msgspec.msgpack.Decoder[Any]:
    """A decoder of a type, made by one thread at a time.

    msgspec 0.22 ends the process (SIGSEGV) if two threads make decoders of a new type at once. Nodes that begin at the
    same time in one process would do that.
    """
    with _learning:
        return msgspec.msgpack.Decoder(kind)


def decode(payload: bytes, kind: type[M]) -> M:
    """The message of type `kind` (a `Message` class or a union of tagged ones) in `payload`.

    Raises `ProtocolError` for any other payload.
    """
    _require_length(payload, MAX_MESSAGE_BYTES)
    decoder = _decoders.get(kind)
    if decoder is None:
        decoder = _decoders[kind] = learn(kind)
    try:
        message = decoder.decode(payload)
    except (msgspec.DecodeError, RecursionError, UnicodeDecodeError) as error:
        raise ProtocolError(f"not a valid {getattr(kind, '__name__', 'message')}: {error}") from error
    if message.v != PROTOCOL_VERSION:
        raise ProtocolError(f"the sender speaks protocol {message.v}, this process speaks {PROTOCOL_VERSION}")
    if _may_be_unsound(payload):
        require_finite(message)
    return message


_EXTREME_DOUBLE = re.compile(rb"\xcb[\x7f\xff]")
"""First bytes of MessagePack floats whose exponent may be all ones, as it is for NaN and the infinities."""
_EXTREME_SINGLE = re.compile(rb"\xca[\x7f\xff]")
"""The same for 32 bits. A pattern for both has no fixed first byte, which makes the search three times as long."""
_NO_CONTAINER = bytes(byte for byte in range(256) if not (0x80 <= byte <= 0x9F or 0xDC <= byte <= 0xDF))
"""All bytes that begin no MessagePack array or map."""


def _may_be_unsound(payload: bytes) -> bool:
    """True if `require_finite` could find a problem in this payload.

    It looks at bytes alone, so it may be true without need, but is never false by mistake. Most messages are spared the
    walk, which takes longer than their encoding.
    """
    if _EXTREME_DOUBLE.search(payload) or _EXTREME_SINGLE.search(payload):
        return True
    return len(payload) > MAX_NESTING and len(payload.translate(None, _NO_CONTAINER)) > MAX_NESTING


def require_finite(value: object, depth: int = 0) -> None:
    """Raise `ProtocolError` if a float anywhere inside `value` is NaN or infinite."""
    if value is None or isinstance(value, (str, int)):
        return  # most values, and a cheaper check than for a mapping
    if depth > MAX_NESTING:
        raise ProtocolError(f"the message is nested more than {MAX_NESTING} levels deep")
    if isinstance(value, float):
        if not math.isfinite(value):
            raise ProtocolError("the message holds a number that is not finite")
    elif isinstance(value, msgspec.Struct):
        for name in value.__struct_fields__:
            require_finite(getattr(value, name), depth + 1)
    elif isinstance(value, Mapping):
        for key, item in value.items():  # pyright: ignore[reportUnknownVariableType]
            require_finite(key, depth + 1)  # pyright: ignore[reportUnknownArgumentType]
            require_finite(item, depth + 1)  # pyright: ignore[reportUnknownArgumentType]
    elif isinstance(value, (list, tuple)):
        for item in value:  # pyright: ignore[reportUnknownVariableType]
            require_finite(item, depth + 1)  # pyright: ignore[reportUnknownArgumentType]


# --- goals -------------------------------------------------------------------------------------------------


class State(StrEnum):
    """States of Figure 5 that a goal passes through."""

    VALIDATING = "VALIDATING"
    DISPATCHING = "DISPATCHING"
    RUNNING = "RUNNING"
    INTERRUPTING = "INTERRUPTING"
    TERMINATED = "TERMINATED"


class Ending(StrEnum):
    """Endings of goals (docs/semantics.md)."""

    NOT_VALIDATED = "NV"
    NOT_READY = "NR"
    INVARIANT_VIOLATED = "RI"
    SUCCEEDED = "S"
    NOT_HELD = "N"
    INTERRUPTED = "IT"
    BUSY = "BUSY"
    ERROR = "ERROR"
    LOST = "LOST"


class Terminal(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The one terminal answer of a goal.

    `reason` is a sentence. `failing` names every failing precondition (NR) or the input fields (NV). `result` belongs
    to S and N, `invariant` and `subject` to RI, `running_goal` to BUSY. `forced` marks an IT that the timeout enforced.
    `detected_by` belongs to LOST. `success` is the side of the result partition that an S is on: S_BLOCKED is a result
    that held, and still a failure of the skill.
    """

    ending: Ending
    reason: str
    result: str | None = None
    success: bool = False
    failing: tuple[str, ...] = ()
    invariant: str | None = None
    subject: str | None = None
    output: dict[str, Any] | None = None
    forced: bool = False
    running_goal: str | None = None
    detected_by: str | None = None

    @property
    def label(self) -> str:
        """The name used in timelines: `S_AT_ALTITUDE`, `N_ARRIVED`, `RI`, `IT`, ..."""
        return f"{self.ending}_{self.result}" if self.result else str(self.ending)


class GoalStatus(Message, frozen=True, kw_only=True):
    """State of one goal; published on every change and the answer to start, interrupt and goal queries.

    It carries the timeline record of this change (`as_record`): `record` is its id, `source` the process, `before` the
    state before, `text` its explanation, `cause` the record that led to it.

    `after_step` is the number of the resource manager's step that this status follows from. Show it only once the
    states of that step are known: otherwise a goal seems to end before the change that ended it.

    `revision` is the number of modifications of the goal. Each one is a further RUNNING.
    """

    goal_id: str
    skill: str
    state: State
    t: Time
    terminal: Terminal | None = None
    record: str | None = None
    source: str = ""
    before: str | None = None
    text: str = ""
    cause: str | None = None
    after_step: int = 0
    revision: int = 0

    @property
    def label(self) -> str:
        """The name used in timelines: that of the ending, else of the state."""
        return self.terminal.label if self.terminal else self.state

    def as_record(self) -> Record | None:
        """The timeline record of this change; None for a status without one."""
        if self.record is None:
            return None
        return Record(
            id=self.record,
            t=self.t,
            source=self.source,
            kind=RecordKind.GOAL,
            subject=self.skill,
            before=self.before,
            after=self.label,
            text=self.text,
            cause=self.cause,
            goal_id=self.goal_id,
        )


class GoalProgress(Message, frozen=True, kw_only=True):
    """Periodic typed feedback of a running goal."""

    goal_id: str
    skill: str
    t: Time
    feedback: dict[str, Any]


class StartGoal(Message, frozen=True, kw_only=True):
    """Start a skill. The same `goal_id` again returns that goal's state and never runs it twice.

    `deadline` (robot time) makes a delayed request harmless: after it the manager refuses to start. `owner` is the name
    of a process (`client/...`) whose alive token the goal must not outlive; None for a goal without one. `owner_grace`
    is the wall time in seconds for which the goal runs on without that token, in case that its owner comes back.
    """

    goal_id: Label
    inputs: dict[str, Any]
    client: Label
    schema: Label
    deadline: Time | None = None
    cause: Label | None = None
    owner: Label | None = None
    owner_grace: Annotated[float, msgspec.Meta(ge=0.0, le=LONGEST_OWNER_GRACE)] = 0.0


class InterruptGoal(Message, frozen=True, kw_only=True):
    """Ask a goal to stop. `cause` is the record that led to it."""

    goal_id: Label
    client: Label
    cause: Label | None = None


class ModifyGoal(Message, frozen=True, kw_only=True):
    """Give a running goal new values for modifiable inputs; the others stay. All are taken, or none.

    The same `request_id` again changes nothing. It returns the present status of the goal, or the same refusal.
    `deadline` as in `StartGoal`. `cause` is the record that led to it.
    """

    goal_id: Label
    request_id: Label
    inputs: dict[str, Any]
    client: Label
    schema: Label
    deadline: Time | None = None
    cause: Label | None = None


class QueryGoal(Message, frozen=True, kw_only=True):
    """Ask for one goal, or with `goal_id=None` for the running one, else the latest."""

    goal_id: Label | None = None


# --- resources ---------------------------------------------------------------------------------------------


class ResourceStates(Message, frozen=True, kw_only=True):
    """States of all resources, by resource, after the resource manager's step of that number.

    `epoch` as in `ResourceStep`.
    """

    step: int
    epoch: str = ""
    states: dict[str, str]
    t: Time


class QueryStates(Message, frozen=True, kw_only=True):
    """Ask for the states of all resources."""


class QueryRobot(Message, frozen=True, kw_only=True):
    """Ask a robot of which only the name is known for its skillset."""


class RobotDescription(Message, frozen=True, kw_only=True):
    """Facts about a robot that its clients need.

    `source` is the skillset as text in the skillset language, and `schema` its hash. `clock` is `robot` if a process of
    the robot owns its time, otherwise `wall`. `rescue_goal`, `without_goals` and `shared` are those of the robot's
    table, if it has them.
    """

    source: str
    schema: Label
    clock: Literal["robot", "wall"]
    rescue_goal: dict[str, Any] | None = None
    without_goals: str = ""
    shared: bool = False


class QueryReady(Message, frozen=True, kw_only=True):
    """Ask whether a skill may start now, or with an empty `skill` whether each one may. Nothing is started.

    `inputs` are those of the start. None asks without them: defaults count, and a precondition that needs another
    input is not checked. `schema` as in `FireExtern`.
    """

    skill: Label = ""
    inputs: dict[str, Any] | None = None
    schema: Label = ""


class Holder(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Running goal that holds a grant. `owner` is its client, empty if the resource manager has restarted since."""

    skill: str
    goal_id: str
    owner: str = ""


class MissingState(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A resource that has to change before a skill may start.

    `state` is the present one, `wanted` are those that would do. `holder` is the goal that holds the resource. `skills`
    have an effect that leads to a wanted state. `events` and `extern` transitions lead there from the present state;
    `extern` has their targets.
    """

    resource: str
    state: str
    wanted: tuple[str, ...]
    holder: Holder | None = None
    skills: tuple[str, ...] = ()
    events: tuple[str, ...] = ()
    extern: tuple[str, ...] = ()


class FailingCheck(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A failing precondition. `effect NAME` is a start effect that cannot be applied.

    `reason` is the sentence of a refused start. `missing` are its resources, `data` and `inputs` the other names in it.
    """

    name: str
    reason: str
    missing: tuple[MissingState, ...] = ()
    data: tuple[str, ...] = ()
    inputs: tuple[str, ...] = ()


class SkillReady(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Readiness of a skill. `ready` is true if nothing fails and the skill has no running goal.

    `failing` are all failing preconditions. `inputs` maps inputs that do not fit to sentences. `unchecked` are the
    preconditions that need an input which was not given. `running` is the goal of the skill that holds a grant.
    """

    skill: str
    ready: bool
    failing: tuple[FailingCheck, ...] = ()
    inputs: dict[str, str] = {}
    unchecked: tuple[str, ...] = ()
    running: Holder | None = None


class ReadyReport(Message, frozen=True, kw_only=True):
    """Reply to `QueryReady`: the skills that were asked for, at one instant. `step` as in `ResourceStates`."""

    step: int
    t: Time
    skills: tuple[SkillReady, ...]


class FireExtern(Message, frozen=True, kw_only=True, tag="fire_extern"):
    """Drive an extern transition. `source` names the sender, `cause` the record that made it happen.

    `schema` is that of the sender's skillset. It is empty for a sender that has only names, such as an operator.
    """

    resource: Label
    target: Label
    source: Label
    cause: Label | None = None
    schema: Label = ""


class FireEvent(Message, frozen=True, kw_only=True, tag="fire_event"):
    """Fire an event. Fields as in `FireExtern`."""

    event: Label
    source: Label
    cause: Label | None = None
    schema: Label = ""


class AttachManager(Message, frozen=True, kw_only=True, tag="attach"):
    """Register a manager that has started: goals of an earlier process of its name are lost. Reply: `ResourceStates`.

    Managers repeat it every few seconds. A process learns that way that another one has replaced it (`REPLACED`).
    `incarnation` is unique for each start of a manager. `schema` as in `BeginGoal`, or empty.
    """

    manager: Label
    incarnation: Label
    schema: Label = ""


class BeginGoal(Message, frozen=True, kw_only=True, tag="begin"):
    """Check preconditions and apply the start effect, as one atomic step. Idempotent for the same goal id.

    `incarnation` as in `AttachManager`, or empty.
    """

    goal_id: Label
    skill: Label
    inputs: dict[str, Any]
    manager: Label
    owner: Label
    schema: Label
    cause: Label | None = None
    incarnation: Label = ""


NO_TOKEN = 0
"""Token of an `EndGoal` from a manager that never learned whether the goal was granted, nor with which token."""


class EndKind(StrEnum):
    """Ways in which a granted goal ends; each applies an effect of its own. `result` comes with the result's name."""

    RESULT = "result"
    INTERRUPT = "interrupt"
    ERROR = "error"


class EndGoal(Message, frozen=True, kw_only=True, tag="end"):
    """End a granted goal and apply the effect of that end.

    `token` is the grant's. A manager that never learned it sends 0 with an `error`. Then `incarnation`, as in
    `BeginGoal`, has to be the one that the goal was granted to.
    """

    goal_id: Label
    skill: Label
    token: int
    how: EndKind
    result: Label | None = None
    cause: Label | None = None
    incarnation: Label = ""


class RecordOutcome(Message, frozen=True, kw_only=True, tag="record_outcome"):
    """Commit a local outcome: the terminal answer that a manager is about to give for a goal without a grant.

    `terminal` is `BUSY`, `NV`, `IT` or `ERROR`, without a result. `manager` and `incarnation` are those of
    `AttachManager`. The answer is an `Ended` with the same `terminal`, and from then on no process can begin the goal.
    If the goal has another outcome already, the answer is that one.
    """

    goal_id: Label
    skill: Label
    terminal: Terminal
    manager: Label
    incarnation: Label
    cause: Label | None = None


class RenewGoal(Message, frozen=True, kw_only=True, tag="renew"):
    """Renew a grant. Reply: `Granted` if it still stands, else the verdict that ended the goal."""

    goal_id: Label
    skill: Label
    token: int


GoalCall = BeginGoal | EndGoal | RecordOutcome | RenewGoal


class Granted(Message, frozen=True, kw_only=True, tag="granted"):
    """`token` is the fencing token: larger than that of every earlier grant. `step` is the step that granted it."""

    goal_id: str
    token: int
    step: int
    record: str


class NotReady(Message, frozen=True, kw_only=True, tag="not_ready"):
    """`failing` maps every failing precondition to a sentence that explains why. `step` is the step that refused."""

    goal_id: str
    failing: dict[str, str]
    step: int
    record: str


class Violated(Message, frozen=True, kw_only=True, tag="violated"):
    """An invariant of a granted goal broke; its violation effect has been applied. Also pushed on `verdict`.

    `token` is the grant's fencing token, which is no longer valid. `step` is the step that ended the goal.
    """

    goal_id: str
    skill: str
    invariant: str
    subject: str
    reason: str
    t: Time
    step: int
    record: str
    token: int


class Lost(Message, frozen=True, kw_only=True, tag="lost"):
    """A granted goal ended because its manager is gone; its lost effect has been applied. Pushed on `verdict`, and the
    reply to later requests of the process that held it.

    `token` is the grant's fencing token, which is no longer valid. `step` is the step that ended the goal.
    """

    goal_id: str
    skill: str
    reason: str
    t: Time
    step: int
    record: str
    token: int


class Ended(Message, frozen=True, kw_only=True, tag="ended"):
    """End of a goal. `held=False`: effect or postcondition did not hold, and `reason` names it; or the goal never had a
    grant, so that there was nothing to apply. `step` is the latest step, which ended the goal if it had a grant.

    `how` and `result` repeat the `EndGoal`, `terminal` the `RecordOutcome`. A manager needs them when it asks for a
    goal that its predecessor has ended. A goal that was given up before its grant has none of them.
    """

    goal_id: str
    held: bool
    reason: str
    step: int
    record: str
    how: EndKind | None = None
    result: str | None = None
    terminal: Terminal | None = None


GoalVerdict = Granted | NotReady | Violated | Lost | Ended


# --- data --------------------------------------------------------------------------------------------------


class DataSample(Message, frozen=True, kw_only=True, tag="sample"):
    """A value published by the robot bridge at robot time `t`."""

    name: Label
    value: Any
    t: Time


class QueryData(Message, frozen=True, kw_only=True):
    """Ask for the latest value of a datum."""


class DataReading(Message, frozen=True, kw_only=True):
    """Latest value at the data manager. `stale`: older than three promised periods, or never received."""

    name: str
    value: Any
    t: Time | None
    age: float | None
    stale: bool


# --- observation -------------------------------------------------------------------------------------------


class RecordKind(StrEnum):
    RESOURCE = "resource"
    GOAL = "goal"
    HEALTH = "health"
    FAULT = "fault"
    DATA = "data"
    MISSION = "mission"
    PROCESS = "process"


class Record(Message, frozen=True, kw_only=True):
    """One state change of anything. `cause` is the id of the record that made it happen."""

    id: str
    t: Time
    source: str
    kind: RecordKind
    subject: str
    before: str | None
    after: str
    text: str = ""
    cause: str | None = None
    goal_id: str | None = None
    detail: dict[str, Any] = {}


class NodesExited(Message, frozen=True, kw_only=True):
    """A process of the robot has ended, and nobody had asked it to. `record` is the id of the timeline record.

    `nodes` are those that shared the process, by the names of their alive tokens.
    """

    nodes: tuple[str, ...]
    record: str
    t: Time


class ResourceStep(Message, frozen=True, kw_only=True):
    """One step of the resource manager: everything that it recorded and decided, in order, as one event.

    `number` grows by one with each step that tells anything, also when a process continues from the journal. Without
    the journal a new `epoch` begins, with numbers of its own: nothing in between was lost. A record of kind
    `resource` is the change of a resource (`changes`). `verdicts` are those on goals that the step took away.
    """

    number: int
    epoch: str = ""
    t: Time
    records: tuple[Record, ...] = ()
    verdicts: tuple[Violated | Lost, ...] = ()

    @property
    def changes(self) -> tuple[Record, ...]:
        """The records of changed resources: `subject` is the resource, `before` and `after` are its states."""
        return tuple(record for record in self.records if record.kind is RecordKind.RESOURCE)


class NodeStatus(StrEnum):
    """Status of a node of a behaviour tree. INVALID: the last tick did not visit it."""

    RUNNING = "RUNNING"
    SUCCESS = "SUCCESS"
    FAILURE = "FAILURE"
    INVALID = "INVALID"


class TreeNode(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One node of a behaviour tree; `parent` is an index into the same list, None for the root."""

    index: int
    parent: int | None
    name: str
    kind: str
    status: NodeStatus
    feedback: str = ""


class TreeSnapshot(Message, frozen=True, kw_only=True):
    """Nodes of a mission's tree, with their states."""

    mission: str
    t: Time
    nodes: tuple[TreeNode, ...]


class MissionPhase(StrEnum):
    """Phases of a mission. PAUSED: by the operator, who resumes it. HELD: a person has the robot."""

    IDLE = "IDLE"
    RUNNING = "RUNNING"
    PAUSED = "PAUSED"
    HELD = "HELD"
    SUCCEEDED = "SUCCEEDED"
    FAILED = "FAILED"
    ABORTED = "ABORTED"

    @property
    def over(self) -> bool:
        """The mission has ended; no other phase follows."""
        return self in (MissionPhase.SUCCEEDED, MissionPhase.FAILED, MissionPhase.ABORTED)


class MissionStatus(Message, frozen=True, kw_only=True):
    """Progress of a mission; published on every change.

    `rescue` is a noun for what follows an abort, such as `lowering`; empty for a mission without a rescue. `request_id`
    is that of the `StartMission` of a mission on board, and empty for a mission on the ground.
    """

    mission: str
    phase: MissionPhase
    t: Time
    text: str
    rescue: str = ""
    waypoint: int = 0
    waypoints: int = 0
    goal: tuple[float, float, float] | None = None
    request_id: str = ""


class StartMission(Message, frozen=True, kw_only=True):
    """Run a mission on board: the robot's launcher starts its process. The reply comes once that runs.

    `mission` is the name of a mission that is installed on the robot. With `tree`, the text of a tree file, it is a
    name for that file. `options` are the mission's. `robots` are the names of the robots of a mission on several, by
    their names in the mission; a missing one has that name. The robot of this launcher is one of them. The same
    `request_id` again starts nothing and gets the same reply.
    """

    request_id: Label
    mission: Label
    client: Label
    options: dict[str, Any] = {}
    tree: str = ""
    robots: dict[Label, Label] = {}


class QueryMission(Message, frozen=True, kw_only=True):
    """Ask for the latest status of the mission that runs, or ran last; with `request_id`, of the mission of that
    `StartMission`; with `on_board`, of the one whose process this launcher runs, also while it starts."""

    request_id: str = ""
    on_board: bool = False


class AbortMission(Message, frozen=True, kw_only=True):
    """Interrupt everything, rescue the robot, and end the mission as ABORTED. Idempotent."""

    reason: str = "aborted by the operator"


class PauseMission(Message, frozen=True, kw_only=True):
    """Stop the motion and hold the position until `ResumeMission`. Guards stay active. Idempotent."""

    reason: str = "paused by the operator"


class ResumeMission(Message, frozen=True, kw_only=True):
    """Continue a paused mission; refused for any other."""

    reason: str = "resumed by the operator"


class ClockTick(Message, frozen=True, kw_only=True):
    """Robot time, and its speed against the wall clock (1.0 real time, 0 as fast as possible).

    complete: everything that belongs to the time up to `t` has been published. If time runs as fast as its followers
    keep up, they answer with `ClockDone`.
    """

    t: Time
    factor: float = 1.0
    complete: bool = False


class ClockDone(Message, frozen=True, kw_only=True):
    """A follower has finished its work up to `t`, if time runs as fast as its followers keep up.

    lag: time in seconds that may pass before its next report.
    """

    t: Time
    lag: Annotated[float, msgspec.Meta(ge=0.0, le=60.0)] = 0.0


# --- mocks -------------------------------------------------------------------------------------------------


class MockedGoal(Message, frozen=True, kw_only=True):
    """A mocked skill has dispatched a goal with these inputs; the mocked world takes values from them."""

    skill: str
    goal_id: str
    inputs: dict[str, Any]


class DirectMock(Message, frozen=True, kw_only=True, tag="direct"):
    """Give a mocked skill the run of a goal, as a mock script writes it. Reply: `MockPlan`.

    `when`: `next` goal, `always` from now on, or `now`, the goal that is running.
    """

    run: dict[str, Any]
    when: Literal["now", "next", "always"] = "next"


class ResetMock(Message, frozen=True, kw_only=True, tag="reset"):
    """Restart the script of a mocked skill, or of the mocked world's data. Reply: as for `QueryMock`."""


class QueryMock(Message, frozen=True, kw_only=True, tag="query"):
    """Query a mocked skill for its `MockPlan`, or the mocked world for its `MockedData`."""


class SetMockedData(Message, frozen=True, kw_only=True, tag="set"):
    """Set the values that the mocked world publishes, as a mock script writes them. Reply: `MockedData`."""

    data: dict[str, Any]


MockCall = DirectMock | ResetMock | QueryMock
MockedWorldCall = SetMockedData | ResetMock | QueryMock


class MockPlan(Message, frozen=True, kw_only=True):
    """Runs of a mocked skill's goals: those in `given`, then those in `script`, the last of which repeats.

    `drawn`: each goal's run is drawn from `script` by weight instead.
    """

    skill: str
    given: tuple[dict[str, Any], ...]
    script: tuple[dict[str, Any], ...]
    drawn: bool = False


class MockedData(Message, frozen=True, kw_only=True):
    """Values that the mocked world publishes now."""

    values: dict[str, Any]


# --- errors ------------------------------------------------------------------------------------------------


class ErrorCode(StrEnum):
    BAD_REQUEST = "BAD_REQUEST"
    SCHEMA_MISMATCH = "SCHEMA_MISMATCH"
    UNKNOWN_NAME = "UNKNOWN_NAME"
    UNKNOWN_GOAL = "UNKNOWN_GOAL"
    NOT_ALLOWED = "NOT_ALLOWED"
    STALE_TOKEN = "STALE_TOKEN"
    REPLACED = "REPLACED"
    TOO_LATE = "TOO_LATE"
    UNAVAILABLE = "UNAVAILABLE"
    INTERNAL = "INTERNAL"
    DENIED = "DENIED"


class ErrorReply(Message, frozen=True, kw_only=True):
    """A typed refusal: one sentence about what is wrong, and one about what to do.

    The texts may quote the request, so they are cut to a length that can always be sent.
    """

    code: ErrorCode
    message: str
    help: str = ""
    known: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name in ("message", "help"):
            text: str = getattr(self, name)
            if len(text) > LONGEST_SENTENCE:
                msgspec.structs.force_setattr(self, name, text[:LONGEST_SENTENCE] + " ...")


# --- keys --------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Keys:
    """Keys of one skillset, relative to the robot's namespace."""

    skillset: str

    def data(self, name: str) -> str:
        return f"{self.skillset}/data/{name}"

    @property
    def resource_states(self) -> str:
        return f"{self.skillset}/resource/state"

    @property
    def resource_robot(self) -> str:
        return f"{self.skillset}/resource/robot"

    @property
    def resource_ready(self) -> str:
        return f"{self.skillset}/resource/ready"

    @property
    def resource_extern(self) -> str:
        return f"{self.skillset}/resource/extern"

    @property
    def resource_goal(self) -> str:
        return f"{self.skillset}/resource/goal"

    @property
    def resource_attach(self) -> str:
        return f"{self.skillset}/resource/attach"

    @property
    def resource_steps(self) -> str:
        """Publications of the resource manager's steps."""
        return f"{self.skillset}/resource/step"

    def verdict(self, skill: str) -> str:
        """Publications of `Violated` and `Lost`, for the skill's manager and the robot bridge; `"*"` for all."""
        return f"{self.skillset}/resource/verdict/{skill}"

    def event(self, name: str) -> str:
        return f"{self.skillset}/event/{name}"

    def start(self, skill: str) -> str:
        return f"{self.skillset}/skill/{skill}/start"

    def interrupt(self, skill: str) -> str:
        return f"{self.skillset}/skill/{skill}/interrupt"

    def modify(self, skill: str) -> str:
        return f"{self.skillset}/skill/{skill}/modify"

    def goal(self, skill: str) -> str:
        return f"{self.skillset}/skill/{skill}/goal"

    def status(self, skill: str) -> str:
        return f"{self.skillset}/skill/{skill}/status"

    def progress(self, skill: str) -> str:
        return f"{self.skillset}/skill/{skill}/progress"

    def alive(self, process: str) -> str:
        """Liveliness token of a process; `"**"` for all."""
        return f"{self.skillset}/alive/{process}"

    def leader(self, mark: str) -> str:
        """Liveliness token of the process that is the resource manager now; `"*"` for all."""
        return f"{self.skillset}/leader/{mark}"

    def candidate(self, mark: str) -> str:
        """Liveliness token of a process that stands for leader; `"*"` for all."""
        return f"{self.skillset}/candidate/{mark}"

    @property
    def timeline(self) -> str:
        return f"{self.skillset}/timeline"

    @property
    def exits(self) -> str:
        """Publications of the launcher about processes that have ended."""
        return f"{self.skillset}/exit"

    def mocked_goal(self, skill: str) -> str:
        """Publications of a mocked skill's goals; `"*"` for all."""
        return f"{self.skillset}/mock/goal/{skill}"

    def mocked_skill(self, skill: str) -> str:
        """Query that directs a mocked skill."""
        return f"{self.skillset}/mock/skill/{skill}"

    @property
    def mocked_world(self) -> str:
        """Query that directs the mocked world."""
        return f"{self.skillset}/mock/world"

    @property
    def mission_tree(self) -> str:
        return f"{self.skillset}/mission/tree"

    @property
    def mission_status(self) -> str:
        return f"{self.skillset}/mission/status"

    @property
    def mission_start(self) -> str:
        """Query that starts a mission on board."""
        return f"{self.skillset}/mission/start"

    @property
    def mission_abort(self) -> str:
        """Query that aborts the running mission."""
        return f"{self.skillset}/mission/abort"

    @property
    def mission_pause(self) -> str:
        """Query that pauses the running mission."""
        return f"{self.skillset}/mission/pause"

    @property
    def mission_resume(self) -> str:
        """Query that continues a paused mission."""
        return f"{self.skillset}/mission/resume"
