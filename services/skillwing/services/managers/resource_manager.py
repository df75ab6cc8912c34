"""The resource manager process: the one judge of who may take what, and of who may keep it."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Mapping
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any, NoReturn, TypeVar

from skillwing.dsl import load
from skillwing.dsl.model import Skillset
from skillwing.services.bus import Answer, Answered, Bus, Handle, Node, Publisher, Sample
from skillwing.services.core.latest_data import LatestData
from skillwing.services.core.leases import Expired
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.resource_core import Publication, ResourceCore, Step
from skillwing.services.core.snapshot import Snapshot
from skillwing.services.journal.errors import JournalError, JournalTakenError
from skillwing.services.journal.journal import Journal
from skillwing.services.journal.schema import Identity
from skillwing.services.managers.alarm import Alarm
from skillwing.services.managers.journaled_core import JournaledCore, TakeStep, UnwrittenError
from skillwing.services.managers.leader_election import LeaderElection
from skillwing.services.managers.lease_watch import LeaseWatch
from skillwing.services.managers.liveliness_monitor import LivelinessMonitor
from skillwing.services.managers.serving import serve
from skillwing.services.names import RESOURCE_MANAGER, STEPS_FOLDER
from skillwing.services.options import required
from skillwing.services.protocol import (
    AttachManager,
    BeginGoal,
    DataReading,
    DataSample,
    EndGoal,
    ErrorCode,
    FireEvent,
    FireExtern,
    GoalCall,
    GoalVerdict,
    Keys,
    Lost,
    ProtocolError,
    QueryData,
    QueryStates,
    Record,
    RecordOutcome,
    ResourceChange,
    ResourceStates,
    Violated,
    decode,
    encode,
)
from skillwing.services.replay.files import StepWriter
from skillwing.services.replay.recorded_core import RecordedCore
from skillwing.services.replay.steps import head_of
from skillwing.services.timeline import Timeline

R = TypeVar("R")
log = logging.getLogger(__name__)

GRANT_LEASE = 2.0
"""Wall time in seconds within which a manager has to renew a grant, which it does four times as often."""
DISPATCH_GRACE = 1.0
"""Seconds past its `dispatch_timeout` that a skill may take for `on_dispatch` until its manager counts as hung."""
WRITE_AGAIN = 1.0
"""Wall time in seconds after which what could not be written to the journal is tried again."""


class ResourceManagerNode:
    """Shell of `ResourceCore`.

    found: states in which resources are found at the start, not their initial ones. journal: gets every change before
    anybody hears of it; if there is something in it this node goes on from there. By default one in memory. steps: gets
    all that is asked and answered, to be replayed. contended: somebody else might judge here, so that this one begins
    only when it knows that nobody does, and ends where somebody came after it.
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
    ) -> None:
        self._skillset = skillset
        self._found = found
        self._keys = Keys(skillset.name)
        self._journal = journal or Journal(None, Identity("", skillset.name, skillset.schema_hash))
        self._steps = steps
        self._contended = contended
        self._alive: Handle | None = None
        self._left: str | None = None
        """Why nothing is answered any more."""
        self._rejudging: Handle | None = None

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
        self._changes: dict[str, Publisher] = {
            resource.name: bus.advertise(keys.resource(resource.name), events=True)
            for resource in self._skillset.resources
        }
        self._verdicts: dict[str, Publisher] = {
            skill.name: bus.advertise(keys.verdict(skill.name), events=True) for skill in self._skillset.skills
        }
        self._alarm = Alarm(bus, self._judge_anew)
        self._leases = LeaseWatch(bus, self._on_silent)
        self._journaled = JournaledCore(self._journal, self._make_core)
        kept = self._journal.snapshot()
        if kept is None:
            self._journaled.begin(bus.now())
            self._open()
        else:
            # A timer of robot time: whether the journal is of this life of the robot shows when its time is known.
            bus.after(0.0, lambda: self._resume(kept))

    @property
    def _core(self) -> ResourceCore:
        return self._journaled.core

    def _make_core(self, kept: Snapshot | None, data: LatestData | None) -> ResourceCore:
        make = ResourceCore
        if self._steps is not None:
            make = partial(RecordedCore, writer=self._steps, remembered=self._journal.kept, now=self._bus.now())
        new_id = self._timeline.new_id
        return make(self._skillset, source=self.name, new_record_id=new_id, found=self._found, kept=kept, data=data)

    def _resume(self, kept: Snapshot) -> None:
        resumed = self._journaled.resume(kept, self._bus.now(), follows_time=self._bus.follows_time)
        self._open()
        if not resumed:
            return
        step = self._take(lambda core, now: core.resume(kept, now))
        self._publish((*step.reply, *step.publications))
        for grant in self._core.grants:
            self._liveliness.expect(grant.manager)
        for datum in self._core.data_names:
            self._bus.ask(self._keys.data(datum), encode(QueryData()), self._on_reading)

    def _open(self) -> None:
        """Follow the world, and answer whoever asks."""
        bus, keys = self._bus, self._keys
        self._liveliness = LivelinessMonitor(bus, keys, "**", self._on_gone)
        for each in self._core.data_names:
            bus.subscribe(keys.data(each), self._on_datum, latest_only=True)
        serve(bus, keys.resource_states, QueryStates, self._answer_states)
        serve(bus, keys.resource_extern, FireExtern, self._answer_extern)
        serve(bus, keys.event("*"), FireEvent, self._answer_event)
        serve(bus, keys.resource_attach, AttachManager, self._answer_attach)
        serve(bus, keys.resource_goal, GoalCall, self._answer_goal)
        self._alive = bus.declare_alive(keys.alive(self.name))

    def _leave(self, why: str) -> None:
        """Refuse whatever is asked, until this process has left the network.

        What is served stays declared. A Zenoh router may go on sending the questions of those who are there to a server
        that has taken back its declaration, and to none that takes its place, until that session is closed.
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
        """Leave to the successor. Supervision may start us anew."""
        self.detach()
        self._bus.close()

    # --- what comes in -----------------------------------------------------------------------------------------------

    def _answer_states(self, query: QueryStates, key: str) -> ResourceStates:
        del query, key
        return self._perform(lambda core, now: Step(core.snapshot(now)))

    def _answer_extern(self, request: FireExtern, key: str) -> ResourceStates:
        del key
        return self._perform(lambda core, now: core.fire_extern(request, now))

    def _answer_event(self, request: FireEvent, key: str) -> ResourceStates:
        if self._keys.event(request.event) != key:
            text = f"The event `{request.event}` was fired on the key of another one, {key}."
            raise RefusedError(ErrorCode.BAD_REQUEST, text, help="Send it on its own key.")
        return self._perform(lambda core, now: core.fire_event(request, now))

    def _answer_attach(self, request: AttachManager, key: str) -> ResourceStates:
        del key
        return self._perform(lambda core, now: core.attach_manager(request, now))

    def _answer_goal(self, call: GoalCall, key: str) -> GoalVerdict:
        del key
        match call:
            case BeginGoal():
                return self._perform(lambda core, now: core.begin(call, now))
            case EndGoal():
                return self._perform(lambda core, now: core.end(call, now))
            case RecordOutcome():
                return self._perform(lambda core, now: core.record_outcome(call, now))
            case _:
                verdict = self._perform(lambda core, _: core.renew(call))
                self._leases.renew(call.goal_id, GRANT_LEASE)
                return verdict

    def _on_datum(self, sample: Sample) -> None:
        try:
            datum = decode(sample.payload, DataSample)
            self._perform(lambda core, now: core.update_datum(datum, now))
        except (ProtocolError, RefusedError) as error:
            # The data manager, which follows all data, is the one that complains.
            log.debug("dropped a sample on %s: %s", sample.key, error)

    def _on_reading(self, answer: Answer) -> None:
        if not isinstance(answer, Answered):
            return
        try:
            reading = decode(answer.payload, DataReading)
            if reading.t is not None:
                sample = DataSample(name=reading.name, value=reading.value, t=reading.t)
                self._perform(lambda core, now: core.update_datum(sample, now))
        except (ProtocolError, RefusedError) as error:
            log.debug("dropped what the data manager knows: %s", error)

    def _on_gone(self, process: str) -> None:
        try:
            self._perform(lambda core, now: core.manager_lost(process, now))
        except RefusedError:
            # Once more, if it does not come back until then.
            self._liveliness.expect(process)

    def _on_silent(self, lease: Expired) -> None:
        reason = f"silent for {lease.silence:.1f} s"
        try:
            self._perform(lambda core, now: core.goal_lost(lease.key, now, reason))
        except RefusedError:
            # Once more, if it is not renewed until then.
            self._leases.begin(lease.key, WRITE_AGAIN)

    def _keep_leases(self) -> None:
        """Every grant has a lease, and nothing else has one."""
        held = {grant.goal_id: grant for grant in self._core.grants}
        for goal_id in self._leases.keys:
            if goal_id not in held:
                self._leases.end(goal_id)
        for goal_id, grant in held.items():
            if goal_id not in self._leases:
                # Its manager renews nothing before `on_dispatch` has returned.
                self._leases.begin(goal_id, max(GRANT_LEASE, grant.skill.dispatch_timeout + DISPATCH_GRACE))

    # --- what goes out -----------------------------------------------------------------------------------------------

    def _perform(self, take: TakeStep[R]) -> R:
        """Take a step, publish what it has brought about, and return its reply; raises as `_take` does."""
        step = self._take(take)
        self._publish(step.publications)
        return step.reply

    def _take(self, take: TakeStep[R]) -> Step[R]:
        """Take a step, written down before anybody hears of it.

        Raises RefusedError where it is refused, and UnwrittenError.
        """
        if self._left is not None:
            raise RefusedError(ErrorCode.UNAVAILABLE, self._left, help="Ask the next one.")
        try:
            step = self._journaled.take(take, self._bus.now())
        except JournalTakenError as error:
            self._make_way(str(error))
            raise RefusedError(ErrorCode.UNAVAILABLE, str(error), help="Ask the other one.") from error
        except JournalError as error:
            self._leave(str(error))
            self._bus.post(partial(_crash, error))
            raise RefusedError(ErrorCode.UNAVAILABLE, str(error), help="Ask again.") from error
        except UnwrittenError:
            # What was to be judged may be no request that anybody repeats.
            if self._rejudging is None:
                self._rejudging = self._bus.after(WRITE_AGAIN, self._judge_anew, wall=True)
            raise
        self._keep_leases()
        self._alarm.set(self._core.next_tick(self._bus.now()))
        return step

    def _publish(self, publications: Iterable[Publication]) -> None:
        # Verdicts go first: whoever has to stop is told before whoever only wants to know.
        for publication in sorted(publications, key=lambda each: not isinstance(each, Violated | Lost)):
            try:
                self._put(publication)
            except ProtocolError:
                # The step stands, and the others have to hear of it all the same.
                log.exception("cannot send a %s", type(publication).__name__)

    def _put(self, publication: Publication) -> None:
        match publication:
            case Record():
                self._timeline.publish(publication)
            case ResourceChange():
                self._changes[publication.resource].put(encode(publication))
            case Violated() | Lost():
                self._verdicts[publication.skill].put(encode(publication))

    def _judge_anew(self) -> None:
        """Judge the invariants at this instant."""
        if self._rejudging is not None:
            self._rejudging.cancel()
            self._rejudging = None
        with suppress(RefusedError):
            self._perform(lambda core, now: core.tick(now))


def _crash(error: JournalError) -> NoReturn:
    """End the process, outside of any answer; the next one reads the journal or says what is wrong with it."""
    raise error


def make_resource_manager(options: dict[str, Any]) -> Node:
    """Options: `skillset`, the path of the .skillset file; `robot`, its name; `journal`, the path of the journal, in
    memory by default, beside which all steps are written down; `durable`, whether it is to be safe from power loss;
    `contended`, whether another one could be there, which by default it could.

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
    steps = None if path is None else StepWriter(Path(path).with_name(STEPS_FOLDER), head_of(identity, source))
    return ResourceManagerNode(skillset, journal=journal, steps=steps, contended=options.get("contended", True))
