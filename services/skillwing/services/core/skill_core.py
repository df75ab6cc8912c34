"""The skill manager's semantics: Figure 5 of the paper, made exact.

One core is one skill, which runs one goal at a time. Every method takes an event and the robot time, and returns the
actions to carry out, in order. A request that is refused raises `RefusedError` and changes nothing.
`docs/semantics.md` gives the rules and their reasons.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from msgspec.structs import replace

from skillwing.dsl.model import Skillset, UnknownNameError
from skillwing.services.core.bounded_dict import BoundedDict
from skillwing.services.core.checks import check_goal_id, check_schema
from skillwing.services.core.grants import NO_TOKEN
from skillwing.services.core.outbox import Outbox
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.skill_actions import Action, AskResources, CallHook, Ending, GoalRun, Hook
from skillwing.services.core.values import by_path, fit_fields, sendable_text
from skillwing.services.core.verdicts import terminal_of
from skillwing.services.names import CLIENT, RESOURCE_MANAGER
from skillwing.services.protocol import (
    LONGEST_LABEL,
    BeginGoal,
    Ended,
    EndGoal,
    EndKind,
    ErrorCode,
    ErrorReply,
    GoalStatus,
    GoalVerdict,
    Granted,
    InterruptGoal,
    Lost,
    NotReady,
    ProtocolError,
    RecordKind,
    RecordOutcome,
    RenewGoal,
    StartGoal,
    State,
    Terminal,
    Violated,
    require_sendable,
)
from skillwing.services.protocol import Ending as End

GOALS_REMEMBERED = 1000
SILENCES_UNTIL_ERROR = 10
"""NoReply questions to the resource manager after which a goal gets its terminal answer all the same. Where nobody
is there to be asked that is 5.6 s, so that it may be started again meanwhile; one that hangs lets each question run
into its timeout of 2 s, which makes 26 s."""
SILENCES_UNTIL_SETTLED = 600
"""Then the manager goes on trying, about this often, to give back what the goal may hold."""
AS_GOOD_AS_SILENCE = (ErrorCode.UNAVAILABLE, ErrorCode.INTERNAL)
RENEWAL_PERIOD = 0.5
"""Wall time in seconds between two renewals of a grant."""
DOUBTS_AT_ONCE = 100
"""Goals that a manager is about to end by its own word, or has ended so without the resource manager's knowledge."""
RENEWALS_UNTIL_UNWATCHED = 20
"""Renewals in a row that stay unanswered, 10 s to 12 s of wall time, until a goal is interrupted: nobody watches its
invariants. A resource manager that is started again is back long before that."""


