"""`GoalTracker`: each goal of a client gets its terminal answer, also on a network that may stay silent."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from skillwing.services.bus import Answer, Answered, Bus, NoReply, Refused
from skillwing.services.client.goal_handle import GoalHandle
from skillwing.services.client.retry import LONGEST_DELAY, ask_until_answered
from skillwing.services.core.verdicts import terminal_of
from skillwing.services.protocol import (
    Ending,
    ErrorCode,
    GoalStatus,
    InterruptGoal,
    Keys,
    Lost,
    ModifyGoal,
    ProtocolError,
    QueryGoal,
    RecordKind,
    StartGoal,
    State,
    Terminal,
    Violated,
    decode,
    encode,
)
from skillwing.services.timeline import Timeline

SILENCES_OF_THE_ABSENT = 6
"""Silences after which a manager without an alive token counts as gone, 1.55 s. A short outage does no harm, and the
resource manager, which waits 1 s, has released the goal's resources by then."""
SILENCES_OF_THE_LIVING = 10
"""The same for a manager with an alive token, which may be busy. 5.6 s if each silence comes at once, 26 s if each
question takes its timeout of 2 s."""
VERDICT_PATIENCE = 1.0
"""Wall time in seconds for a manager to pass on the resource manager's verdict. One that hangs never does."""


