"""The resource manager process: the one authority over resources and grants of a robot."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from functools import cached_property, partial
from pathlib import Path
from typing import Any, NoReturn, TypeVar

from skillwing.dsl import load
from skillwing.dsl.model import Skillset
from skillwing.dsl.printing.source import to_source
from skillwing.services.bus import Answer, Answered, Bus, Handle, Node, Publisher, Sample
from skillwing.services.bus.reading import message_reader
from skillwing.services.core.events import Event, GoalSilent, ManagerExited, ManagerGone, Resumed, TimePassed
from skillwing.services.core.latest_data import LatestData
from skillwing.services.core.leases import Expired
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.resource_core import ResourceCore, Step, publications_to_repeat
from skillwing.services.core.snapshot import Snapshot
from skillwing.services.journal.errors import JournalError, JournalTakenError
from skillwing.services.journal.journal import Journal
from skillwing.services.journal.schema import Identity
from skillwing.services.managers.alarm import Alarm
from skillwing.services.managers.journaled_core import JournaledCore, Stepper, UnwrittenError
from skillwing.services.managers.leader_election import LeaderElection
from skillwing.services.managers.leased_core import LeasedCore
from skillwing.services.managers.liveliness_monitor import LivelinessMonitor
from skillwing.services.managers.serving import serve
from skillwing.services.names import RESOURCE_MANAGER, STEPS_FOLDER
from skillwing.services.options import required
from skillwing.services.protocol import (
    AttachManager,
    DataReading,
    DataSample,
    ErrorCode,
    FireEvent,
    FireExtern,
    GoalCall,
    Keys,
    Lost,
    Message,
    NodesExited,
    ProtocolError,
    QueryData,
    QueryReady,
    QueryRobot,
    QueryStates,
    ReadyReport,
    Record,
    ResourceStates,
    ResourceStep,
    RobotDescription,
    Violated,
    decode,
    encode,
)
from skillwing.services.replay.files import FILE_BYTES, FILES_KEPT, StepWriter
from skillwing.services.replay.recorded_core import RecordedCore
from skillwing.services.replay.steps import Made, head_of
from skillwing.services.timeline import Timeline

R = TypeVar("R")
log = logging.getLogger(__name__)

WRITE_AGAIN = 1.0
"""Wall time in seconds after which a failed write to the journal is tried again."""


class ResourceManagerNode:
    """Shell of `ResourceCore`, with a journal, leases of the grants, and a record of all steps.

    found: initial states that differ from the skillset's. journal: stores every change before it is published, and
    tells where to continue; one in memory by default. steps: receives all steps, to be replayed. contended: other
    resource managers are possible, so that this one begins only after an election, and ends if it is deposed.
    rescue_goal, without_goals, shared: of the robot's table; clients elsewhere ask for them.
    """

    name = RESOURCE_MANAGER
    owns_clock = False

    def __init__(
        self,
        skillset: Skillset,
        found: Mapping[str, str] | None = None,
        journal: Journal | None = None,
        steps: StepWriter | None = None,
        *,
        contended: bool = False,
        rescue_goal: Mapping[str, Any] | None = None,
        without_goals: str = "",
        shared: bool = False,
    ) -> None:
        self._rescue_goal = rescue_goal
        self._without_goals = without_goals
        self._shared = shared
        self._skillset = skillset
        self._found = found
        self._keys = Keys(skillset.name)
        self._journal = journal or Journal(None, Identity("", skillset.name, skillset.schema_hash))
        self._steps = steps
        self._contended = contended
        self._alive: Handle | None = None
        self._left: str | None = None
        """Reason of all refusals, once this process has left."""
        self._retry: Handle | None = None

    def attach(self, bus: Bus) -> None:
        self._bus = bus
        if self._contended:
            LeaderElection(bus, self._keys, self._begin, self._make_way)
        else:
            self._begin()

    def detach(self) -> None:
        self._leave("The resource manager was shut down.")
        self._journal.close()
        if self._steps is not None:
            self._steps.close()

    # --- coming and going --------------------------------------------------------------------------------------------

    def _begin(self) -> None:
        bus, keys = self._bus, self._keys
        self._timeline = Timeline(bus, keys)
        self._steps_publisher = bus.advertise(keys.resource_steps, events=True)
        self._verdicts: dict[str, Publisher] = {
            skill.name: bus.advertise(keys.verdict(skill.name), events=True) for skill in self._skillset.skills
        }
        self._alarm = Alarm(bus, self._pass_time)
        self._journaled = JournaledCore(self._journal, self._make_core, self._recorded)
        self._leased = LeasedCore(self._journaled, bus, self._on_silent)
        snapshot = self._journal.snapshot()
        if snapshot is None:
            self._journaled.begin(bus.now(), bus.new_id())
            self._open()
        else:
            # A timer of robot time: only then is it known whether robot time has started again.
            bus.after(0.0, lambda: self._resume(snapshot))

    @property
    def _core(self) -> ResourceCore:
        return self._journaled.core

    def _make_core(self, snapshot: Snapshot, data: LatestData | None) -> ResourceCore:
        new_id = self._timeline.new_id
        return ResourceCore(
            self._skillset, source=self.name, new_record_id=new_id, found=self._found, snapshot=snapshot, data=data
        )

    def _recorded(self, core: ResourceCore, snapshot: Snapshot, data: LatestData | None) -> Stepper:
        if self._steps is None:
            return core
        found = None if self._found is None else dict(self._found)
        made = Made(self._bus.now(), found, snapshot, same_data=data is not None)
        return RecordedCore(core, made, self._steps, self._journal.snapshot)

    def _resume(self, snapshot: Snapshot) -> None:
        resumed = self._journaled.resume(
            snapshot, self._bus.now(), follows_time=self._bus.follows_time, epoch=self._bus.new_id()
        )
        self._open()
        if not resumed:
            return
        step = self._take(Resumed())
        self._repeat(snapshot)
        self._publish(step)
        for grant in self._core.grants:
            self._liveliness.expect(grant.manager)
        for datum in self._core.data.names:
            self._bus.ask(self._keys.data(datum), encode(QueryData()), self._on_reading)

    def _open(self) -> None:
        """Follow data and processes, and serve requests."""
        bus, keys = self._bus, self._keys
        self._liveliness = LivelinessMonitor(bus, keys, "**", self._on_gone)
        for each in self._core.data.names:
            bus.subscribe(keys.data(each), self._on_datum, latest_only=True)
        # No events: an old exit says nothing about the goals of today.
        bus.subscribe(keys.exits, message_reader(NodesExited, self._on_exit))
        serve(bus, keys.resource_states, QueryStates, self._answer_states)
        serve(bus, keys.resource_ready, QueryReady, self._answer_ready)
        serve(bus, keys.resource_robot, QueryRobot, self._answer_robot)
        serve(bus, keys.event("*"), FireEvent, self._answer_event)
        for key, request in (
            (keys.resource_extern, FireExtern),
            (keys.resource_attach, AttachManager),
            (keys.resource_goal, GoalCall),
        ):
            serve(bus, key, request, self._answer)
        self._alive = bus.declare_alive(keys.alive(self.name))

    def _leave(self, why: str) -> None:
        """Refuse all requests until this process has left the network.

        The queryables stay declared. After an undeclaration, a Zenoh router may send the queries of present clients to
        this session until it is closed, and none to a successor.
        """
        if self._left is None:
            self._left = why
        if self._alive is not None:
            self._alive.cancel()

    def _make_way(self, why: str) -> None:
        log.critical("%s", why)
        self._leave(why)
        self._bus.post(self._end)

    def _end(self) -> None:
        """Leave to the successor. The launcher may start this process again."""
        self.detach()
        self._bus.close()

    # --- what comes in -----------------------------------------------------------------------------------------------

    def _answer(self, request: Event, key: str) -> Message:
        del key
        reply = self._perform(request).reply
        assert reply is not None, "requests have replies"
        return reply

    def _answer_event(self, request: FireEvent, key: str) -> Message:
        if self._keys.event(request.event) != key:
            text = f"The event `{request.event}` was fired on the key of another one, {key}."
            raise RefusedError(ErrorCode.BAD_REQUEST, text, help="Send it on its own key.")
        return self._answer(request, key)

    def _answer_states(self, query: QueryStates, key: str) -> ResourceStates:
        del query, key
        self._guard(self._journaled.check_hold)
        return self._core.resource_states(self._bus.now())

    def _answer_robot(self, query: QueryRobot, key: str) -> RobotDescription:
        del query, key
        return self._description

    @cached_property
    def _description(self) -> RobotDescription:
        """Answer to each client that looks for the robot. Its source takes 15 ms for the m600, so it is made once."""
        return RobotDescription(
            source=to_source(self._skillset),
            schema=self._skillset.schema_hash,
            clock="robot" if self._bus.follows_time else "wall",
            rescue_goal=None if self._rescue_goal is None else dict(self._rescue_goal),
            without_goals=self._without_goals,
            shared=self._shared,
        )

    def _answer_ready(self, query: QueryReady, key: str) -> ReadyReport:
        del key
        self._guard(self._journaled.check_hold)
        return self._core.ready_report(query, self._bus.now())

    def _on_datum(self, sample: Sample) -> None:
        try:
            self._perform(decode(sample.payload, DataSample))
        except (ProtocolError, RefusedError) as error:
            # The data manager, which follows all data, logs a warning.
            log.debug("dropped a sample on %s: %s", sample.key, error)

    def _on_reading(self, answer: Answer) -> None:
        if not isinstance(answer, Answered):
            return
        try:
            reading = decode(answer.payload, DataReading)
            if reading.t is not None:
                self._perform(DataSample(name=reading.name, value=reading.value, t=reading.t))
        except (ProtocolError, RefusedError) as error:
            log.debug("dropped a reading of the data manager: %s", error)

    def _on_exit(self, exited: NodesExited) -> None:
        """Note the exit of a process, for the causes of losses."""
        for node in exited.nodes:
            with suppress(RefusedError):
                self._perform(ManagerExited(node, exited.record, exited.t))

    def _on_gone(self, process: str) -> None:
        try:
            self._perform(ManagerGone(process))
        except RefusedError:
            # Once more, unless it comes back before.
            self._liveliness.expect(process)

    def _on_silent(self, lease: Expired) -> None:
        try:
            self._perform(GoalSilent(lease.key, f"silent for {lease.silence:.1f} s"))
        except RefusedError:
            # Once more, unless it is renewed before.
            self._leased.extend(lease.key, WRITE_AGAIN)

    def _pass_time(self) -> None:
        if self._retry is not None:
            self._retry.cancel()
            self._retry = None
        with suppress(RefusedError):
            self._perform(TimePassed())

    # --- what goes out -----------------------------------------------------------------------------------------------

    def _perform(self, event: Event) -> Step:
        """Take a step and publish it; raises as `_take` does."""
        step = self._take(event)
        self._publish(step)
        return step

    def _take(self, event: Event) -> Step:
        """Take a step, and store it before it is published. Raises RefusedError, of which UnwrittenError is one."""
        step = self._guard(lambda: self._leased.step(event, self._bus.now()))
        self._alarm.set(self._core.next_tick(self._bus.now()))
        return step

    def _guard(self, act: Callable[[], R]) -> R:
        """Use the journal. If this process must not answer any more, refuse with UNAVAILABLE and leave."""
        if self._left is not None:
            raise RefusedError(ErrorCode.UNAVAILABLE, self._left, help="Ask the next one.")
        try:
            return act()
        except JournalTakenError as error:
            self._make_way(str(error))
            raise RefusedError(ErrorCode.UNAVAILABLE, str(error), help="Ask the other one.") from error
        except JournalError as error:
            self._leave(str(error))
            self._bus.post(partial(_crash, error))
            raise RefusedError(ErrorCode.UNAVAILABLE, str(error), help="Ask again.") from error
        except UnwrittenError:
            # Nobody may repeat the event, so the invariants are checked again later.
            if self._retry is None:
                self._retry = self._bus.after(WRITE_AGAIN, self._pass_time, wall=True)
            raise

    def _publish(self, step: Step) -> None:
        """Publish a step as one event, if it tells anything. It is stored, so nothing may hold it back."""
        verdicts = tuple(each for each in step.publications if isinstance(each, Violated | Lost))
        self._push(verdicts)
        if step.publications:
            records = tuple(each for each in step.publications if isinstance(each, Record))
            event = ResourceStep(
                number=step.number, epoch=self._core.epoch, t=self._bus.now(), records=records, verdicts=verdicts
            )
            self._put(self._steps_publisher, event)

    def _push(self, verdicts: Iterable[Violated | Lost]) -> None:
        """Tell managers that have to stop, which follow no steps. They hear of it before observers."""
        for verdict in verdicts:
            self._put(self._verdicts[verdict.skill], verdict)

    def _repeat(self, snapshot: Snapshot) -> None:
        """Publish what a predecessor may not have got out. Clients ask for the states themselves."""
        publications = publications_to_repeat(snapshot)
        self._push(each for each in publications if isinstance(each, Violated | Lost))
        for record in publications:
            if isinstance(record, Record):
                self._timeline.publish(record)

    def _put(self, publisher: Publisher, message: Message) -> None:
        try:
            publisher.put(encode(message))
        except ProtocolError:
            log.exception("cannot send a %s", type(message).__name__)


def _crash(error: JournalError) -> NoReturn:
    """End the process, outside of any answer. The next one reads the journal, or reports what is wrong with it."""
    raise error


def make_resource_manager(options: dict[str, Any]) -> Node:
    """Make a resource manager from process options.

    `skillset`: path of the .skillset file. `robot`: its name. `journal`: path of the journal, beside which all steps
    are recorded; in memory and without a record by default. `durable`: makes the journal safe from power loss.
    `steps_bytes`: their largest size. `contended`: as of `ResourceManagerNode`, but true by default. `rescue_goal`,
    `without_goals`, `shared`: as there.

    Raises JournalRefusedError for a journal that may not be used, JournalWriteError where none can be written.
    """
    source = Path(required(options, "skillset"))
    skillset = load(source)
    path = options.get("journal")
    identity = Identity(options.get("robot", ""), skillset.name, skillset.schema_hash)
    if path is not None:
        Path(path).parent.mkdir(parents=True, exist_ok=True)
    journal = Journal(None if path is None else Path(path), identity, durable=bool(options.get("durable")))
    # A journal that cannot be read is to be refused here, with a sentence, before anything runs.
    journal.snapshot()
    steps = None
    if path is not None:
        kept = max(FILES_KEPT, int(options.get("steps_bytes", 0)) // FILE_BYTES)
        steps = StepWriter(Path(path).with_name(STEPS_FOLDER), head_of(identity, source), files_kept=kept)
    return ResourceManagerNode(
        skillset,
        journal=journal,
        steps=steps,
        contended=options.get("contended", True),
        rescue_goal=options.get("rescue_goal"),
        without_goals=options.get("without_goals", ""),
        shared=bool(options.get("shared")),
    )
