"""The skillset interface, by which missions, commands and tests start skills and follow the robot's state.

Nothing here blocks. Calls send their request and return; answers arrive in callbacks on the bus's thread.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Generic, ParamSpec

import msgspec

from skillwing.dsl.model import Field, Skillset
from skillwing.services.bus import Answer, Answered, Bus, Handle, Refused, Sample
from skillwing.services.bus.identity import owned_chunk
from skillwing.services.client.causal_feed import CausalFeed
from skillwing.services.client.goal_handle import GoalHandle
from skillwing.services.client.goal_tracker import SILENCES_OF_THE_LIVING, GoalTracker
from skillwing.services.client.resource_changes import ResourceChanges
from skillwing.services.client.retry import ask_until_answered
from skillwing.services.core.latest_data import LatestData
from skillwing.services.core.values import fit_fields
from skillwing.services.errors import InvalidInputError, InvalidOptionError, RefusedError
from skillwing.services.names import CLIENT, skill_process
from skillwing.services.protocol import (
    DataReading,
    DataSample,
    Ending,
    ErrorCode,
    ErrorReply,
    GoalProgress,
    GoalStatus,
    InterruptGoal,
    Keys,
    M,
    ModifyGoal,
    ProtocolError,
    QueryData,
    QueryReady,
    ResourceStep,
    StartGoal,
    decode,
    encode,
)
from skillwing.services.timeline import Timeline

__all__ = ["GoalHandle", "SkillsetInterface"]

P = ParamSpec("P")

START_WITHIN = 30.0
"""Robot time in seconds within which a start has to arrive at its manager."""
PROBE_PERIOD = 5.0
"""Wall time in seconds between two questions about the unfinished goals."""
ORPHANED_LIMIT = 100
CLIENT_NAME = re.compile(r"[^/*$?#\x00-\x1f]{1,100}")
"""One chunk of a key: managers watch the alive tokens of owners as `client/*`, where they would not see `a/b`."""


class SkillsetInterface:
    """A client's live view of one robot.

    client: its name in goals and in the timeline; with keys it follows that of the certificate. owns_goals: goals that
    it starts are interrupted when it is gone, unless their skill has `owner_lost=continue`. owner_grace: as in
    `StartGoal`, for these goals. new_goal_id: source of goal ids, by default the bus. Raises InvalidOptionError if the
    client's name cannot be part of a key.
    """

    def __init__(
        self,
        bus: Bus,
        skillset: Skillset,
        *,
        client: str,
        owns_goals: bool = False,
        owner_grace: float = 0.0,
        new_goal_id: Callable[[], str] | None = None,
    ) -> None:
        self._bus = bus
        self.skillset = skillset
        self.client = _checked_name(client)
        self._new_goal_id = new_goal_id or bus.new_id
        self._keys = Keys(skillset.name)
        self._timeline = Timeline(bus, self._keys)
        self._data = LatestData(skillset)
        self._alive: set[str] = set()
        self._trackers: dict[str, GoalTracker] = {}
        self._orphaned: dict[str, GoalHandle] = {}
        self._interrupting_orphaned: set[str] = set()
        self._told_by: set[str] = set()
        """Skills whose feedback is subscribed to."""
        self._listeners: list[Callable[[], None]] = []
        self._data_listeners: list[Callable[[DataReading], None]] = []
        self._probe_timer: Handle | None = None
        self._owner = self._new_owner(client) if owns_goals else None
        self._owner_grace = owner_grace
        if self._owner is not None:
            bus.declare_alive(self._keys.alive(self._owner))

        self._feed = CausalFeed(
            bus, self._keys, on_step=self._on_step, on_status=self._on_status, on_change=self._changed
        )
        self._resources = self._feed.view
        self._changes = ResourceChanges(bus, skillset, self._feed, source=self.client)
        bus.subscribe(self._keys.data("*"), self._on_data, latest_only=True)
        bus.watch_alive(self._keys.alive("**"), self._on_alive)
        for item in skillset.data:
            bus.ask(self._keys.data(item.name), encode(QueryData()), self._on_reading)

    def _new_owner(self, client: str) -> str:
        """Name of an owner's token, which belongs to the holder of the certificate where there are keys."""
        part = self._new_goal_id()[-8:]
        if (identity := self._bus.identity) is not None:
            return f"{CLIENT}{owned_chunk(identity.name, f'{_checked_name(client)}-{part}')}"
        return f"{CLIENT}{client}-{part}"

    # --- goals -----------------------------------------------------------------------------------------------------

    def start(
        self,
        skill: str,
        inputs: Mapping[str, Any] | None = None,
        *,
        goal_id: str | None = None,
        cause: str | None = None,
    ) -> GoalHandle:
        """Start a skill and return at once.

        inputs: by name; structures as mappings or typed structs. cause: the timeline record that led to this start.
        Raises UnknownNameError for a skill or input that the skillset does not know, InvalidInputError for a value of
        a wrong type or a missing one. Raises RefusedError for a certificate whose role may not start skills, and
        ProtocolError for inputs too large to be sent. The manager checks ranges: such a goal ends NV. The error names
        them as well.
        """
        fitted = self.fitted(skill, inputs)
        require_allowed(self._bus, self._keys.start(skill))
        goal_id = goal_id or self._new_goal_id()
        message = StartGoal(
            goal_id=goal_id,
            inputs=fitted,
            client=self.client,
            schema=self.skillset.schema_hash,
            deadline=self._bus.now() + START_WITHIN,
            cause=cause,
            owner=self._owner,
            owner_grace=self._owner_grace,
        )
        known = goal_id in self._trackers
        tracker = self._track(skill, goal_id)
        try:
            tracker.start(message)
        except ProtocolError:
            if not known:
                del self._trackers[goal_id]
            raise
        return tracker.handle

    def fitted(self, skill: str, inputs: Mapping[str, Any] | None) -> dict[str, Any]:
        """The inputs of a skill as they are sent, defaults filled in; raises as `start` does. On any thread."""
        model = self.skillset.skill(skill)
        given: dict[str, Any] = msgspec.to_builtins(dict(inputs or {}))
        for name in given:
            model.input(name)
        return self._checked(skill, model.inputs, given)

    def _checked(self, skill: str, fields: Sequence[Field], given: dict[str, Any]) -> dict[str, Any]:
        fitted, problems = fit_fields(fields, given)
        if any(problem.kind != "range" for problem in problems):
            raise InvalidInputError(skill, {problem.path: problem.sentence for problem in problems})
        return fitted

    def ask_ready(
        self, skill: str, on_answer: Callable[[Answer], None], inputs: Mapping[str, Any] | None = None
    ) -> None:
        """Ask whether a skill may start now; the answer is a `ReadyReport`. Nothing is started.

        inputs: None to ask without them. An empty skill asks about all. Hooks such as `validate` are not called. Raises
        as `start` does.
        """
        given = None if inputs is None else self.fitted(skill, inputs)
        query = QueryReady(
            skill=skill and self.skillset.skill(skill).name, inputs=given, schema=self.skillset.schema_hash
        )
        self._bus.ask(self._keys.resource_ready, encode(query), on_answer)

    def follow(self, skill: str, goal_id: str) -> GoalHandle:
        """A handle on a goal that another client started. Raises UnknownNameError for an unknown skill."""
        tracker = self._track(self.skillset.skill(skill).name, goal_id)
        tracker.follow()
        return tracker.handle

    def interrupt(self, goal: GoalHandle, *, cause: str | None = None) -> None:
        """Ask for the end of a goal. It does no harm to repeat it, or to ask before the start or after the end.

        Raises RefusedError for a certificate whose role may not interrupt.
        """
        require_allowed(self._bus, self._keys.interrupt(goal.skill))
        tracker = self._trackers.get(goal.goal_id)
        if tracker is not None:
            tracker.interrupt(cause)

    def modify(
        self,
        goal: GoalHandle,
        inputs: Mapping[str, Any],
        on_answer: Callable[[Answer], None],
        *,
        cause: str | None = None,
    ) -> None:
        """Give a running goal new values for modifiable inputs; the others stay. All are taken, or none.

        The answer is a `GoalStatus` or a refusal, also for a goal that has ended. It is `NoReply` if the manager stays
        silent. A goal that does not run yet is waited for. Raises UnknownNameError for an input that the skillset does
        not know, InvalidInputError for a value of a wrong type.
        """
        values = self.fitted_changes(goal.skill, inputs)
        tracker = self._trackers.get(goal.goal_id)
        if tracker is None:
            message = f"The goal of `{goal.skill}` has ended."
            refusal = ErrorReply(code=ErrorCode.NOT_ALLOWED, message=message, help="Start another one.")
            self._bus.post(lambda: on_answer(Refused(refusal)))
            return
        request = ModifyGoal(
            goal_id=goal.goal_id,
            request_id=self._bus.new_id(),
            inputs=values,
            client=self.client,
            schema=self.skillset.schema_hash,
            deadline=self._bus.now() + START_WITHIN,
            cause=cause,
        )
        tracker.modify(request, on_answer)

    def fitted_changes(self, skill: str, inputs: Mapping[str, Any]) -> dict[str, Any]:
        """New values of some inputs as they are sent; raises as `modify` does. On any thread."""
        model = self.skillset.skill(skill)
        fields = [model.input(name) for name in inputs]
        return self._checked(skill, fields, msgspec.to_builtins(dict(inputs)))

    # --- resources and events --------------------------------------------------------------------------------------

    @property
    def ready(self) -> bool:
        """The resource states are known."""
        return self._resources.ready

    @property
    def states(self) -> Mapping[str, str]:
        """State of each resource, live; empty until the resource manager's first answer."""
        return self._resources.states

    @property
    def step(self) -> int | None:
        """Number of the resource manager's step after which these are the states; None until known."""
        return self._resources.number

    @property
    def resource_manager_silent(self) -> bool:
        """The resource manager does not answer: a goal may be shown without the states that it follows from."""
        return self._feed.silent

    def state(self, resource: str) -> str | None:
        """State of one resource, None until known. Raises UnknownNameError."""
        return self._resources.states.get(self.skillset.resource(resource).name)

    def change_record(self, resource: str) -> str | None:
        """Timeline id of the last change of a resource that was seen. Raises UnknownNameError."""
        return self._resources.change_record(self.skillset.resource(resource).name)

    def trigger(
        self, resource: str, target: str, on_answer: Callable[[Answer], None], cause: str | None = None
    ) -> None:
        """Drive an extern transition. Raises UnknownNameError for a resource or state that does not exist."""
        self._changes.trigger(resource, target, on_answer, cause)

    def fire(self, event: str, on_answer: Callable[[Answer], None], cause: str | None = None) -> None:
        """Fire an event. Raises UnknownNameError."""
        self._changes.fire(event, on_answer, cause)

    # --- data ------------------------------------------------------------------------------------------------------

    def reading(self, datum: str) -> DataReading:
        """Latest value of a datum, its age as of now. Raises UnknownNameError."""
        return self._data.reading(self.skillset.datum(datum).name, self._bus.now())

    # --- waking up -------------------------------------------------------------------------------------------------

    def on_change(self, callback: Callable[[], None]) -> Handle:
        """Call `callback` at each change of a resource or of one of this client's goals, until the handle's cancel."""
        return _Listener(callback, self._listeners)

    def on_data(self, callback: Callable[[DataReading], None]) -> Handle:
        """Call `callback` with each value of a datum that comes in, until the handle's cancel."""
        return _Listener(callback, self._data_listeners)

    def _changed(self) -> None:
        for callback in list(self._listeners):
            callback()

    # --- what comes in ---------------------------------------------------------------------------------------------

    def _track(self, skill: str, goal_id: str) -> GoalTracker:
        known = self._trackers.get(goal_id)
        if known is not None:
            return known
        self._hear_feedback(skill)
        tracker = self._trackers[goal_id] = GoalTracker(
            self._bus,
            self._keys,
            self._timeline,
            GoalHandle(goal_id, skill),
            client=self.client,
            manager_alive=lambda: skill_process(skill) in self._alive,
            take_reply=self._feed.take_status,
            after_step=self._feed.after_step,
            after_release=self._feed.after_release,
            on_change=self._on_goal_change,
        )
        if self._probe_timer is None:
            self._probe_timer = self._bus.after(PROBE_PERIOD, self._probe, wall=True)
        return tracker

    def _hear_feedback(self, skill: str) -> None:
        """Subscribe to the feedback of a skill, before its first goal of this client is started or followed."""
        if skill not in self._told_by and self.skillset.skill(skill).progress_period is not None:
            self._told_by.add(skill)
            self._bus.subscribe(self._keys.progress(skill), self._on_progress, latest_only=True)

    def _probe(self) -> None:
        """Ask for the status of each goal: publications may be lost, and a hung manager sends none."""
        self._probe_timer = self._bus.after(PROBE_PERIOD, self._probe, wall=True) if self._trackers else None
        for tracker in list(self._trackers.values()):
            if tracker.handle.state is not None:
                tracker.probe()

    def _on_goal_change(self, goal: GoalHandle) -> None:
        if goal.terminal is not None:
            self._trackers.pop(goal.goal_id, None)
            if goal.terminal.detected_by == "client":
                self._orphan(goal)
        self._changed()

    def _orphan(self, goal: GoalHandle) -> None:
        """Remember a goal whose client was told that it is over, to interrupt it if its manager comes back."""
        if len(self._orphaned) >= ORPHANED_LIMIT:
            self._orphaned.pop(next(iter(self._orphaned)))
        self._orphaned[goal.goal_id] = goal
        lost = goal.terminal is not None and goal.terminal.ending is Ending.LOST
        if lost and skill_process(goal.skill) in self._alive:
            self._interrupt_orphaned(goal.goal_id)  # it may have come back before the loss was shown

    def _interrupt_orphaned(self, goal_id: str) -> None:
        """Repeat the interrupt until it is answered: a manager that has just come back may not be reachable yet.

        Its cause is the record of the end that the client was told.
        """
        if goal_id in self._interrupting_orphaned:
            return
        self._interrupting_orphaned.add(goal_id)
        goal = self._orphaned[goal_id]

        def keep_retrying(silences: int) -> bool:
            worth_it = skill_process(goal.skill) in self._alive and silences < SILENCES_OF_THE_LIVING
            return goal_id in self._orphaned and worth_it

        ask_until_answered(
            self._bus,
            self._keys.interrupt(goal.skill),
            encode(InterruptGoal(goal_id=goal_id, client=self.client, cause=goal.record)),
            lambda answer: self._interrupting_orphaned.discard(goal_id),
            keep_retrying=keep_retrying,
            on_silence=lambda: self._interrupting_orphaned.discard(goal_id),
        )

    def _on_step(self, step: ResourceStep) -> None:
        for verdict in step.verdicts:
            if (tracker := self._trackers.get(verdict.goal_id)) is not None:
                tracker.on_verdict(verdict)

    def _on_status(self, status: GoalStatus) -> None:
        tracker = self._trackers.get(status.goal_id)
        if tracker is not None:
            tracker.advance(status)
        elif status.goal_id in self._orphaned:
            if status.terminal is None:
                self._interrupt_orphaned(status.goal_id)
            else:
                del self._orphaned[status.goal_id]

    def _on_progress(self, sample: Sample) -> None:
        progress = _decoded(sample.payload, GoalProgress)
        if progress is not None and (tracker := self._trackers.get(progress.goal_id)):
            tracker.handle.feed_back(progress.feedback)
            self._changed()

    def _on_alive(self, key: str, alive: bool) -> None:
        process = key.removeprefix(self._keys.alive(""))
        (self._alive.add if alive else self._alive.discard)(process)
        for tracker in list(self._trackers.values()):
            if process == skill_process(tracker.handle.skill) and tracker.handle.state is not None:
                tracker.probe()
        if alive:
            for goal_id, goal in list(self._orphaned.items()):
                if process == skill_process(goal.skill):
                    self._interrupt_orphaned(goal_id)

    def _on_data(self, sample: Sample) -> None:
        message = _decoded(sample.payload, DataSample)
        if message is not None:
            self._take_data(message)

    def _on_reading(self, answer: Answer) -> None:
        reading = _decoded(answer.payload, DataReading) if isinstance(answer, Answered) else None
        if reading is not None and reading.t is not None:
            self._take_data(DataSample(name=reading.name, value=reading.value, t=reading.t))

    def _take_data(self, sample: DataSample) -> None:
        now = self._bus.now()
        if self._data.accept(sample, now) is None:
            reading = self._data.reading(sample.name, now)
            for callback in list(self._data_listeners):
                callback(reading)


class _Listener(Generic[P]):
    """A callback in a list; `cancel` removes it."""

    def __init__(self, callback: Callable[P, None], listeners: list[Callable[P, None]]) -> None:
        self._callback = callback
        self._listeners = listeners
        listeners.append(callback)

    def cancel(self) -> None:
        if self._callback in self._listeners:
            self._listeners.remove(self._callback)


def require_allowed(bus: Bus, key: str) -> None:
    """Raise RefusedError if the role of this node's certificate may not ask at a key. The router would drop it."""
    reply = None if bus.identity is None else bus.identity.refusal(key)
    if reply is not None:
        raise RefusedError(reply.code, reply.message, help=reply.help)


def _checked_name(client: str) -> str:
    if CLIENT_NAME.fullmatch(client) is None:
        text = f"A client cannot be called {client!r}. Take 1 to 100 characters, none of them /, *, $, ? or #."
        raise InvalidOptionError("client", text)
    return client


def _decoded(payload: bytes, kind: type[M]) -> M | None:
    """The message, or None for a payload that is none."""
    try:
        return decode(payload, kind)
    except ProtocolError:
        return None
