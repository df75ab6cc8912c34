"""The skill manager: the process around `SkillCore` that runs the developer's hooks."""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, TypeVar

import msgspec

from skillwing.dsl import load
from skillwing.dsl.model import Skillset
from skillwing.services.bus import Answer, Answered, Bus, Handle, Node, NoReply, Refused, Sample
from skillwing.services.bus.reading import message_reader
from skillwing.services.client.retry import CUT_OFF_DELAY, retry_delay
from skillwing.services.core.events import TimePassed
from skillwing.services.core.owners import ProcessExits, owner_grace
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.skill_actions import Action, AskResources, CallHook, Hook
from skillwing.services.core.skill_core import RENEWAL_PERIOD, SkillCore
from skillwing.services.core.skill_events import (
    Dispatched,
    Event,
    Failed,
    OwnerGone,
    QuestionAnswered,
    Raised,
    RenewalAnswered,
    StopConfirmed,
    Terminated,
    Validated,
)
from skillwing.services.core.values import fit_fields
from skillwing.services.errors import InvalidOptionError
from skillwing.services.managers.alarm import Alarm
from skillwing.services.managers.hook_bus import HookBus
from skillwing.services.managers.hooks import Goal, SkillHooks
from skillwing.services.managers.liveliness_monitor import LivelinessMonitor
from skillwing.services.managers.registration import Registration
from skillwing.services.managers.serving import serve
from skillwing.services.names import BLOCKED, CLIENT, skill_process
from skillwing.services.options import imported, required
from skillwing.services.protocol import (
    AttachManager,
    Ending,
    ErrorCode,
    ErrorReply,
    GoalProgress,
    GoalStatus,
    GoalVerdict,
    InterruptGoal,
    Keys,
    Lost,
    ModifyGoal,
    NodesExited,
    ProtocolError,
    QueryGoal,
    RecordKind,
    RenewGoal,
    StartGoal,
    State,
    Terminal,
    Violated,
    decode,
    encode,
    learn,
)
from skillwing.services.timeline import Timeline

__all__ = ["Goal", "SkillHooks", "SkillManagerNode", "make_skill_manager"]

T = TypeVar("T")
log = logging.getLogger(__name__)


