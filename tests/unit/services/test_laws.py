"""Laws of the cores, on a network that loses, repeats and reorders, for any order of events."""

from __future__ import annotations

from typing import Any

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import Bundle, RuleBasedStateMachine, invariant, multiple, rule
from rig import RIG

from skillwing.services.core.delivery import SILENCES_UNTIL_ABANDONED
from skillwing.services.core.events import GoalSilent, ManagerGone, TimePassed
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.resource_core import ResourceCore, Step
from skillwing.services.core.skill_actions import Action, AskResources, CallHook, Hook
from skillwing.services.core.skill_core import SkillCore
from skillwing.services.core.skill_events import (
    Dispatched,
    Event,
    Failed,
    QuestionAnswered,
    Raised,
    RenewalAnswered,
    StopConfirmed,
    Terminated,
    Validated,
)
from skillwing.services.ids import RecordIds
from skillwing.services.protocol import (
    AttachManager,
    DataSample,
    Ending,
    ErrorReply,
    FireExtern,
    GoalStatus,
    InterruptGoal,
    Lost,
    ModifyGoal,
    Record,
    RecordKind,
    StartGoal,
    State,
    Terminal,
    Violated,
)

MOVERS = ("move", "carry")
SKILLS = (*MOVERS, "shine", "watch")
INCARNATION = "the only one"
RESULTS = {"move": ("DONE", "STUCK"), "carry": ("END",), "shine": ("END",), "watch": ("END",)}
EXTERNS = tuple(
    (resource.name, edge.target) for resource in RIG.resources for edge in resource.transitions if edge.extern
)


