"""The rules of a skill's manager. One core is one skill, which runs one goal at a time.

`SkillCore.step` takes an event and the robot time, and returns the actions to carry out. What happens to a goal stands
in `goal_states.py`; `docs/semantics.md` gives the rules and their reasons.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, get_args

from skillwing.dsl.model import Skillset
from skillwing.services.core.bounded_dict import GOALS_REMEMBERED, BoundedDict
from skillwing.services.core.checks import check_goal_id, check_timely
from skillwing.services.core.delivery import Delivery
from skillwing.services.core.events import TimePassed
from skillwing.services.core.goal_inputs import first_inputs
from skillwing.services.core.goal_states import (
    Executing,
    GoalRun,
    GoalState,
    Holding,
    Idle,
)
from skillwing.services.core.modifications import Modifications
from skillwing.services.core.outbox import Outbox
from skillwing.services.core.owners import stop_without
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.skill_actions import Action, CallHook, Hook
from skillwing.services.core.skill_events import (
    Accepted,
    CurrentGoalEvent,
    Event,
    Failed,
    GoalEvent,
    OwnerGone,
    QuestionAnswered,
    Rejected,
    RetriesExhausted,
    StopConfirmed,
    StopRequested,
    Terminated,
)
from skillwing.services.protocol import (
    Ending,
    ErrorCode,
    GoalStatus,
    InterruptGoal,
    ModifyGoal,
    RenewGoal,
    StartGoal,
    Terminal,
)

RENEWAL_PERIOD = 0.5
"""Wall time in seconds between two renewals of a grant."""
IDLE = Idle()
ACCEPTED = Accepted()
CALLS_TO_END = (Terminated, StopConfirmed, Failed)


class SkillCore:
    """The state of one skill's manager.

    source: name of the process, for grants and the timeline; incarnation: tells processes of that name apart.
    new_record_id: source of the ids of timeline records.
    """

    def __init__(
        self,
        skillset: Skillset,
        skill: str,
        *,
        source: str,
        new_record_id: Callable[[], str],
        incarnation: str,
    ) -> None:
        self._skillset = skillset
        self.skill = skillset.skill(skill)
        self._source = source
        self._new_record_id = new_record_id
        self._outbox: Outbox[Action] = Outbox()
        self._delivery = Delivery(skill, skillset.schema_hash, source, incarnation, self._outbox)
        self._current: GoalRun | None = None
        self._finished: BoundedDict[str, GoalStatus] = BoundedDict(GOALS_REMEMBERED)
        # Ids of goals whose interrupt came before their start.
        self._interrupted_early: BoundedDict[str, None] = BoundedDict(GOALS_REMEMBERED)
        self.modifications = Modifications(self.skill)
        self._handlers: dict[type, Callable[[Any, float], None]] = {
            StartGoal: self._start,
            InterruptGoal: self._interrupt,
            ModifyGoal: self._modify,
            OwnerGone: self._on_owner_gone,
            QuestionAnswered: self._on_answer,
            TimePassed: self._on_time,
            **dict.fromkeys(get_args(CurrentGoalEvent), self._on_current),
        }
        self.dropped_calls = 0
        """Ends and confirmations by the developer that came when there was nothing to end."""

    @property
    def current(self) -> GoalRun | None:
        """The goal that runs, or is about to."""
        return self._current

    def status(self, goal_id: str | None) -> GoalStatus:
        """The status of a goal; for None, of the current one, else of the latest."""
        if goal_id is None:
            status = self._current.status if self._current else self._finished.newest()
        else:
            run = self._run_of(goal_id)
            status = run.status if run else self._finished.get(goal_id)
        if status is None:
            which = "no goal yet" if goal_id is None else f"no goal {goal_id}"
            raise RefusedError(ErrorCode.UNKNOWN_GOAL, f"`{self.skill.name}` knows of {which}.", help="Start one.")
        return status

    def next_tick(self) -> float | None:
        """The time at which `TimePassed` is due if nothing happens before; None for never."""
        state = self._current.state if self._current else None
        return state.deadline if isinstance(state, Executing) else None

    def renewal(self) -> RenewGoal | None:
        """The renewal of the current goal's grant, to be sent every `RENEWAL_PERIOD`; None without a grant."""
        run = self._current
        if run is None or not isinstance(run.state, Holding):
            return None
        return RenewGoal(goal_id=run.goal_id, skill=self.skill.name, token=run.state.token)

    # --- the way in --------------------------------------------------------------------------------------------------

    def step(self, event: Event, now: float) -> tuple[Action, ...]:
        """Take an event at robot time `now`. A `RefusedError` says that a request was refused."""
        self._handlers[type(event)](event, now)
        return self._outbox.drain()

    def _start(self, request: StartGoal, now: float) -> None:
        """Take a goal, or answer it with a local outcome. A known id changes nothing."""
        check_goal_id(request.goal_id)
        if self._run_of(request.goal_id) is not None or request.goal_id in self._finished:
            return
        check_timely(self._skillset, self.skill.name, request, now)
        self._delivery.require_room()
        run = GoalRun(request.goal_id, {}, request.client, request.owner, now, IDLE, request.cause)
        run.owner_grace = request.owner_grace
        terminal = self._obstacle(run, request)
        if terminal is None:
            self._current = run
        self._take(run, ACCEPTED if terminal is None else Rejected(terminal), now)

    def _obstacle(self, run: GoalRun, request: StartGoal) -> Terminal | None:
        """The local outcome of a goal that cannot be taken; None for one that can, which then has its inputs."""
        if run.goal_id in self._interrupted_early:
            self._interrupted_early.pop(run.goal_id)
            return Terminal(ending=Ending.INTERRUPTED, reason="It was interrupted before it started.")
        if self._current is not None:
            reason = f"`{self.skill.name}` is busy with goal {self._current.goal_id}."
            return Terminal(ending=Ending.BUSY, reason=reason, running_goal=self._current.goal_id)
        run.inputs, terminal = first_inputs(self.skill, request.inputs)
        return terminal

    def _interrupt(self, request: InterruptGoal, now: float) -> None:
        """Ask a goal to stop. The id of an unknown one is remembered: if its start still comes, it ends IT."""
        check_goal_id(request.goal_id)
        run = self._run_of(request.goal_id)
        if run is not None:
            self._take(run, StopRequested(f"{request.client} interrupted it.", request.cause), now)
        elif request.goal_id not in self._finished:
            self._interrupted_early[request.goal_id] = None
            text = f"`{self.skill.name}` knows of no goal {request.goal_id}."
            help = "Should its start still arrive, it will end interrupted."
            raise RefusedError(ErrorCode.UNKNOWN_GOAL, text, help=help)

    def _modify(self, request: ModifyGoal, now: float) -> None:
        """Give the running goal new inputs, if they fit. A known request changes nothing."""
        if request.request_id in self.modifications:
            return
        check_goal_id(request.goal_id)
        check_timely(self._skillset, self.skill.name, request, now)
        run = self._run_of(request.goal_id)
        if run is None:
            self.modifications.refuse(request, lambda: self.status(request.goal_id))
        self._take(run, self.modifications.requested(request, run), now)

    def _on_owner_gone(self, event: OwnerGone, now: float) -> None:
        run = self._current
        if run is not None and run.owner == event.owner and self.skill.owner_lost == "interrupt":
            self._take(run, stop_without(event, run), now)

    def _on_answer(self, event: QuestionAnswered, now: float) -> None:
        run = self._run_of(event.asked.call.goal_id)
        news = self._delivery.receive(event.asked, event.answer, run)
        if run is None or news is None:
            return
        self._take(run, news, now)
        if isinstance(news, RetriesExhausted):
            self._delivery.retry_end(event.asked, run)

    def _on_time(self, event: TimePassed, now: float) -> None:
        if self._current is not None:
            self._take(self._current, event, now)

    def _on_current(self, event: CurrentGoalEvent, now: float) -> None:
        """Give an event to the current goal, if that is the one. A developer's call that is too late is counted."""
        run = self._current
        taken = run is not None and run.goal_id == event.goal_id and self._take(run, event, now)
        if not taken and isinstance(event, CALLS_TO_END):
            self.dropped_calls += 1

    def _take(self, run: GoalRun, event: GoalEvent, now: float) -> bool:
        """Carry out the reaction of a goal; False if its state has none to the event."""
        reaction = run.state.on(event, self.skill, now)
        if reaction is None:
            return False
        before = run.state
        state, action, cause = reaction
        run.step = max(run.step, event.step)
        run.state = state
        if cause is not None:
            run.record = cause or None
        text = self.modifications.apply(run, before) if action is Hook.MODIFY else state.text
        if run.status is None or (run.status.state, run.status.revision) != (state.phase, run.revision):
            self._publish(run, state, now, text)
        self.modifications.settle(run, before, event)
        if not state.busy and self._current is run:
            self._current = None
        if isinstance(action, Hook):
            token = state.token or before.token
            inputs = self.modifications.inputs_of(run)
            self._outbox.add(CallHook(action, run.goal_id, inputs, token, run.started_at, state.terminal))
        elif action is not None:
            self._delivery.ask(run)
        return True

    def _publish(self, run: GoalRun, state: GoalState, now: float, text: str) -> None:
        """Publish the phase of a goal, which is a timeline record as well. text: its explanation, if not the first."""
        before, text = (run.status.state, text) if run.status else ("IDLE", f"asked by {run.client}")
        run.status = status = GoalStatus(
            goal_id=run.goal_id,
            skill=self.skill.name,
            state=state.phase,
            t=now,
            terminal=state.terminal,
            record=self._new_record_id(),
            source=self._source,
            before=before,
            text=text,
            cause=run.record,
            after_step=run.step,
            revision=run.revision,
        )
        run.record = status.record
        self._outbox.add(status)
        if state.terminal is not None:
            self._finished[run.goal_id] = status

    def _run_of(self, goal_id: str) -> GoalRun | None:
        """The goal of that id, if it has no terminal answer or its local outcome is not committed yet."""
        run = self._current
        return run if run is not None and run.goal_id == goal_id else self._delivery.pending_outcomes.get(goal_id)
