"""Delivery of questions to the resource manager. The rules are the same for every question:

silence never means "not done", so the question is repeated; after ten silences the client gets its answer without one;
then the manager goes on, until the resource manager has released what the goal may hold and committed its outcome.
"""

from __future__ import annotations

from msgspec.structs import replace

from skillwing.services.core.goal_states import GoalRun
from skillwing.services.core.outbox import Outbox
from skillwing.services.core.skill_actions import Action, AskBegin, AskCommit, AskEnd, AskResources, Question
from skillwing.services.core.skill_events import Reply, ResourcesAnswer, RetriesExhausted
from skillwing.services.protocol import NO_TOKEN, BeginGoal, EndGoal, EndKind, ErrorCode, ErrorReply, RecordOutcome

SILENCES_UNTIL_ERROR = 10
"""Silences after which a goal gets its terminal answer without the resource manager. That takes 5.6 s if no process
is there, and 26 s if one hangs: each question then takes its timeout of 2 s."""
SILENCES_UNTIL_SETTLED = 600
"""Silences after which the manager stops repeating the question."""
LIKE_SILENCE = (ErrorCode.UNAVAILABLE, ErrorCode.INTERNAL)
"""UNAVAILABLE: no decision is possible now. INTERNAL: it is unknown whether one was made."""


class Delivery:
    """Questions of one skill's manager. manager, incarnation: as in `BeginGoal`; outbox: where questions go."""

    def __init__(self, skill: str, schema: str, manager: str, incarnation: str, outbox: Outbox[Action]) -> None:
        self._skill = skill
        self._schema = schema
        self._manager = manager
        self._incarnation = incarnation
        self._outbox = outbox
        self.pending_outcomes: dict[str, GoalRun] = {}
        """Goals whose local outcome is not committed yet, as far as this process has heard."""

    def ask(self, question: Question, run: GoalRun) -> None:
        """Put a question for the first time."""
        match question:
            case AskBegin():
                call = self._begin(run)
            case AskEnd(token=token, how=how, result=result):
                call = self._end(run, token, how, result)
            case AskCommit():
                self.pending_outcomes[run.goal_id] = run
                call = RecordOutcome(
                    goal_id=run.goal_id,
                    skill=self._skill,
                    terminal=question.terminal,
                    manager=self._manager,
                    incarnation=self._incarnation,
                    cause=run.record,
                )
        self._outbox.add(AskResources(call))

    def receive(
        self, asked: AskResources, answer: ResourcesAnswer, run: GoalRun | None
    ) -> Reply | RetriesExhausted | None:
        """The event that an answer, or silence, is for the goal; None if the goal does not wait for it."""
        goal_id = asked.call.goal_id
        if isinstance(asked.call, RecordOutcome) and goal_id not in self.pending_outcomes:
            return None
        waits = run is not None and run.state.awaits(asked.call)
        if answer is None or (isinstance(answer, ErrorReply) and answer.code in LIKE_SILENCE):
            return self.retry_or_fail(asked, waits=waits)
        if isinstance(asked.call, RecordOutcome):
            del self.pending_outcomes[goal_id]
        return Reply(answer) if waits else None

    def retry_or_fail(self, asked: AskResources, *, waits: bool) -> RetriesExhausted | None:
        """Repeat the question after a silence, or stop waiting. A begin is repeated only while its goal waits."""
        silences = asked.silences + 1
        if waits and silences >= SILENCES_UNTIL_ERROR:
            return RetriesExhausted()
        if waits or (silences < SILENCES_UNTIL_SETTLED and not isinstance(asked.call, BeginGoal)):
            self._outbox.add(AskResources(asked.call, silences))
        elif isinstance(asked.call, RecordOutcome):
            del self.pending_outcomes[asked.call.goal_id]
        return None

    def retry_end(self, asked: AskResources, run: GoalRun) -> None:
        """Go on after `RetriesExhausted`, so that nothing stays taken by a goal that has its terminal answer.

        It is unknown whether a begin was granted, so that its goal is given up. The outcome to commit is the one that
        the client got.
        """
        call = asked.call
        if isinstance(call, BeginGoal):
            call = self._end(run, NO_TOKEN, EndKind.ERROR)
        elif isinstance(call, RecordOutcome) and run.state.terminal is not None:
            call = replace(call, terminal=run.state.terminal)
        self._outbox.add(AskResources(call, asked.silences + 1))

    def _begin(self, run: GoalRun) -> BeginGoal:
        return BeginGoal(
            goal_id=run.goal_id,
            skill=self._skill,
            inputs=dict(run.inputs),
            manager=self._manager,
            owner=run.client,
            schema=self._schema,
            cause=run.record,
            incarnation=self._incarnation,
        )

    def _end(self, run: GoalRun, token: int, how: EndKind, result: str | None = None) -> EndGoal:
        return EndGoal(
            goal_id=run.goal_id,
            skill=self._skill,
            token=token,
            how=how,
            result=result,
            cause=run.record,
            incarnation=self._incarnation,
        )
