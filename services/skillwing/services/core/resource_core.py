"""The resource manager's semantics: who may take what, and who may keep it.

Every method is one atomic step: it takes a request and the robot time, changes the states, and returns the reply
together with everything to be published, in order. A request that is refused raises `RefusedError` and changes
nothing. `docs/semantics.md` gives the rules and their reasons.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Generic, TypeAlias, TypeVar

from skillwing.dsl.expressions import Environment, Expression, names_used
from skillwing.dsl.model import Invariant, Skill, Skillset, UnknownNameError
from skillwing.services.core.checks import check_goal_id, check_schema, unknown_name
from skillwing.services.core.grants import (
    NO_TOKEN,
    Grant,
    Ledger,
    abandons_unknown_grant,
    check_fence,
    check_local_outcome,
    check_token,
    unknown_goal,
)
from skillwing.services.core.guards import explain_failure
from skillwing.services.core.incarnations import Incarnations
from skillwing.services.core.latest_data import LatestData
from skillwing.services.core.outbox import Outbox
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.resource_table import Event, ResourceTable
from skillwing.services.core.snapshot import DatumEntry, Entry, FinishedGoal, Snapshot
from skillwing.services.core.values import fit_fields
from skillwing.services.protocol import (
    AttachManager,
    BeginGoal,
    DataSample,
    Ended,
    EndGoal,
    EndKind,
    ErrorCode,
    FireEvent,
    FireExtern,
    GoalVerdict,
    Granted,
    Lost,
    NotReady,
    Record,
    RecordKind,
    RecordOutcome,
    RenewGoal,
    ResourceStates,
    Violated,
)

Publication: TypeAlias = Event | Record
SAID_AGAIN = 10.0
"""Seconds before its last step for which the network may have failed to pass on what a process said."""
R = TypeVar("R")
EMPTY_SNAPSHOT = Snapshot(
    resources=(), grants=(), goals=(), managers=(), data=(), last_token=NO_TOKEN, records=(), t=0.0
)


@dataclass(frozen=True, slots=True)
class Step(Generic[R]):
    """What one atomic step answers to the one who asked, tells everybody, and must not forget."""

    reply: R
    publications: tuple[Publication, ...] = ()
    entries: tuple[Entry, ...] = ()


class ResourceCore:
    """States of all resources, the grants, and the latest values of the data that guards name.

    source: name of the process, for the timeline. new_record_id: gives each timeline record its id. found: states in
    which resources are found at the start instead of their initial ones. kept: what the entries of a predecessor's
    steps add up to; this core goes on from there, beginning with `resume`. data: instead of none yet.
    """

    def __init__(
        self,
        skillset: Skillset,
        *,
        source: str,
        new_record_id: Callable[[], str],
        found: Mapping[str, str] | None = None,
        kept: Snapshot | None = None,
        data: LatestData | None = None,
    ) -> None:
        kept = kept or EMPTY_SNAPSHOT
        self._skillset = skillset
        self._source = source
        self._entries: list[Entry] = []
        keep = self._entries.append
        self._outbox: Outbox[Event] = Outbox(source, new_record_id)
        self._table = ResourceTable(skillset, self._outbox, keep, found=found, kept=kept.resources)
        grants = (
            Grant(skillset.skill(each.skill), each.inputs, each.manager, each.incarnation, each.granted)
            for each in kept.grants
        )
        self._ledger = Ledger(keep, grants, kept.goals, kept.last_token)
        self._incarnations = Incarnations(keep, kept.managers)
        self._data = data or LatestData(skillset, _data_in_guards(skillset))
        if data is None:
            for datum in kept.data:
                self._data.accept(DataSample(name=datum.name, value=datum.value, t=datum.t), datum.t)
        else:
            self._keep_what_lasts({datum.name: datum.value for datum in kept.data})

    @property
    def states(self) -> Mapping[str, str]:
        """State of each resource; a live view."""
        return self._table.states

    @property
    def revision(self) -> int:
        """Grows by one with every effect or extern transition that changes something."""
        return self._table.revision

    @property
    def grants(self) -> tuple[Grant, ...]:
        """The goals that hold a grant, the oldest first."""
        return self._ledger.grants

    @property
    def data_names(self) -> tuple[str, ...]:
        """The data that guards name, hence that have to be fed in."""
        return self._data.names

    def snapshot(self, now: float) -> ResourceStates:
        return ResourceStates(revision=self.revision, states=dict(self.states), t=now)

    def next_tick(self, now: float) -> float | None:
        """When `tick` is due if nothing happens before: the next datum turns stale. None for never."""
        return self._data.next_stale_at(now) if self.grants else None

    # --- going on where another process has stopped ------------------------------------------------------------------

    @property
    def data(self) -> LatestData:
        """The latest values, for a core that takes this one's place."""
        return self._data

    def initial_entries(self) -> tuple[Entry, ...]:
        """The entries that a new journal begins with."""
        return self._table.initial_entries()

    def resume(self, kept: Snapshot, now: float) -> Step[tuple[Publication, ...]]:
        """Go on from what was kept. The reply is to be published first: what the predecessor may not have got out.

        Of the data nothing is known at first. Each is taken for as fresh as its last value may have been.
        """
        self._data.clamp_timestamps(now)
        self._data.mark_unknown(now)
        goals = f"{len(self.grants)} goal{'' if len(self.grants) == 1 else 's'}"
        text = f"went on from its journal at revision {self.revision} with {goals}"
        since = kept.t - SAID_AGAIN
        again: list[Publication] = [record for record in kept.records if record.t >= since]
        verdicts = (over.verdict for over in kept.goals)
        again += [each for each in verdicts if isinstance(each, (Violated, Lost)) and each.t >= since]
        self._outbox.record(now, RecordKind.PROCESS, self._source, None, "RESUMED", text)
        return self._finish(tuple(again))

    # --- from the functional layer and operators ---------------------------------------------------------------------

    def fire_extern(self, request: FireExtern, now: float) -> Step[ResourceStates]:
        """Drive one extern transition; the reply holds all states after everything that it broke."""
        self._check_schema_if_told(request.schema)
        try:
            resource = self._skillset.resource(request.resource)
        except UnknownNameError as error:
            raise unknown_name(error) from error
        if request.target not in resource.states:
            raise unknown_name(UnknownNameError(f"state of {resource.name}", request.target, resource.states))
        transitions = [(resource.name, request.target)]
        obstacle = self._table.obstacle(transitions, extern=True)
        if obstacle is not None:
            targets = self._table.extern_targets(resource.name)
            there = f"From {self.states[resource.name]} "
            help_text = there + (
                f"the functional layer can bring it to {' or '.join(targets)}." if targets else "only skills move it."
            )
            raise RefusedError(ErrorCode.NOT_ALLOWED, obstacle, help=help_text, known=targets)
        self._table.apply(transitions, now, f"reported by {request.source}", cause=request.cause)
        self._enforce_invariants(now)
        return self._finish(self.snapshot(now))

    def fire_event(self, request: FireEvent, now: float) -> Step[ResourceStates]:
        """Fire an event: its guard and all its extern transitions, or nothing."""
        self._check_schema_if_told(request.schema)
        try:
            event = self._skillset.event(request.event)
        except UnknownNameError as error:
            raise unknown_name(error) from error
        self._require_news(event.guard, now)
        obstacle = None if event.guard is None else explain_failure(event.guard, self._environment({}, now))
        obstacle = obstacle or self._table.obstacle(event.effect.transitions, extern=True)
        if obstacle is not None:
            text = f"The event `{event.name}` cannot happen now: {obstacle}"
            raise RefusedError(ErrorCode.NOT_ALLOWED, text, help="Look at the states of the resources.")
        text = f"event {event.name} by {request.source}"
        self._table.apply(event.effect.transitions, now, text, cause=request.cause)
        self._enforce_invariants(now)
        return self._finish(self.snapshot(now))

    def update_datum(self, sample: DataSample, now: float) -> Step[None]:
        """Take a datum that guards name; any other is ignored."""
        if sample.name in self._data.names:
            before = self._data.value(sample.name)
            problem = self._data.accept(sample, now)
            if problem is not None:
                raise RefusedError(ErrorCode.BAD_REQUEST, problem, help="The sample was dropped.")
            if self._data.never_expires(sample.name) and self._data.value(sample.name) != before:
                self._entries.append(DatumEntry(sample.name, self._data.value(sample.name), now))
            self._enforce_invariants(now)
        return self._finish(None)

    def tick(self, now: float) -> Step[None]:
        """Let time pass: guards no longer hold on data that have turned stale."""
        self._enforce_invariants(now)
        return self._finish(None)

    # --- from skill managers -----------------------------------------------------------------------------------------

    def attach_manager(self, request: AttachManager, now: float) -> Step[ResourceStates]:
        """A manager has started. Its predecessor is gone, however short its alive token was away."""
        self._check_schema_if_told(request.schema)
        self._incarnations.check(request.manager, request.incarnation)
        self._replace(request.manager, request.incarnation, now)
        return self._finish(self.snapshot(now))

    def begin(self, request: BeginGoal, now: float) -> Step[GoalVerdict]:
        """Judge the preconditions and apply the start effect. The same goal id again gets the latest verdict on it."""
        check_goal_id(request.goal_id)
        check_schema(self._skillset, request.schema)
        skill = self._skill(request.skill)
        known = self._ledger.verdict(request.goal_id, skill.name)
        grant = self._ledger.active(request.goal_id)
        if grant is not None and _is_of_predecessor(grant, request):
            return self._take_from_predecessor(grant, request, now)
        if known is not None:
            return Step(known)
        inputs = _checked_inputs(skill, request.inputs)
        self._incarnations.check(request.manager, request.incarnation)
        for check in skill.preconditions.checks:
            self._require_news(check.expression, now)
        if request.incarnation:
            self._replace(request.manager, request.incarnation, now)
        failing = self._failing_preconditions(skill, inputs, now)
        if failing:
            return self._finish(self._refuse_readiness(request, skill, failing, now))
        record = self._record(skill, "GRANTED", now, request.goal_id, request.cause, f"to {request.manager}")
        self._apply(skill, skill.preconditions.success, record, request.goal_id, now)
        granted = Granted(
            goal_id=request.goal_id, token=self._ledger.next_token(now), revision=self.revision, record=record
        )
        self._ledger.open(Grant(skill, inputs, request.manager, request.incarnation, granted))
        self._enforce_invariants(now)
        # An invariant may be false from the start, say for want of data: the goal is then over already.
        return self._finish(self._ledger.verdict(request.goal_id, skill.name) or granted)

    def end(self, request: EndGoal, now: float) -> Step[GoalVerdict]:
        """Apply the effect of an end. For a goal that is over already the reply says how it ended."""
        check_goal_id(request.goal_id)
        skill = self._skill(request.skill)
        effect, post = _effect_of_end(skill, request)
        known = self._ledger.verdict(request.goal_id, skill.name)
        grant = self._ledger.active(request.goal_id)
        if grant is None:
            return self._end_without_grant(request, skill, known, now)
        check_fence(request, grant)
        self._require_news(post, now)
        record = self._record(skill, "ENDED", now, grant.goal_id, request.cause, request.result or request.how)
        reason = self._apply(skill, effect, record, grant.goal_id, now)
        if not reason and post is not None:
            broken = explain_failure(post, self._environment(grant.inputs, now))
            reason = f"The postcondition {broken}" if broken else ""
        ended = Ended(
            goal_id=grant.goal_id,
            held=not reason,
            reason=reason,
            revision=self.revision,
            record=record,
            how=request.how,
            result=request.result,
        )
        # What the goal gives back may break its own invariants: it is over before they are judged.
        self._ledger.close(grant, ended)
        self._enforce_invariants(now)
        return self._finish(ended)

    def record_outcome(self, request: RecordOutcome, now: float) -> Step[GoalVerdict]:
        """Commit the outcome of a goal without a grant, unless another process of the manager has done something
        with it.

        A successor that is asked for the goal gives the same answer, and does not run it.
        """
        del now
        check_goal_id(request.goal_id)
        skill = self._skill(request.skill)
        check_local_outcome(request)
        self._incarnations.check_attached(request.manager, request.incarnation)
        verdict = self._ledger.verdict(request.goal_id, skill.name)
        if self._ledger.active(request.goal_id) is not None:
            text = f"The goal {request.goal_id} holds a grant."
            raise RefusedError(ErrorCode.STALE_TOKEN, text, help="Leave it to the process that runs it.")
        if verdict is not None:
            return Step(verdict)
        ended = Ended(
            goal_id=request.goal_id,
            held=False,
            reason="",
            revision=self.revision,
            record=request.cause or "",
            terminal=request.terminal,
        )
        self._ledger.remember(FinishedGoal(request.goal_id, skill.name, NO_TOKEN, ended))
        return self._finish(ended)

    def renew(self, request: RenewGoal) -> Step[GoalVerdict]:
        """Tell a manager whether its goal still stands: `Granted`, or what has happened to it."""
        verdict = self._ledger.verdict(request.goal_id, self._skill(request.skill).name)
        if verdict is None:
            raise unknown_goal(request.goal_id)
        grant = self._ledger.active(request.goal_id)
        if grant is not None:
            check_token(request, grant.token)
        return Step(verdict)

    def manager_lost(self, manager: str, now: float, reason: str = "its alive token is gone") -> Step[None]:
        """Take from a manager that is gone all goals it held: their lost effects are applied, the oldest goal first."""
        self._lose_all([grant for grant in self.grants if grant.manager == manager], reason, now)
        return self._finish(None)

    def goal_lost(self, goal_id: str, now: float, reason: str) -> Step[None]:
        """Take one goal from a manager that says nothing about it any more; a goal that is over stays as it is."""
        grant = self._ledger.active(goal_id)
        self._lose_all([] if grant is None else [grant], reason, now)
        return self._finish(None)

    # --- verdicts ----------------------------------------------------------------------------------------------------

    def _failing_preconditions(self, skill: Skill, inputs: Mapping[str, object], now: float) -> dict[str, str]:
        """Every check that fails, and why. A start effect that cannot be applied counts as one."""
        environment = self._environment(inputs, now)
        reasons = {check.name: explain_failure(check.expression, environment) for check in skill.preconditions.checks}
        failing = {name: reason for name, reason in reasons.items() if reason is not None}
        start = skill.preconditions.success
        if not failing and (obstacle := self._table.obstacle(skill.transitions(start))) is not None:
            failing[f"effect {start}"] = f"The effect `{start}` cannot be applied: {obstacle}"
        return failing

    def _refuse_readiness(self, request: BeginGoal, skill: Skill, failing: dict[str, str], now: float) -> NotReady:
        effect = skill.preconditions.failure
        if (obstacle := self._table.obstacle(skill.transitions(effect))) is not None:
            failing = {**failing, f"effect {effect}": f"The effect `{effect}` could not be applied: {obstacle}"}
        text = " ".join(failing.values())
        record = self._record(skill, "NOT_READY", now, request.goal_id, request.cause, text)
        self._apply(skill, effect, record, request.goal_id, now)
        verdict = NotReady(goal_id=request.goal_id, failing=failing, record=record)
        self._ledger.remember(FinishedGoal(request.goal_id, skill.name, NO_TOKEN, verdict))
        self._enforce_invariants(now)
        return verdict

    def _end_without_grant(
        self, request: EndGoal, skill: Skill, known: GoalVerdict | None, now: float
    ) -> Step[GoalVerdict]:
        past = self._ledger.finished(request.goal_id)
        given_up = abandons_unknown_grant(request)
        if known is not None and past is not None:
            if not given_up:
                check_token(request, past.token)
            return Step(known)
        if not given_up:
            raise unknown_goal(request.goal_id)
        # Its begin may still be under way somewhere. It must not take anything when it arrives.
        text = "The manager gave the goal up before it was granted."
        record = self._record(skill, "ENDED", now, request.goal_id, request.cause, text)
        ended = Ended(goal_id=request.goal_id, held=False, reason=text, revision=self.revision, record=record)
        self._ledger.remember(FinishedGoal(request.goal_id, skill.name, NO_TOKEN, ended))
        return self._finish(ended)

    def _take_from_predecessor(self, grant: Grant, request: BeginGoal, now: float) -> Step[GoalVerdict]:
        """A process asks for a goal that was granted to another one of its name: it must not run a second time."""
        self._incarnations.check(request.manager, request.incarnation)
        self._replace(request.manager, request.incarnation, now)
        over = self._ledger.finished(grant.goal_id)
        return self._finish(over.verdict if over is not None else grant.granted)

    def _replace(self, manager: str, incarnation: str, now: float) -> None:
        """Take this incarnation for the latest; its predecessors hold nothing any more."""
        self._incarnations.note(manager, incarnation)
        held = [grant for grant in self.grants if grant.manager == manager and grant.incarnation != incarnation]
        self._lose_all(held, "another process has taken its place", now)

    def _lose_all(self, grants: Sequence[Grant], reason: str, now: float) -> None:
        for grant in grants:
            if self._ledger.active(grant.goal_id):  # and not violated by what an earlier one gave back
                self._lose(grant, f"The manager `{grant.manager}` was lost: {reason}.", now)
                self._enforce_invariants(now)

    def _lose(self, grant: Grant, reason: str, now: float) -> None:
        skill = grant.skill
        record = self._record(skill, "LOST", now, grant.goal_id, grant.granted.record, reason)
        unapplied = self._apply(skill, _lost_effect(skill), record, grant.goal_id, now)
        lost = Lost(
            goal_id=grant.goal_id,
            skill=skill.name,
            reason=f"{reason} {unapplied}".rstrip(),
            t=now,
            record=record,
            token=grant.token,
        )
        self._ledger.close(grant, lost)
        self._outbox.add(lost)

    # --- invariants --------------------------------------------------------------------------------------------------

    def _enforce_invariants(self, now: float) -> None:
        """End goals until no invariant is violated.

        After each violation effect all is judged again from the top, for the effect may break, or mend, any other
        invariant. Each round ends one goal, so there are no more rounds than goals.
        """
        data_records: dict[str, str] = {}
        while (found := self._first_violation(now)) is not None:
            self._violate(*found, data_records, now)

    def _first_violation(self, now: float) -> tuple[Grant, Invariant, str] | None:
        """In order of grant, then of declaration."""
        for grant in self.grants:
            environment = self._environment(grant.inputs, now)
            for invariant in grant.skill.invariants:
                why = explain_failure(invariant.expression, environment)
                if why is not None and not self._data.freshness_unknown(names_used(invariant.expression, "data"), now):
                    return grant, invariant, why
        return None

    def _violate(self, grant: Grant, invariant: Invariant, why: str, data_records: dict[str, str], now: float) -> None:
        skill = grant.skill
        subject, cause = self._culprit(grant, invariant, why, data_records, now)
        record = self._outbox.record(
            now,
            RecordKind.GOAL,
            f"{skill.name}.{invariant.name}",
            "HOLDS",
            "VIOLATED",
            why,
            cause=cause,
            goal_id=grant.goal_id,
        )
        unapplied = self._apply(skill, invariant.violation, record, grant.goal_id, now)
        violated = Violated(
            goal_id=grant.goal_id,
            skill=skill.name,
            invariant=invariant.name,
            subject=subject,
            reason=f"{why} {unapplied}".rstrip(),
            t=now,
            record=record,
            token=grant.token,
        )
        self._ledger.close(grant, violated)
        self._outbox.add(violated)

    def _culprit(
        self, grant: Grant, invariant: Invariant, why: str, data_records: dict[str, str], now: float
    ) -> tuple[str, str]:
        """The resource or datum that broke the invariant, and the record of its change.

        data_records: a datum's record is written when it first breaks something in this step.
        """
        data = sorted(names_used(invariant.expression, "data"))
        if not data:
            change = self._table.latest_change(names_used(invariant.expression, "resource"))
            return change or (invariant.name, grant.granted.record)
        datum = next((name for name in data if not self._data.is_fresh(name, now)), data[0])
        if datum not in data_records:
            reading = self._data.reading(datum, now)
            after = "STALE" if reading.stale else str(reading.value)
            data_records[datum] = self._outbox.record(now, RecordKind.DATA, datum, None, after, why)
        return datum, data_records[datum]

    def _keep_what_lasts(self, kept: Mapping[str, object]) -> None:
        """Keep, with the next step, the lasting values that a step knew which was never written down."""
        for name in self._data.names:
            value, t = self._data.value(name), self._data.reading(name, 0.0).t
            if t is not None and self._data.never_expires(name) and kept.get(name) != value:
                self._entries.append(DatumEntry(name, value, t))

    # --- parts of a step ---------------------------------------------------------------------------------------------

    def _apply(self, skill: Skill, effect: str | None, cause: str, goal_id: str, now: float) -> str:
        """Apply an effect of a skill as a whole, or not at all: then return a sentence why, otherwise ""."""
        transitions = skill.transitions(effect)
        obstacle = self._table.obstacle(transitions)
        if obstacle is not None:
            return f"The effect `{effect}` could not be applied: {obstacle}"
        self._table.apply(transitions, now, f"effect {effect} of {skill.name}", cause=cause, goal_id=goal_id)
        return ""

    def _environment(self, inputs: Mapping[str, object], now: float) -> Environment:
        return Environment(resources=self.states, data=self._data.fresh(now), inputs=inputs)

    def _require_news(self, guard: Expression | None, now: float) -> None:
        """Refuse to judge on data that may be fresh, but are not known here yet."""
        if guard is not None and self._data.freshness_unknown(names_used(guard, "data"), now):
            text = "The resource manager has just been restarted and does not know all data yet."
            raise RefusedError(ErrorCode.UNAVAILABLE, text, help="Ask again.")

    def _check_schema_if_told(self, schema: str) -> None:
        if schema:
            check_schema(self._skillset, schema)

    def _skill(self, name: str) -> Skill:
        try:
            return self._skillset.skill(name)
        except UnknownNameError as error:
            raise unknown_name(error) from error

    def _record(self, skill: Skill, after: str, now: float, goal_id: str, cause: str | None, text: str) -> str:
        return self._outbox.record(now, RecordKind.GOAL, skill.name, None, after, text, cause=cause, goal_id=goal_id)

    def _finish(self, reply: R) -> Step[R]:
        entries = tuple(self._entries)
        self._entries.clear()
        return Step(reply, self._outbox.drain(), entries)