class SkillManagerNode:
    """Shell of `SkillCore`: one skill, its hooks, and their place on the bus.

    Raises UnknownNameError if the skillset has no such skill.
    """

    owns_clock = False

    def __init__(self, hooks: SkillHooks[Any, Any, Any], skillset: Skillset) -> None:
        self._hooks = hooks
        self._skillset = skillset
        self._model = skillset.skill(hooks.skill)
        self._keys = Keys(skillset.name)
        self._actions: deque[Action] = deque()
        self._performing = False
        self._exits = ProcessExits()
        self._progress_timer: Handle | None = None
        self._renewal_timer: Handle | None = None
        if hooks.Inputs is not None:
            learn(hooks.Inputs)

    @property
    def name(self) -> str:
        return skill_process(self._model.name)

    def attach(self, bus: Bus) -> None:
        self._bus = bus
        keys, skill = self._keys, self._model.name
        self._timeline = Timeline(bus, keys)
        incarnation = bus.new_id()
        self._core = SkillCore(
            self._skillset,
            skill,
            source=self.name,
            new_record_id=self._timeline.new_id,
            incarnation=incarnation,
        )
        self._alarm = Alarm(bus, lambda: self._step(TimePassed()))
        self._status = bus.advertise(keys.status(skill), events=True)
        self._progress = bus.advertise(keys.progress(skill))
        self._hooks.bind(HookBus(bus, self._guard_callback), self)
        self._hooks.setup()
        bus.subscribe(keys.verdict(skill), self._on_verdict, events=True)
        # No events: an old exit says nothing about the owners of today.
        bus.subscribe(keys.exits, message_reader(NodesExited, self._exits.note))
        self._owners = LivelinessMonitor(
            *(bus, keys, f"{CLIENT}*", self._on_owner_gone),
            from_outside=True,
            grace=lambda owner: owner_grace(self._core.current, owner),
        )
        serve(bus, keys.start(skill), StartGoal, self._answer_start)
        serve(bus, keys.interrupt(skill), InterruptGoal, self._answer_interrupt)
        serve(bus, keys.modify(skill), ModifyGoal, self._answer_modify)
        serve(bus, keys.goal(skill), QueryGoal, lambda query, key: self._core.status(query.goal_id))
        # The resource manager must not mistake this process for a predecessor whose token was briefly missing.
        attach = AttachManager(manager=self.name, incarnation=incarnation, schema=self._skillset.schema_hash)
        self._registration = Registration(bus, keys, attach, self._on_replaced)
        self._registration.ask()
        self._alive: Handle = bus.declare_alive(keys.alive(self.name))

    def detach(self) -> None:
        """Stop what still runs. The resource manager frees what the goal holds when the alive token is gone."""
        goal = self._hooks.current
        if goal is not None:
            reason = "The skill's manager was shut down."
            self._leave(goal, Terminal(ending=Ending.LOST, reason=reason, detected_by=self.name))
        if self._core.dropped_calls:
            log.info("%d calls came for goals that were over, and were dropped.", self._core.dropped_calls)
        self._registration.give_up()
        self._alive.cancel()

    # --- input ------------------------------------------------------------------------------------------------------

    def _answer_start(self, request: StartGoal, key: str) -> GoalStatus:
        del key
        self._step(request)
        if request.owner is not None:
            # After the step, for the goal's grace counts.
            self._owners.expect(request.owner)
        return self._core.status(request.goal_id)

    def _answer_interrupt(self, request: InterruptGoal, key: str) -> GoalStatus:
        del key
        self._step(request)
        return self._core.status(request.goal_id)

    def _answer_modify(self, request: ModifyGoal, key: str) -> GoalStatus:
        del key
        if type(self._hooks).on_modify is SkillHooks.on_modify and self._model.modifiable:
            text = f"The manager of `{self._model.name}` cannot modify a goal yet."
            raise RefusedError(ErrorCode.NOT_ALLOWED, text, help="Write its hook `on_modify`.")
        self._step(request)
        self._core.modifications.require_accepted(request.request_id)
        return self._core.status(request.goal_id)

    def _on_owner_gone(self, owner: str) -> None:
        self._step(OwnerGone(owner, self._exits.of_owner(owner)))

    def _on_verdict(self, sample: Sample) -> None:
        try:
            verdict = decode(sample.payload, _union(Violated | Lost))
        except ProtocolError as error:
            log.warning("dropped a verdict: %s", error)
        else:
            self._step(verdict)
            self._check_replaced(verdict)

    def _on_replaced(self, refusal: ErrorReply) -> None:
        """End this process, because a successor has attached. Supervision may start another one."""
        self._registration.give_up()
        log.error("%s This one ends.", refusal.message)
        self._bus.post(self._end)

    def _end(self) -> None:
        self.detach()
        self._bus.close()

    def _check_replaced(self, answer: GoalVerdict | ErrorReply | None) -> None:
        """Attach again at once after `STALE_TOKEN` or `Lost`: if this process was replaced, the reply says so."""
        if isinstance(answer, Lost) or (isinstance(answer, ErrorReply) and answer.code is ErrorCode.STALE_TOKEN):
            self._registration.ask()

    def _on_resources_answer(self, asked: AskResources, answer: Answer) -> None:
        if isinstance(answer, NoReply) and not self._bus.connected:
            # This process is cut off; the resource manager may work.
            self._bus.after(CUT_OFF_DELAY, lambda: self._ask(asked), wall=True)
            return
        verdict = _verdict(answer)
        if isinstance(verdict, ErrorReply) and verdict.code is ErrorCode.REPLACED:
            # The goal gets no answer from here: the successor may run it.
            self._on_replaced(verdict)
            return
        self._step(QuestionAnswered(asked, verdict))
        self._check_replaced(verdict)

    # --- requests of hooks -------------------------------------------------------------------------------------------

    def terminated(self, goal_id: str, result: str, output: object, cause: str | None, why: str) -> None:
        fields = None if output is None else msgspec.to_builtins(output)
        self._step(Terminated(goal_id, result, fields, cause, why))

    def interrupted(self, goal_id: str) -> None:
        self._step(StopConfirmed(goal_id))

    def failed(self, goal_id: str, reason: str, cause: str | None) -> None:
        self._step(Failed(goal_id, reason, cause))

    # --- carrying out ------------------------------------------------------------------------------------------------

    def _step(self, event: Event) -> None:
        """Give an event to the core, and carry out its actions one after the other. A hook may step again meanwhile.

        An action that fails is logged and stops none of the others: the core has made its step already.
        """
        self._actions.extend(self._core.step(event, self._bus.now()))
        if self._performing:
            return
        self._performing = True
        try:
            while self._actions:
                action = self._actions.popleft()
                try:
                    self._carry_out(action)
                except Exception:
                    log.exception("%s could not carry out a %s", self.name, type(action).__name__)
        finally:
            self._performing = False
        self._alarm.set(self._core.next_tick())
        self._keep_renewing()

    def _carry_out(self, action: Action) -> None:
        match action:
            case GoalStatus():
                self._publish(action)
            case AskResources(silences=0):
                self._ask(action)
            case AskResources():
                # Wall time, because a stopped robot clock is no reason to keep resources.
                self._bus.after(retry_delay(action.silences), lambda: self._ask(action), wall=True)
            case CallHook():
                self._call(action)

    def _publish(self, status: GoalStatus) -> None:
        self._status.put(encode(status))
        if self._hooks.current is not None and self._hooks.current.id == status.goal_id:
            self._hooks.record = status.record
        self._keep_progress_timer()

    def _ask(self, asked: AskResources) -> None:
        key = self._keys.resource_goal
        self._bus.ask(key, encode(asked.call), lambda answer: self._on_resources_answer(asked, answer))

    # --- renewing the grant ---

    def _keep_renewing(self) -> None:
        """Renew on the thread of the hooks, so that a hook that hangs stops the renewals."""
        if self._renewal_timer is None and self._core.renewal() is not None:
            self._renewal_timer = self._bus.after(RENEWAL_PERIOD, self._renew, wall=True)

    def _renew(self) -> None:
        self._renewal_timer = None
        renewal = self._core.renewal()
        if renewal is not None:
            on_answer = partial(self._on_renewal_answer, renewal)
            self._bus.ask(self._keys.resource_goal, encode(renewal), on_answer)
        self._keep_renewing()

    def _on_renewal_answer(self, renewal: RenewGoal, answer: Answer) -> None:
        if isinstance(answer, NoReply) and not self._bus.connected:
            return  # this process is cut off
        verdict = _verdict(answer)
        self._step(RenewalAnswered(renewal, verdict))
        self._check_replaced(verdict)

    # --- hooks -------------------------------------------------------------------------------------------------------

    def _call(self, call: CallHook) -> None:
        hooks = self._hooks
        try:
            goal = self._goal(call)
        except msgspec.ValidationError as error:
            self._report("Inputs", call.goal_id, error)
            return
        match call.hook:
            case Hook.VALIDATE:
                problem, done = self._guarded("validate", goal.id, lambda: hooks.validate(goal))
                if done:
                    self._step(Validated(goal.id, problem))
            case Hook.DISPATCH:
                hooks.current = goal
                run = self._core.current
                hooks.record = run.record if run else None
                started = self._bus.wall()
                _, done = self._guarded("on_dispatch", goal.id, lambda: hooks.on_dispatch(goal))
                if done:
                    self._dispatched(goal.id, self._bus.wall() - started)
            case Hook.MODIFY:
                hooks.current = goal
                self._guarded("on_modify", goal.id, lambda: hooks.on_modify(goal))
            case Hook.INTERRUPT:
                self._guarded("on_interrupt", goal.id, lambda: hooks.on_interrupt(goal))
            case Hook.ENDED if call.terminal is not None:
                self._leave(goal, call.terminal)
            case Hook.ENDED:
                pass

    def _dispatched(self, goal_id: str, elapsed: float) -> None:
        """Go on after `on_dispatch`. If it blocked for too long, messages that came meanwhile come first: the
        goal may be lost, and must not be published as RUNNING then."""
        if elapsed > self._model.dispatch_timeout:
            self._bus.post(lambda: self._step(Dispatched(goal_id)))
        else:
            self._step(Dispatched(goal_id))

    def _leave(self, goal: Goal[Any], terminal: Terminal) -> None:
        self._hooks.current = None
        self._keep_progress_timer()
        self._guarded("on_ended", goal.id, lambda: self._hooks.on_ended(goal, terminal))

    def _goal(self, call: CallHook) -> Goal[Any]:
        kind = self._hooks.Inputs
        inputs = dict(call.inputs) if kind is None else msgspec.convert(call.inputs, kind)
        return Goal(call.goal_id, inputs, call.token, call.started_at)

    def _guarded(self, hook: str, goal_id: str, body: Callable[[], T]) -> tuple[T | None, bool]:
        """Run a hook. Returns what it returned and True, or None and False if it raised."""
        # The time for which a hook blocks this thread is wall time, not robot time.
        started = self._bus.wall()
        try:
            return body(), True
        except Exception as error:  # noqa: BLE001 - any exception of a developer's code ends its goal, not this process
            self._report(hook, goal_id, error)
            return None, False
        finally:
            elapsed = self._bus.wall() - started
            if elapsed > self._model.dispatch_timeout:
                self._report_blocking(hook, goal_id, elapsed)

    def _report_blocking(self, hook: str, goal_id: str, seconds: float) -> None:
        text = f"`{hook}` blocked its manager for {seconds:.1f} s; hooks have to return"
        log.warning("%s: %s", self.name, text)
        cause = self._hooks.record
        self._timeline.record(RecordKind.PROCESS, self.name, None, BLOCKED, text=text, cause=cause, goal_id=goal_id)

    def _guard_callback(self, callback: str, body: Callable[[], None]) -> None:
        """Run a callback that a hook has registered, for the current goal if there is one."""
        goal = self._hooks.current
        self._guarded(callback, goal.id if goal else "", body)

    def _report(self, hook: str, goal_id: str, error: Exception) -> None:
        log.error("`%s` of %s raised", hook, self.name, exc_info=error)
        text = f"{type(error).__name__}: {error}"
        self._step(Raised(goal_id, hook, text))

    # --- progress ----------------------------------------------------------------------------------------------------

    def _keep_progress_timer(self) -> None:
        """Start or cancel the timer, so that it runs exactly while a goal is RUNNING."""
        run, period = self._core.current, self._model.progress_period
        running = run is not None and run.phase is State.RUNNING and period is not None
        if running and self._progress_timer is None and period is not None:
            self._progress_timer = self._bus.every(period, self._publish_progress)
        elif not running and self._progress_timer is not None:
            self._progress_timer.cancel()
            self._progress_timer = None

    def _publish_progress(self) -> None:
        goal = self._hooks.current
        if goal is None:
            return
        feedback, _ = self._guarded("progress", goal.id, lambda: self._feedback(goal))
        if feedback is not None:
            message = GoalProgress(goal_id=goal.id, skill=self._model.name, t=self._bus.now(), feedback=feedback)
            try:
                self._progress.put(encode(message))
            except ProtocolError as error:
                log.warning("dropped a feedback of %s: %s", self.name, error)

    def _feedback(self, goal: Goal[Any]) -> dict[str, Any] | None:
        given = msgspec.to_builtins(self._hooks.progress(goal))
        if given is None:
            return None
        if not isinstance(given, Mapping):
            raise TypeError(f"progress has to return the skill's feedback by name, not {given!r}")
        feedback, problems = fit_fields(self._model.feedback, given)
        wrong = [problem.sentence for problem in problems if problem.kind != "range"]
        if wrong:
            # Wrong feedback is no reason to end a goal.
            log.warning("dropped a feedback of %s: %s", self.name, " ".join(wrong))
            return None
        return feedback


def _verdict(answer: Answer) -> GoalVerdict | ErrorReply | None:
    """The answer of the resource manager; None for silence."""
    match answer:
        case Refused():
            return answer.error
        case Answered():
            try:
                return decode(answer.payload, _union(GoalVerdict))
            except ProtocolError as error:
                log.warning("the resource manager's answer is unreadable and counts as silence: %s", error)
        case _:
            pass
    return None


def _union(kind: Any) -> Any:
    """A union of tagged messages as `decode` takes it; type checkers have no name for its type."""
    return kind


def make_skill_manager(options: dict[str, Any]) -> Node:
    """Options: `skillset`, the path of the .skillset file; `hooks`, the developer's class as `package.module:Class`."""
    hooks = imported(options, "hooks")
    if not (isinstance(hooks, type) and issubclass(hooks, SkillHooks)):
        text = f"The option `hooks` names `{options['hooks']}`, which is no skill manager. Derive it from SkillHooks."
        raise InvalidOptionError("hooks", text)
    return SkillManagerNode(hooks(), load(required(options, "skillset")))
