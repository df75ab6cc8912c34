"""Following a goal from start to end over a network that may stay silent, so that every goal gets its answer."""

from __future__ import annotations

from collections.abc import Callable

from skillwing.services.bus import Answered, Bus, Refused
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
"""Silences after which a manager without an alive token is given up: 1.55 s, so that a short flap does no harm, and
the resource manager, which waits a second, has freed its resources by then."""
SILENCES_OF_THE_LIVING = 10
"""The same for one that seems to live: it may be busy for a while. 5.6 s if each silence comes at once, 26 s if each
question runs into its timeout of 2 s."""
VERDICT_PATIENCE = 1.0
"""Wall time in seconds that a manager has to pass on the resource manager's verdict; one that hangs never will."""


class GoalTracker:
    """One goal's correspondence with its manager.

    Ends the handle as LOST when the manager is gone, and as ERROR when it refuses the request for good.
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
        on_change: Callable[[GoalHandle], None],
    ) -> None:
        self._bus = bus
        self._keys = keys
        self._timeline = timeline
        self.handle = handle
        self._client = client
        self._manager_alive = manager_alive
        self._on_change = on_change
        self._interrupting = False
        self._interrupt_cause: str | None = None
        self._interrupt_heard = False
        self._probing = False
        self._has_to_exist = False

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
        """Ask the manager to end the goal. It may not have heard of the start yet: it then remembers."""
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
            on_silence=self._lose_to_silence,
        )

    def follow(self) -> None:
        """Ask for a goal that somebody else has started."""
        self._has_to_exist = True
        self.probe()

    def probe(self) -> None:
        """Ask how the goal is doing, in case news of it was lost or its manager is."""
        if self._probing or self.handle.done:
            return
        self._probing = True
        seen = self._seen
        self._ask_status(lambda answer: self._probe_answered(answer, seen=seen))

    def judged(self, verdict: Violated | Lost) -> None:
        """The resource manager has ended the goal. Its manager is about to say so, if it still can."""
        self._bus.after(VERDICT_PATIENCE, lambda: self._end(terminal_of(verdict), cause=verdict.record), wall=True)

    def advance(self, status: GoalStatus) -> None:
        """Take a status of this goal, published or answered."""
        consistent = (status.terminal is not None) == (status.state is State.TERMINATED)
        if status.goal_id != self.handle.goal_id or not consistent:
            return
        if self._interrupt_heard and status.state not in (State.INTERRUPTING, State.TERMINATED):
            # Whoever heard the interrupt has been replaced since then, and the start has arrived once more.
            self._interrupting = self._interrupt_heard = False
            self.interrupt(self._interrupt_cause)
        if self.handle.advance(status):
            self._on_change(self.handle)

    @property
    def _seen(self) -> bool:
        """Whether a manager is known to have taken the goal."""
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
            # It may have taken the goal before it failed, or another process of its name has.
            self._ask_status(lambda told: self._answered(told) if isinstance(told, Answered) else self._end(refusal))
        else:
            self._end(refusal)

    def _interrupt_answered(self, answer: Answered | Refused, cause: str | None, *, seen: bool) -> None:
        if isinstance(answer, Refused) and answer.error.code is not ErrorCode.UNKNOWN_GOAL:
            # It was not carried out, and somebody wants the goal to end.
            self._interrupting = False
            self._bus.after(LONGEST_DELAY, lambda: self.interrupt(cause), wall=True)
        else:
            self._answered(answer, seen=seen)
            self._interrupt_heard = True

    def _probe_answered(self, answer: Answered | Refused, *, seen: bool) -> None:
        self._probing = False
        self._answered(answer, seen=seen)

    def _answered(self, answer: Answered | Refused, *, seen: bool = True) -> None:
        """Take an answer to a question that was asked when the goal had been `seen`, or had not."""
        if isinstance(answer, Answered):
            try:
                self.advance(decode(answer.payload, GoalStatus))
            except ProtocolError as error:
                self._end(Terminal(ending=Ending.ERROR, reason=f"The manager's answer is unreadable: {error}."))
        elif answer.error.code is ErrorCode.UNKNOWN_GOAL and self._seen and not seen:
            # The question may have overtaken the start, which has arrived since then.
            self.probe()
        elif answer.error.code is ErrorCode.UNKNOWN_GOAL and self._seen:
            # It knew the goal once. As long as it never answered, the start may simply not have arrived yet.
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
        self._end(Terminal(ending=Ending.LOST, reason=reason, detected_by="client"))

    def _end(self, terminal: Terminal, cause: str | None = None) -> None:
        handle = self.handle
        if handle.done:
            return
        record = self._timeline.record(
            RecordKind.GOAL,
            handle.skill,
            handle.state or "SENT",
            terminal.label,
            text=terminal.reason,
            cause=cause or handle.record,
            goal_id=handle.goal_id,
        )
        handle.end(terminal, record)
        self._on_change(handle)