class Managers(RuleBasedStateMachine):
    """One resource manager and a manager for each skill. Questions and pushes lie around until a rule moves them."""

    goals: Bundle[tuple[str, str]] = Bundle("goals")

    def __init__(self) -> None:
        super().__init__()
        self.now = 0.0
        self.resources = ResourceCore(RIG, source="rm", new_record_id=RecordIds("rm"))
        self.skills = {
            name: SkillCore(RIG, name, source=f"skill/{name}", new_record_id=RecordIds(name), incarnation=INCARNATION)
            for name in SKILLS
        }
        for name in SKILLS:
            attach = AttachManager(manager=f"skill/{name}", incarnation=INCARNATION, schema=RIG.schema_hash)
            self.resources.step(attach, self.now)
        self.last_step = 0
        self.questions: list[tuple[str, AskResources]] = []
        self.pushes: list[Violated | Lost] = []
        self.accepted: set[str] = set()
        self.halted_early: set[str] = set()
        self.dispatched: list[str] = []
        self.answers: dict[str, list[Terminal]] = {}
        self.count = 0

    # --- plumbing ----------------------------------------------------------------------------------------------------

    def step(self, skill: str, event: Event) -> None:
        self.perform(skill, self.skills[skill].step(event, self.now))

    def perform(self, skill: str, actions: tuple[Action, ...]) -> None:
        for action in actions:
            match action:
                case AskResources():
                    self.questions.append((skill, action))
                case GoalStatus(terminal=Terminal() as terminal):
                    self.answers.setdefault(action.goal_id, []).append(terminal)
                case CallHook(hook=Hook.VALIDATE):
                    self.step(skill, Validated(action.goal_id))
                case CallHook(hook=Hook.DISPATCH):
                    self.dispatched.append(action.goal_id)
                case _:
                    pass

    def judge(self, step: Step[Any]) -> Any:
        """Look at what one atomic step has published."""
        before, self.last_step = self.last_step, self.resources.last_step
        assert step.number == self.last_step == before + bool(step.publications), (
            "steps that tell something are counted"
        )
        for change in step.publications:
            assert not (
                isinstance(change, Record) and change.kind is RecordKind.RESOURCE and change.before == change.after
            )
        if step.reply is not None and not isinstance(step.reply, ErrorReply):
            assert step.reply.step <= self.last_step, "a reply names its step, or an earlier one"
        self.pushes += [each for each in step.publications if isinstance(each, (Violated, Lost))]
        return step.reply

    def execute(self, asked: AskResources) -> Any:
        """Carry out a question in the resource manager. A refusal is an answer."""
        try:
            return self.judge(self.resources.step(asked.call, self.now))
        except RefusedError as refusal:
            assert self.resources.last_step == self.last_step, "a refusal changes nothing"
            return refusal.reply

    # --- what may happen ---------------------------------------------------------------------------------------------

    @rule(target=goals, skill=st.sampled_from(SKILLS))
    def name_a_goal(self, skill: str) -> Any:
        self.count += 1
        return multiple((skill, f"g{self.count}"))

    @rule(goal=goals, speed=st.sampled_from([1.0, 99.0]))
    def start(self, goal: tuple[str, str], speed: float) -> None:
        skill, goal_id = goal
        inputs: dict[str, Any] = {"speed": speed} if skill == "move" else {}
        request = StartGoal(goal_id=goal_id, inputs=inputs, client="c", schema=RIG.schema_hash)
        self.accepted.add(goal_id)
        self.step(skill, request)

    @rule(goal=goals)
    def interrupt(self, goal: tuple[str, str]) -> None:
        skill, goal_id = goal
        try:
            self.step(skill, InterruptGoal(goal_id=goal_id, client="c"))
        except RefusedError:
            assert goal_id not in self.accepted
            self.halted_early.add(goal_id)

    @rule(goal=goals)
    def modify(self, goal: tuple[str, str]) -> None:
        skill, goal_id = goal
        core = self.skills[skill]
        self.count += 1
        before = core.current.revision if core.current else 0
        request_id = f"m{self.count}"
        inputs: dict[str, Any] = {"speed": 2.0}
        request = ModifyGoal(goal_id=goal_id, request_id=request_id, inputs=inputs, client="c", schema=RIG.schema_hash)
        try:
            self.step(skill, request)
        except RefusedError:
            assert (core.current.revision if core.current else before) == before
            return
        assert core.current is not None and core.current.goal_id == goal_id
        assert core.current.phase is State.RUNNING, "only a running goal is modified"
        assert core.current.inputs["speed"] == 2.0
        core.modifications.require_accepted(request_id)
        assert core.status(goal_id).revision == core.current.revision == before + 1

    @rule(data=st.data(), how=st.sampled_from(["deliver", "lose the answer", "lose the question", "repeat"]))
    def move_a_question(self, data: st.DataObject, how: str) -> None:
        if not self.questions:
            return
        skill, asked = self.questions.pop(data.draw(st.integers(0, len(self.questions) - 1)))
        answer = None if how == "lose the question" else self.execute(asked)
        if how == "repeat":
            self.execute(asked)
        if how == "lose the answer":
            answer = None
        self.step(skill, QuestionAnswered(asked, answer))

    @rule(data=st.data())
    def deliver_a_push(self, data: st.DataObject) -> None:
        if self.pushes:
            verdict = self.pushes.pop(data.draw(st.integers(0, len(self.pushes) - 1)))
            self.step(verdict.skill, verdict)

    @rule(goal=goals, data=st.data(), call=st.sampled_from(["dispatched", "end", "interrupted", "failed", "raised"]))
    def the_hooks_speak(self, goal: tuple[str, str], data: st.DataObject, call: str) -> None:
        skill, goal_id = goal
        match call:
            case "dispatched":
                event = Dispatched(goal_id)
            case "end":
                event = Terminated(goal_id, data.draw(st.sampled_from(RESULTS[skill])))
            case "interrupted":
                event = StopConfirmed(goal_id)
            case "failed":
                event = Failed(goal_id, "It broke.")
            case _:
                event = Raised(goal_id, "progress", "ValueError: oh")
        self.step(skill, event)

    @rule(extern=st.sampled_from(EXTERNS))
    def the_world_changes(self, extern: tuple[str, str]) -> None:
        try:
            request = FireExtern(resource=extern[0], target=extern[1], source="world")
            self.judge(self.resources.step(request, self.now))
        except RefusedError:
            assert self.resources.last_step == self.last_step

    @rule(percent=st.sampled_from([80.0, 12.0, 5.0]))
    def the_battery_tells(self, percent: float) -> None:
        sample = DataSample(name="battery", value=percent, t=self.now)
        self.judge(self.resources.step(sample, self.now))

    @rule(seconds=st.sampled_from([0.1, 1.0, 3.5]))
    def time_passes(self, seconds: float) -> None:
        self.now += seconds
        self.judge(self.resources.step(TimePassed(), self.now))
        for skill in self.skills:
            self.step(skill, TimePassed())

    @rule(skill=st.sampled_from(SKILLS))
    def a_manager_seems_lost(self, skill: str) -> None:
        self.judge(self.resources.step(ManagerGone(f"skill/{skill}"), self.now))

    @rule(goal=goals)
    def a_goal_falls_silent(self, goal: tuple[str, str]) -> None:
        self.judge(self.resources.step(GoalSilent(goal[1], "silent for 2.0 s"), self.now))

    @rule(skill=st.sampled_from(SKILLS))
    def a_manager_renews(self, skill: str) -> None:
        core = self.skills[skill]
        if (renewal := core.renewal()) is None:
            return
        try:
            answer = self.judge(self.resources.step(renewal, self.now))
        except RefusedError as refusal:
            answer = refusal.reply
        self.step(skill, RenewalAnswered(renewal, answer))

    # --- what always holds -------------------------------------------------------------------------------------------

    @invariant()
    def nobody_shares_the_axes(self) -> None:
        holders = [grant for grant in self.resources.grants if grant.skill.name in MOVERS]
        assert len(holders) <= 1
        if holders:
            assert self.resources.states["axes"] == "USED"

    @invariant()
    def tokens_grow(self) -> None:
        tokens = [grant.token for grant in self.resources.grants]
        assert tokens == sorted(set(tokens))

    @invariant()
    def every_goal_has_one_answer_at_most_and_is_dispatched_once(self) -> None:
        assert all(len(answers) == 1 for answers in self.answers.values())
        assert len(self.dispatched) == len(set(self.dispatched))

    @invariant()
    def halted_skills_never_move(self) -> None:
        assert self.halted_early.isdisjoint(self.dispatched)
        for goal_id in self.halted_early & self.answers.keys():
            assert self.answers[goal_id][0].ending is Ending.INTERRUPTED

    @invariant()
    def no_grant_outlives_its_violation(self) -> None:
        assert self.resources.step(TimePassed(), self.now).publications == ()

    def teardown(self) -> None:
        """Let the network heal: then every accepted goal gets its answer, and nothing stays taken."""
        for _ in range(SILENCES_UNTIL_ABANDONED):
            if not self.questions and not self.pushes and all(core.current is None for core in self.skills.values()):
                break
            while self.questions:
                skill, asked = self.questions.pop(0)
                self.step(skill, QuestionAnswered(asked, self.execute(asked)))
            while self.pushes:
                verdict = self.pushes.pop(0)
                self.step(verdict.skill, verdict)
            for skill, core in self.skills.items():
                run = core.current
                if run is not None and run.phase is State.DISPATCHING:
                    self.step(skill, Dispatched(run.goal_id))
                elif run is not None:
                    self.step(skill, InterruptGoal(goal_id=run.goal_id, client="c"))
                    self.step(skill, StopConfirmed(run.goal_id))
        assert self.answers.keys() == self.accepted
        assert all(len(answers) == 1 for answers in self.answers.values())
        assert self.resources.grants == ()


Managers.TestCase.settings = settings(max_examples=60, stateful_step_count=40, deadline=None)
TestManagers = Managers.TestCase