class GoalTracker:
    """The requests and answers about one goal.

    The handle ends LOST if the manager is gone, and ERROR if it finally refuses the request.
    """

    def __init__(
        self,
        bus: Bus,
        keys: Keys,
        timeline: Timeline,
        handle: GoalHandle,
        *,
        client: str,
        manager_alive: Callable[[], bool],
        take_reply: Callable[[GoalStatus], None],
        after_step: Callable[[int, Callable[[str], None]], None],
        after_release: Callable[[str, str, Callable[[str], None]], None],
        on_change: Callable[[GoalHandle], None],
    ) -> None:
        self._bus = bus
        self._keys = keys
        self._timeline = timeline
        self.handle = handle
        self._client = client
        self._manager_alive = manager_alive
        self._take_reply = take_reply
        self._after_step, self._after_release = after_step, after_release
        self._on_change = on_change
        self._interrupting = False
        self._interrupt_cause: str | None = None
        self._interrupt_heard = False
        self._probing = False
        self._has_to_exist = False
        self._verdict: str | None = None
        self._lost = False
        """The goal ends LOST, as soon as the states from after its release are known."""
        self._modifications: deque[tuple[ModifyGoal, Callable[[Answer], None]]] = deque()

    def start(self, request: StartGoal) -> None:
        ask_until_answered(
            self._bus,
            self._keys.start(self.handle.skill),
            encode(request),
            self._start_answered,
            keep_retrying=self._keep_retrying,
            on_silence=self._lose_to_silence,
        )

    def interrupt(self, cause: str | None = None) -> None:
        """Ask the manager to end the goal. If the start has not arrived yet, the manager remembers the interrupt."""
        if self._interrupting or self.handle.done:
            return
        self._interrupting, self._interrupt_cause = True, cause
        request = InterruptGoal(goal_id=self.handle.goal_id, client=self._client, cause=cause)
        seen = self._seen
        ask_until_answered(
            self._bus,
            self._keys.interrupt(self.handle.skill),
            encode(request),
            lambda answer: self._interrupt_answered(answer, cause, seen=seen),
            keep_retrying=self._keep_retrying,
            on_silence=self._interrupt_unanswered,
        )

    def modify(self, request: ModifyGoal, on_answer: Callable[[Answer], None]) -> None:
        """Ask for new inputs, after the earlier requests: a repetition must not overtake them.

        on_answer: called once, with `NoReply` if the manager stays silent or the goal ends first. The same holds if the
        manager was replaced: the process before it may have taken the inputs.
        """
        self._modifications.append((request, on_answer))
        if len(self._modifications) == 1:
            self._ask_modification()

    def _ask_modification(self) -> None:
        request, on_answer = self._modifications[0]

        def receive(answer: Answer) -> None:
            if isinstance(answer, Answered):
                self._answered(answer)
            elif isinstance(answer, Refused) and answer.error.code is ErrorCode.UNKNOWN_GOAL and self._seen:
                answer = NoReply(timed_out=False)
            self._modifications.popleft()
            if self._modifications:
                self._ask_modification()
            on_answer(answer)

        ask_until_answered(
            self._bus,
            self._keys.modify(self.handle.skill),
            encode(request),
            receive,
            keep_retrying=self._keep_retrying,
            on_silence=lambda: receive(NoReply(timed_out=False)),
        )

    def follow(self) -> None:
        """Ask for a goal that another client has started."""
        self._has_to_exist = True
        self.probe()

    def probe(self) -> None:
        """Ask for the goal's status: a publication may be lost, or its manager."""
        if self._probing or self.handle.done:
            return
        self._probing = True
        seen = self._seen
        self._ask_status(lambda answer: self._probe_answered(answer, seen=seen))

    def on_verdict(self, verdict: Violated | Lost) -> None:
        """Take the resource manager's verdict, if the goal's manager does not pass it on in time, or is gone."""
        self._verdict = verdict.record
        patience = 0.0 if self._lost else VERDICT_PATIENCE

        def end(remark: str) -> None:
            del remark  # a verdict says that the resources are free
            self._end(terminal_of(verdict), cause=verdict.record)

        self._bus.after(patience, lambda: self._after_step(verdict.step, end), wall=True)

    def advance(self, status: GoalStatus) -> None:
        """Take a status of this goal, published or answered."""
        consistent = (status.terminal is not None) == (status.state is State.TERMINATED)
        if status.goal_id != self.handle.goal_id or not consistent:
            return
        if self._interrupt_heard and status.state not in (State.INTERRUPTING, State.TERMINATED):
            # The process that took the interrupt was replaced since then, and the start arrived again.
            self._interrupting = self._interrupt_heard = False
            self.interrupt(self._interrupt_cause)
        elif self._lost and status.state not in (State.INTERRUPTING, State.TERMINATED):
            # Its manager has come back before the loss was shown. The mission will go on without it.
            self.interrupt(self._interrupt_cause)
        if self.handle.advance(status):
            self._on_change(self.handle)

    @property
    def _seen(self) -> bool:
        """A manager has taken the goal, as far as is known."""
        return self.handle.state is not None

    def _ask_status(self, on_answer: Callable[[Answered | Refused], None]) -> None:
        ask_until_answered(
            self._bus,
            self._keys.goal(self.handle.skill),
            encode(QueryGoal(goal_id=self.handle.goal_id)),
            on_answer,
            keep_retrying=self._keep_retrying,
            on_silence=self._lose_to_silence,
        )

    def _keep_retrying(self, silences: int) -> bool:
        limit = SILENCES_OF_THE_LIVING if self._manager_alive() else SILENCES_OF_THE_ABSENT
        return not self.handle.done and silences < limit

    def _start_answered(self, answer: Answered | Refused) -> None:
        if isinstance(answer, Answered):
            self._answered(answer)
            return
        text = f"The manager refused to start: {answer.error.message} {answer.error.help}".strip()
        refusal = Terminal(ending=Ending.ERROR, reason=text, detected_by="client")
        if answer.error.code is ErrorCode.INTERNAL or self._seen:
            # The manager may have taken the goal before it failed, or another process of its name did.
            self._ask_status(
                lambda status: self._answered(status) if isinstance(status, Answered) else self._end(refusal)
            )
        else:
            self._end(refusal)

    def _interrupt_answered(self, answer: Answered | Refused, cause: str | None, *, seen: bool) -> None:
        if isinstance(answer, Refused) and answer.error.code is not ErrorCode.UNKNOWN_GOAL:
            # The interrupt was not carried out, and is still wanted.
            self._interrupting = False
            self._bus.after(LONGEST_DELAY, lambda: self.interrupt(cause), wall=True)
        else:
            self._answered(answer, seen=seen)
            self._interrupt_heard = True

    def _interrupt_unanswered(self) -> None:
        self._interrupting = False
        self._lose_to_silence()

    def _probe_answered(self, answer: Answered | Refused, *, seen: bool) -> None:
        self._probing = False
        self._answered(answer, seen=seen)

    def _answered(self, answer: Answered | Refused, *, seen: bool = True) -> None:
        """Take an answer. seen: the goal was known to have arrived when the question was asked."""
        if isinstance(answer, Answered):
            try:
                self._take_reply(decode(answer.payload, GoalStatus))
            except ProtocolError as error:
                self._end(Terminal(ending=Ending.ERROR, reason=f"The manager's answer is unreadable: {error}."))
        elif answer.error.code is ErrorCode.UNKNOWN_GOAL and self._seen and not seen:
            # The question may have overtaken the start, which has arrived since then.
            self.probe()
        elif answer.error.code is ErrorCode.UNKNOWN_GOAL and self._seen:
            # A manager that never answered may not have the start yet; this one had the goal.
            self._lose(f"The manager of `{self.handle.skill}` was replaced and no longer knows the goal.")
        elif answer.error.code is ErrorCode.UNKNOWN_GOAL and self._has_to_exist:
            self._end(Terminal(ending=Ending.ERROR, reason=answer.error.message, detected_by="client"))

    def _lose_to_silence(self) -> None:
        self._probing = False
        if self._manager_alive():
            self._lose(f"The manager of `{self.handle.skill}` is connected and does not answer.")
        else:
            self._lose(f"The manager of `{self.handle.skill}` is gone: it answers nothing and its alive token is away.")

    def _lose(self, reason: str) -> None:
        """End the goal, after its resources were released as far as that is known in time."""
        if self._lost or self.handle.done:
            return

        def end(remark: str) -> None:
            self._end(Terminal(ending=Ending.LOST, reason=f"{reason} {remark}".rstrip(), detected_by="client"))

        self._lost = True
        self._after_release(self.handle.skill, self.handle.goal_id, end)

    def _end(self, terminal: Terminal, cause: str | None = None) -> None:
        """End the goal. cause: record behind it, by default that of the resource manager's verdict, if one has come."""
        handle = self.handle
        if handle.done:
            return
        record = self._timeline.record(
            RecordKind.GOAL,
            handle.skill,
            handle.state or "SENT",
            terminal.label,
            text=terminal.reason,
            cause=cause or self._verdict,
            goal_id=handle.goal_id,
        )
        handle.end(terminal, record)
        self._on_change(handle)