class SkillCore:
    """The state of one skill's manager.

    source: name of the process, for grants and the timeline; incarnation: which one of that name.
    new_record_id: gives each timeline record its id.
    """

    def __init__(
        self,
        skillset: Skillset,
        skill: str,
        *,
        source: str,
        new_record_id: Callable[[], str],
        incarnation: str = "",
    ) -> None:
        self._skillset = skillset
        self.skill = skillset.skill(skill)
        self._source = source
        self._incarnation = incarnation
        self._outbox: Outbox[Action] = Outbox(source, new_record_id)
        self._run: GoalRun | None = None
        # Goals that this process did not run, until the resource manager has taken down how it ends them.
        self._in_doubt: dict[str, GoalRun] = {}
        self._ended: BoundedDict[str, GoalStatus] = BoundedDict(GOALS_REMEMBERED)
        # Ids of goals whose interrupt came before their start.
        self._interrupted_early: BoundedDict[str, None] = BoundedDict(GOALS_REMEMBERED)
        self.dropped_calls = 0
        """Terminations and confirmations for goals that were over, or not to be ended."""

    # --- questions ---------------------------------------------------------------------------------------------------

    @property
    def current(self) -> GoalRun | None:
        """The goal that has not ended yet."""
        return self._run

    def status(self, goal_id: str | None) -> GoalStatus:
        """Of one goal; for None of the current one, else of the latest."""
        if goal_id is None:
            status = self._run.status if self._run else self._ended.newest()
        else:
            run = self._run_of(goal_id) or self._in_doubt.get(goal_id)
            status = run.status if run else self._ended.get(goal_id)
        if status is None:
            which = "no goal yet" if goal_id is None else f"no goal {goal_id}"
            raise RefusedError(ErrorCode.UNKNOWN_GOAL, f"`{self.skill.name}` knows of {which}.", help="Start one.")
        return status

    def next_tick(self) -> float | None:
        """When `tick` is due if nothing happens before; None for never."""
        run = self._run
        if run is None or not run.stoppable:
            return None
        return run.stop_deadline if run.state is State.INTERRUPTING else run.run_deadline

    # --- requests of clients -----------------------------------------------------------------------------------------

    def start(self, request: StartGoal, now: float) -> tuple[Action, ...]:
        """Take a goal, or end it at once; either way `status` then tells about it. A known id changes nothing."""
        check_goal_id(request.goal_id)
        if self._knows(request.goal_id):
            return ()
        check_schema(self._skillset, request.schema)
        if request.deadline is not None and now > request.deadline:
            raise RefusedError(
                ErrorCode.TOO_LATE,
                f"The start of `{self.skill.name}` came {now - request.deadline:.1f} s after its deadline.",
                help="Start anew with another goal id if it is still wanted.",
            )
        if len(self._in_doubt) >= DOUBTS_AT_ONCE:
            text = f"`{self.skill.name}` still waits to hear of {DOUBTS_AT_ONCE} goals what became of them."
            raise RefusedError(ErrorCode.UNAVAILABLE, text, help="Ask again.")
        run = GoalRun(request.goal_id, {}, request.client, now, owner=request.owner, record=request.cause)
        if run.goal_id in self._interrupted_early:
            self._interrupted_early.pop(run.goal_id)
            self._conclude(run, Terminal(ending=End.INTERRUPTED, reason="It was interrupted before it started."), now)
        elif self._run is not None:
            other = self._run.goal_id
            reason = f"`{self.skill.name}` is busy with goal {other}."
            self._conclude(run, Terminal(ending=End.BUSY, reason=reason, running_goal=other), now)
        else:
            self._validate(run, request.inputs, now)
        return self._actions()

    def interrupt(self, request: InterruptGoal, now: float) -> tuple[Action, ...]:
        """Ask for the end of a goal, in whatever state it is; `status` then tells about it.

        Refuses an unknown id with UNKNOWN_GOAL, and remembers it: should the start still come, that goal is over.
        """
        check_goal_id(request.goal_id)
        run = self._run_of(request.goal_id)
        if run is not None:
            self._stop(run, f"{request.client} interrupted it.", request.cause, now)
        elif not self._knows(request.goal_id):
            self._interrupted_early[request.goal_id] = None
            raise RefusedError(
                ErrorCode.UNKNOWN_GOAL,
                f"`{self.skill.name}` knows of no goal {request.goal_id}.",
                help="Should its start still arrive, it will end interrupted.",
            )
        return self._actions()

    def owner_gone(self, owner: str, now: float) -> tuple[Action, ...]:
        """The client that owns the current goal is gone: interrupt it, unless the skill is to continue."""
        run = self._run
        if run is not None and run.owner == owner and self.skill.owner_lost == "interrupt":
            self._stop(run, f"Its owner {owner.removeprefix(CLIENT)} is gone.", None, now)
        return self._actions()

    # --- what came of the hooks --------------------------------------------------------------------------------------

    def validated(self, goal_id: str, problem: str | None, now: float) -> tuple[Action, ...]:
        """The developer's `validate` accepted the goal (None), or said what is wrong with it."""
        run = self._run_of(goal_id)
        if run is not None and run.begin is None:
            if problem is not None:
                self._conclude(run, Terminal(ending=End.NOT_VALIDATED, reason=sendable_text(problem)), now)
            elif run.state is State.INTERRUPTING:
                self._conclude(run, Terminal(ending=End.INTERRUPTED, reason=run.stop_reason), now)
            else:
                run.begin = BeginGoal(
                    goal_id=goal_id,
                    skill=self.skill.name,
                    inputs=dict(run.inputs),
                    manager=self._source,
                    owner=run.client,
                    schema=self._skillset.schema_hash,
                    cause=run.record,
                    incarnation=self._incarnation,
                )
                self._outbox.add(AskResources(run.begin))
        return self._actions()

    def dispatched(self, goal_id: str, now: float) -> tuple[Action, ...]:
        """The developer's `on_dispatch` has returned."""
        run = self._run_of(goal_id)
        if run is not None and run.state is State.DISPATCHING:
            self._enter(run, State.RUNNING, now)
        return self._actions()

    def raised(self, goal_id: str, hook: str, text: str, now: float) -> tuple[Action, ...]:
        """A hook of the developer raised."""
        run = self._run_of(goal_id)
        reason = f"`{hook}` of the skill manager raised {text}"
        if run is not None and run.begin is None:
            self._conclude(run, Terminal(ending=End.ERROR, reason=sendable_text(reason)), now)
        elif run is not None and run.stoppable:
            self._end(run, EndKind.ERROR, reason)
        return self._actions()

    def terminated(
        self, goal_id: str, result: str, output: Mapping[str, object] | None, now: float, cause: str | None = None
    ) -> tuple[Action, ...]:
        """The skill ended by itself. Calls for a goal that is over are dropped and counted, like those below.

        cause: the timeline record of what ended it, where there is one besides its start.
        """
        del now
        run = self._run_to_end(goal_id)
        if run is not None:
            _note_cause(run, cause)
            try:
                self.skill.result(result)
            except UnknownNameError as error:
                self._end(run, EndKind.ERROR, str(error))
                return self._actions()
            given = {name: value for name, value in (output or {}).items() if value is not None}
            fitted, problems = fit_fields(self.skill.outputs, given)
            wrong = [problem.sentence for problem in problems if problem.kind in ("type", "unknown")]
            if wrong:
                self._end(run, EndKind.ERROR, f"The output of {result} does not fit the skillset: {' '.join(wrong)}")
            elif (obstacle := _obstacle_to_sending(fitted)) is not None:
                self._end(run, EndKind.ERROR, f"The output of {result} cannot be sent: {obstacle}.")
            else:
                told = fitted if output is not None else None
                self._end(run, EndKind.RESULT, f"The skill ended with {result}.", result=result, output=told)
        return self._actions()

    def interrupted(self, goal_id: str, now: float) -> tuple[Action, ...]:
        """The developer confirms that an interrupted goal has really stopped."""
        del now
        run = self._run_to_end(goal_id, only=State.INTERRUPTING)
        if run is not None:
            self._end(run, EndKind.INTERRUPT, run.stop_reason)
        return self._actions()

    def failed(self, goal_id: str, reason: str, now: float, cause: str | None = None) -> tuple[Action, ...]:
        """The developer gives the goal up. cause: as with `terminated`."""
        del now
        run = self._run_to_end(goal_id)
        if run is not None:
            _note_cause(run, cause)
            self._end(run, EndKind.ERROR, reason)
        return self._actions()

    # --- from the resource manager -----------------------------------------------------------------------------------

    def answered(self, asked: AskResources, answer: GoalVerdict | ErrorReply | None, now: float) -> tuple[Action, ...]:
        """The answer to a question; None for silence, after which the same question is asked again.

        Two refusals are as good as silence: UNAVAILABLE says that nothing can be judged now, and INTERNAL does not say
        whether it was.
        """
        if isinstance(answer, ErrorReply) and answer.code in AS_GOOD_AS_SILENCE:
            answer = None
        if isinstance(asked.call, RecordOutcome):
            self._doubt_answered(asked, answer, now)
            return self._actions()
        run = self._run_of(asked.call.goal_id)
        waiting = run is not None and asked.call in (run.begin, run.ending and run.ending.call)
        if run is None or not waiting:
            self._settle(asked, answer)
        elif answer is None:
            self._bear_silence(run, asked, now)
        elif isinstance(asked.call, BeginGoal):
            self._begin_answered(run, answer, now)
        else:
            self._end_answered(run, answer, now)
        return self._actions()

    def renewal(self) -> RenewGoal | None:
        """What keeps the current goal's grant, to be sent every `RENEWAL_PERIOD`; None where nothing is held."""
        run = self._run
        if run is None or run.token == NO_TOKEN:
            return None
        return RenewGoal(goal_id=run.goal_id, skill=self.skill.name, token=run.token)

    def renewed(self, call: RenewGoal, answer: GoalVerdict | ErrorReply | None, now: float) -> tuple[Action, ...]:
        """The answer to a renewal; None for silence, which proves nothing of the goal until there is much of it."""
        run = self._run_of(call.goal_id)
        if run is None:
            return ()
        match answer:
            case Ended() | Violated() | Lost():
                self._end_answered(run, answer, now)
            case ErrorReply(code=ErrorCode.STALE_TOKEN | ErrorCode.UNKNOWN_GOAL):
                self._taken_away(run, answer, now)
            case None | ErrorReply():
                run.renewals_unanswered += 1
                if run.renewals_unanswered >= RENEWALS_UNTIL_UNWATCHED:
                    self._stop(run, "The resource manager is silent, and nobody watches the invariants.", None, now)
            case _:
                run.renewals_unanswered = 0
        return self._actions()

    def pushed(self, verdict: Violated | Lost, now: float) -> tuple[Action, ...]:
        """The resource manager ended a goal. Nothing is left to be given back."""
        run = self._run_of(verdict.goal_id)
        if run is not None:
            self._taken_away(run, verdict, now)
        return self._actions()

    # --- time --------------------------------------------------------------------------------------------------------

    def tick(self, now: float) -> tuple[Action, ...]:
        """Let time pass: an interrupt that nobody confirms is forced, a skill past its deadline is interrupted."""
        run, due = self._run, self.next_tick()
        if run is not None and due is not None and now >= due:
            if run.state is State.INTERRUPTING:
                limit = f"{self.skill.interrupt.timeout:g} s"
                reason = f"{run.stop_reason} The skill did not confirm within {limit} that it has stopped."
                self._end(run, EndKind.INTERRUPT, reason, forced=True)
            else:
                self._stop(run, f"Its deadline of {self.skill.deadline:g} s passed.", None, now)
        return self._actions()

    # --- transitions -------------------------------------------------------------------------------------------------

    def _validate(self, run: GoalRun, given: Mapping[str, object], now: float) -> None:
        """Judge the inputs by the model, and have the developer judge those that fit."""
        run.inputs, problems = fit_fields(self.skill.inputs, given)
        reasons = by_path(problems)
        reason = " ".join(reasons.values())
        # Fitted they may be longer than the start was: a whole number of one byte has become a float of nine.
        if not problems and (obstacle := _obstacle_to_sending(run.inputs)) is not None:
            reason = f"The inputs of `{self.skill.name}` cannot be sent to the resource manager: {obstacle}."
        if reason:
            terminal = Terminal(ending=End.NOT_VALIDATED, reason=sendable_text(reason), failing=tuple(reasons))
            self._conclude(run, terminal, now)
            return
        self._run = run
        self._enter(run, State.VALIDATING, now, f"asked by {run.client}")
        self._call(Hook.VALIDATE, run)

    def _conclude(self, run: GoalRun, terminal: Terminal, now: float) -> None:
        """End a goal that was never granted here, as soon as it is certain that it was granted nowhere else.

        A predecessor may have run it; so may a successor, while this process was stopped without knowing it.
        """
        if self._run is run:
            self._run = None
        else:
            self._enter(run, State.VALIDATING, now, f"asked by {run.client}")
        self._in_doubt[run.goal_id] = run
        call = RecordOutcome(
            goal_id=run.goal_id,
            skill=self.skill.name,
            terminal=terminal,
            manager=self._source,
            incarnation=self._incarnation,
            cause=run.record,
        )
        self._outbox.add(AskResources(call))

    def _doubt_answered(self, asked: AskResources, answer: GoalVerdict | ErrorReply | None, now: float) -> None:
        run = self._in_doubt.get(asked.call.goal_id)
        if run is None:
            return
        if answer is None:
            self._bear_doubt(run, asked, now)
            return
        del self._in_doubt[run.goal_id]
        match answer:
            case _ if run.state is State.TERMINATED:
                pass
            case NotReady() | Ended():
                self._begin_answered(run, answer, now)
            case _:
                self._taken_away(run, answer, now)

    def _bear_doubt(self, run: GoalRun, asked: AskResources, now: float) -> None:
        """The client gets an answer after a while, and the resource manager hears of it as soon as it listens."""
        call, silences = asked.call, asked.silences + 1
        if silences == SILENCES_UNTIL_ERROR and isinstance(call, RecordOutcome):
            reason = f"The resource manager does not answer. {call.terminal.reason}"
            terminal = Terminal(ending=End.ERROR, reason=reason)
            call = replace(call, terminal=terminal)
            self._finish(run, terminal, now)
        if silences < SILENCES_UNTIL_SETTLED:
            self._outbox.add(AskResources(call, silences))
        else:
            del self._in_doubt[run.goal_id]

    def _begin_answered(self, run: GoalRun, answer: GoalVerdict | ErrorReply, now: float) -> None:
        match answer:
            case Granted() if run.state is State.INTERRUPTING:
                run.token = answer.token
                self._end(run, EndKind.INTERRUPT, run.stop_reason)
            case Granted():
                run.token, run.record, run.dispatched = answer.token, answer.record, True
                if self.skill.deadline is not None:
                    run.run_deadline = now + self.skill.deadline
                self._enter(run, State.DISPATCHING, now)
                self._call(Hook.DISPATCH, run)
            case NotReady():
                run.record = answer.record
                reason = " ".join(answer.failing.values())
                terminal = Terminal(ending=End.NOT_READY, reason=reason, failing=tuple(answer.failing))
                self._finish(run, terminal, now)
            case Ended(terminal=Terminal() as own_word):
                # Ours, or that of an earlier process of this manager.
                run.record = answer.record
                self._finish(run, own_word, now)
            case Ended():
                run.record = answer.record
                reason = f"An earlier process of this manager ended it. {answer.reason}".rstrip()
                self._finish(run, self._terminal_of_end(answer, answer.how, answer.result, reason), now)
            case _:
                self._taken_away(run, answer, now)

    def _end_answered(self, run: GoalRun, answer: GoalVerdict | ErrorReply, now: float) -> None:
        ending = run.ending
        if ending is None or not isinstance(answer, Ended):
            self._taken_away(run, answer, now)
            return
        run.record = answer.record
        reason = ending.reason if answer.held else f"{ending.reason} {answer.reason}"
        terminal = self._terminal_of_end(answer, ending.call.how, ending.call.result, reason)
        self._finish(run, replace(terminal, output=ending.output, forced=ending.forced), now)

    def _terminal_of_end(self, ended: Ended, how: EndKind | None, result: str | None, reason: str) -> Terminal:
        if result is not None:
            return Terminal(
                ending=End.SUCCEEDED if ended.held else End.NOT_HELD,
                reason=reason,
                result=result,
                success=ended.held and self.skill.result(result).success,
            )
        return Terminal(ending=End.INTERRUPTED if how is EndKind.INTERRUPT else End.ERROR, reason=reason)

    def _taken_away(self, run: GoalRun, verdict: GoalVerdict | ErrorReply, now: float) -> None:
        """The goal is over in the resource manager's judgement, or was never in its books."""
        match verdict:
            case Violated() | Lost():
                run.record = verdict.record
                terminal = terminal_of(verdict)
            case ErrorReply(code=ErrorCode.STALE_TOKEN | ErrorCode.UNKNOWN_GOAL):
                terminal = Terminal(ending=End.LOST, reason=verdict.message, detected_by=RESOURCE_MANAGER)
            case ErrorReply():
                reason = f"The resource manager refused: {verdict.message} {verdict.help}".strip()
                terminal = Terminal(ending=End.ERROR, reason=reason)
            case _:
                reason = f"The resource manager gave an answer that does not belong here: {verdict}"
                terminal = Terminal(ending=End.ERROR, reason=reason)
        self._finish(run, terminal, now)

    def _stop(self, run: GoalRun, reason: str, cause: str | None, now: float) -> None:
        """First phase of an interrupt: ask the skill to stop. It keeps its resources until it has."""
        if run.state is State.INTERRUPTING or run.ending is not None:
            return
        run.stop_reason = reason
        run.stop_deadline = now + self.skill.interrupt.timeout
        run.record = cause or run.record
        self._enter(run, State.INTERRUPTING, now, reason)
        if run.dispatched:
            self._call(Hook.INTERRUPT, run)

    def _end(
        self,
        run: GoalRun,
        how: EndKind,
        reason: str,
        *,
        result: str | None = None,
        output: dict[str, object] | None = None,
        forced: bool = False,
    ) -> None:
        """Ask for the effect of an end; the answer decides how the goal has ended."""
        call = EndGoal(
            goal_id=run.goal_id,
            skill=self.skill.name,
            token=run.token,
            how=how,
            result=result,
            cause=run.record,
            incarnation=self._incarnation,
        )
        run.ending = Ending(call, sendable_text(reason), output, forced)
        self._outbox.add(AskResources(call))

    def _bear_silence(self, run: GoalRun, asked: AskResources, now: float) -> None:
        silences = asked.silences + 1
        if silences < SILENCES_UNTIL_ERROR:
            self._outbox.add(AskResources(asked.call, silences))
            return
        # The client gets its answer now; what the goal may hold is given back as soon as anybody listens.
        how = f" {run.ending.reason}" if run.ending else ""
        reason = f"The resource manager does not answer.{how}"
        self._finish(run, Terminal(ending=End.ERROR, reason=reason), now)
        call = asked.call
        if isinstance(call, BeginGoal):
            call = EndGoal(
                goal_id=run.goal_id,
                skill=self.skill.name,
                token=NO_TOKEN,
                how=EndKind.ERROR,
                cause=run.record,
                incarnation=self._incarnation,
            )
        self._outbox.add(AskResources(call, silences))

    def _settle(self, asked: AskResources, answer: GoalVerdict | ErrorReply | None) -> None:
        """The goal has its terminal answer: go on until the resource manager has heard that it is over."""
        if answer is None and isinstance(asked.call, EndGoal) and asked.silences < SILENCES_UNTIL_SETTLED:
            self._outbox.add(AskResources(asked.call, asked.silences + 1))

    # --- parts of a step ---------------------------------------------------------------------------------------------

    def _run_of(self, goal_id: str) -> GoalRun | None:
        return self._run if self._run is not None and self._run.goal_id == goal_id else None

    def _knows(self, goal_id: str) -> bool:
        return self._run_of(goal_id) is not None or goal_id in self._in_doubt or goal_id in self._ended

    def _run_to_end(self, goal_id: str, only: State | None = None) -> GoalRun | None:
        """The goal, if it may be ended now; otherwise the call is counted as dropped."""
        run = self._run_of(goal_id)
        if run is None or not run.stoppable or (only is not None and run.state is not only):
            self.dropped_calls += 1
            return None
        return run

    def _enter(self, run: GoalRun, state: State, now: float, text: str = "", terminal: Terminal | None = None) -> None:
        before = run.state or "IDLE"
        after = terminal.label if terminal else state
        run.state = state
        run.record = self._outbox.record(
            now, RecordKind.GOAL, self.skill.name, before, after, text, cause=run.record, goal_id=run.goal_id
        )
        run.status = GoalStatus(
            goal_id=run.goal_id, skill=self.skill.name, state=state, t=now, terminal=terminal, record=run.record
        )
        self._outbox.add(run.status)

    def _finish(self, run: GoalRun, terminal: Terminal, now: float) -> None:
        if self._run is run:
            self._run = None
        self._enter(run, State.TERMINATED, now, terminal.reason, terminal)
        if run.status is not None:
            self._ended[run.goal_id] = run.status
        if run.dispatched:
            self._call(Hook.ENDED, run, terminal)

    def _call(self, hook: Hook, run: GoalRun, terminal: Terminal | None = None) -> None:
        self._outbox.add(CallHook(hook, run.goal_id, run.inputs, run.token, run.started_at, terminal))

    def _actions(self) -> tuple[Action, ...]:
        return self._outbox.drain()


def _note_cause(run: GoalRun, cause: str | None) -> None:
    """What comes next of the goal is put down to this record, where the developer names one."""
    if cause is not None:
        run.record = sendable_text(cause)[:LONGEST_LABEL]


def _obstacle_to_sending(values: Mapping[str, object]) -> str | None:
    """Why values of the right types cannot be sent all the same: too many bytes, or a text that has no encoding."""
    try:
        require_sendable(values)
    except ProtocolError as error:
        return str(error)
    return None
