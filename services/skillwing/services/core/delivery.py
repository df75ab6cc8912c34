"""Delivery of questions to the resource manager. The rules are the same for every question:

silence never means "not done", so the question is repeated; after ten silences the client gets its answer without one;
then the manager goes on, until the resource manager has released what the goal may hold and committed its outcome.
"""

from __future__ import annotations

from msgspec.structs import replace

from skillwing.services.core.goal_states import Committing, Finishing, GoalRun
from skillwing.services.core.outbox import Outbox
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.skill_actions import Action, AskResources
from skillwing.services.core.skill_events import Reply, ResourcesAnswer, RetriesExhausted
from skillwing.services.protocol import (
    NO_TOKEN,
    BeginGoal,
    EndGoal,
    EndKind,
    ErrorCode,
    ErrorReply,
    RecordOutcome,
    Terminal,
)

SILENCES_UNTIL_ERROR = 10
"""Silences after which a goal gets its terminal answer without the resource manager. That takes 5.6 s if no process
is there, and 26 s if one hangs: each question then takes its timeout of 2 s."""
SILENCES_UNTIL_ABANDONED = 600
"""Silences after which the manager stops repeating the question."""
PENDING_OUTCOMES_LIMIT = 100
"""Goals at a time whose local outcome is not committed yet."""
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

    def require_room(self) -> None:
        """Refuse a start while too many outcomes wait for their commit."""
        if len(self.pending_outcomes) >= PENDING_OUTCOMES_LIMIT:
            text = f"`{self._skill}` still waits until {PENDING_OUTCOMES_LIMIT} outcomes are committed."
            raise RefusedError(ErrorCode.UNAVAILABLE, text, help="Ask again.")

    def ask(self, run: GoalRun) -> None:
        """Put the question of the goal's state for the first time."""
        match run.state:
            case Finishing(token=token, how=how, result=result):
                call = self._end(run, token, how, result)
            case Committing(outcome=outcome):
                call = self._commit(run, outcome)
            case _:
                call = self._begin(run)
        self._outbox.add(AskResources(call))

    def receive(
        self, asked: AskResources, answer: ResourcesAnswer, run: GoalRun | None
    ) -> Reply | RetriesExhausted | None:
        """The event that an answer, or silence, is for the goal; None if the goal does not wait for it."""
        call = asked.call
        commits = type(call) is RecordOutcome
        if commits and call.goal_id not in self.pending_outcomes:
            return None
        waits = False
        if run is not None and type(call) is run.state.question:
            # The end of another goal of that id, forgotten long ago, has another token.
            waits = not isinstance(call, EndGoal) or call.token == run.state.token
        if answer is None or (type(answer) is ErrorReply and answer.code in LIKE_SILENCE):
            return self.retry_or_fail(asked, waits=waits)
        if commits:
            del self.pending_outcomes[call.goal_id]
        return Reply(answer) if waits else None

    def retry_or_fail(self, asked: AskResources, *, waits: bool) -> RetriesExhausted | None:
        """Repeat the question after a silence, or stop waiting. A begin is repeated only while its goal waits."""
        silences = asked.silences + 1
        if waits and silences >= SILENCES_UNTIL_ERROR:
            return RetriesExhausted()
        if waits or (silences < SILENCES_UNTIL_ABANDONED and not isinstance(asked.call, BeginGoal)):
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

    def _commit(self, run: GoalRun, outcome: Terminal) -> RecordOutcome:
        self.pending_outcomes[run.goal_id] = run
        return RecordOutcome(
            goal_id=run.goal_id,
            skill=self._skill,
            terminal=outcome,
            manager=self._manager,
            incarnation=self._incarnation,
            cause=run.record,
        )

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