def _is_of_predecessor(grant: Grant, request: BeginGoal) -> bool:
    """Another process of the same name was granted the goal that this one asks for."""
    return grant.manager == request.manager and request.incarnation not in ("", grant.incarnation)


def _effect_of_end(skill: Skill, request: EndGoal) -> tuple[str | None, Expression | None]:
    """The effect to apply at an end, and the postcondition to judge after it."""
    match request.how, request.result:
        case EndKind.RESULT, str(name):
            try:
                result = skill.result(name)
            except UnknownNameError as error:
                raise unknown_name(error) from error
            return result.apply, result.post
        case EndKind.INTERRUPT, _:
            return skill.interrupt.apply, None
        case EndKind.ERROR, _:
            return _lost_effect(skill), None
        case _:
            raise RefusedError(
                ErrorCode.BAD_REQUEST,
                "A goal that ends with a result needs the name of one.",
                help=f"Name the `result` of `{skill.name}` that it ended with.",
                known=tuple(result.name for result in skill.results),
            )


def _lost_effect(skill: Skill) -> str | None:
    return skill.interrupt.apply if skill.lost is None else skill.lost


def _checked_inputs(skill: Skill, given: Mapping[str, object]) -> dict[str, object]:
    inputs, problems = fit_fields(skill.inputs, given)
    if problems:
        text = " ".join(problem.sentence for problem in problems)
        raise RefusedError(
            ErrorCode.BAD_REQUEST,
            f"The inputs do not fit `{skill.name}`: {text}",
            help="Send what the skillset declares.",
        )
    return inputs


def _data_in_guards(skillset: Skillset) -> frozenset[str]:
    guards = [event.guard for event in skillset.events if event.guard is not None]
    for skill in skillset.skills:
        guards += [check.expression for check in skill.preconditions.checks]
        guards += [invariant.expression for invariant in skill.invariants]
        guards += [result.post for result in skill.results if result.post is not None]
    return frozenset(name for guard in guards for name in names_used(guard, "data"))
