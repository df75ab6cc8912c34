"""A resource core that goes on from a journal is the one that wrote it, whatever happened and whatever comes."""

from __future__ import annotations

from copy import copy
from typing import Any

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import Bundle, RuleBasedStateMachine, initialize, invariant, rule

from skillwing.dsl import parse
from skillwing.services.core.events import ManagerGone, Resumed, TimePassed
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.resource_core import ResourceCore, Step
from skillwing.services.core.snapshot import EMPTY_SNAPSHOT
from skillwing.services.ids import RecordIds
from skillwing.services.journal.journal import Journal
from skillwing.services.journal.schema import Identity
from skillwing.services.protocol import (
    AttachManager,
    BeginGoal,
    DataSample,
    EndGoal,
    EndKind,
    ErrorReply,
    FireEvent,
    FireExtern,
    Record,
    RenewGoal,
)

CRANE = parse(
    """
    skillset crane {
        data { wind: float64 [m/s] period=1.0  limit: float64 [kg] }
        resource power { initial ON  extern ON -> OFF  extern OFF -> ON }
        resource hook { initial FREE  FREE -> TAKEN  TAKEN -> FREE }
        resource lamp { initial DARK  DARK -> LIT  LIT -> DARK }
        event blackout { guard resource=(power == ON) effect { power -> OFF } }
        skill lift {
            input { load: float64 [kg] = 1.0 }
            effect { take: hook -> TAKEN  free: hook -> FREE }
            precondition {
                free: resource=(hook == FREE)
                calm: data=(wind < 9.0)
                light: data=(limit > load)
                success take
            }
            invariant {
                power: resource=(power == ON) violation=free
                calm: data=(wind < 12.0) violation=free
                allowed: data=(limit > load) violation=free
            }
            interrupt { apply=free }
            result { success DONE: apply=free  failure STUCK: apply=free post resource=(lamp == DARK) }
        }
        skill shine {
            effect { light: lamp -> LIT  dark: lamp -> DARK }
            precondition { dark: resource=(lamp == DARK)  success light }
            invariant { busy: resource=(hook == TAKEN or power == ON) violation=dark }
            interrupt { apply=dark }
            result { END: apply=dark }
        }
    }
    """,
    "crane.skillset",
)
RESULTS = {"lift": ("DONE", "STUCK"), "shine": ("END",)}
SKILLS = st.sampled_from(sorted(RESULTS))
INCARNATIONS = st.sampled_from(["a", "b", "c"])


class TwoCores(RuleBasedStateMachine):
    """One core lives on and on, the other is made again from the journal time and again. Nobody can tell them apart."""

    goals: Bundle[tuple[str, str]] = Bundle("goals")

    def __init__(self) -> None:
        super().__init__()
        self.now = 0.0
        self.count = 0
        self.tokens = [0]
        self.journal = Journal(None, Identity("r1", CRANE.name, CRANE.schema_hash))
        self.ids = RecordIds("rm")
        self.constant = ResourceCore(CRANE, source="rm", new_record_id=self.ids)
        self.journal.write(self.constant.initial_entries(), (), self.now, 0)
        self.renewed = ResourceCore(CRANE, source="rm", new_record_id=RecordIds("rm"))

    def take(self, call: Any) -> Any:
        """Take a step on both, and write down what the one that is made again must not forget."""
        constant, renewed = self.attempt(call, self.constant), self.attempt(call, self.renewed)
        assert constant == renewed
        if isinstance(renewed, Step):
            self.write(renewed)
            return renewed.reply
        return renewed

    def attempt(self, call: Any, core: ResourceCore) -> Step | ErrorReply:
        try:
            return call(core)
        except RefusedError as refusal:
            return refusal.reply

    def write(self, step: Step) -> None:
        records = [each for each in step.publications if isinstance(each, Record)]
        self.journal.write(step.entries, records, self.now, step.number)

    # --- what may happen ---------------------------------------------------------------------------------------------

    @initialize()
    def the_first_data_come(self) -> None:
        self.measure("wind", 3.0)
        self.measure("limit", 3.0)

    @rule()
    def die_and_come_back(self) -> None:
        kept = self.journal.snapshot()
        assert kept is not None
        # Both give the same ids from here on, so that their steps can be compared.
        self.renewed = ResourceCore(CRANE, source="rm", new_record_id=copy(self.ids), snapshot=kept or EMPTY_SNAPSHOT)
        step = self.renewed.step(Resumed(), self.now)
        (resumed,) = step.publications
        assert isinstance(resumed, Record)
        assert resumed.id == self.ids()
        # The other core has not told this step, but counts it.
        self.constant._state.last_step = step.number  # pyright: ignore[reportPrivateUsage]
        self.write(step)
        for item in CRANE.data:
            reading = self.constant.data.reading(item.name, self.now)
            sample = DataSample(name=item.name, value=reading.value, t=reading.t or 0.0)
            heard = self.renewed.step(sample, self.now)
            assert heard == Step(None, step.number), "what was known before changes nothing"

    @rule(target=goals, skill=SKILLS, incarnation=INCARNATIONS, load=st.sampled_from([1.0, 5.0]))
    def begin(self, skill: str, incarnation: str, load: float) -> tuple[str, str]:
        self.count += 1
        goal = (skill, f"g{self.count}")
        self.begin_again(goal, incarnation, load)
        return goal

    @rule(goal=goals, incarnation=INCARNATIONS, load=st.sampled_from([1.0, 5.0]))
    def begin_again(self, goal: tuple[str, str], incarnation: str, load: float) -> None:
        skill, goal_id = goal
        request = BeginGoal(
            goal_id=goal_id,
            skill=skill,
            inputs={"load": load} if skill == "lift" else {},
            manager=f"skill/{skill}",
            owner="test",
            schema=CRANE.schema_hash,
            incarnation=incarnation,
        )
        verdict = self.take(lambda core: core.step(request, self.now))
        self.tokens.append(getattr(verdict, "token", 0))

    @rule(goal=goals, data=st.data(), how=st.sampled_from(EndKind))
    def end(self, goal: tuple[str, str], data: st.DataObject, how: EndKind) -> None:
        skill, goal_id = goal
        result = data.draw(st.sampled_from(RESULTS[skill])) if how is EndKind.RESULT else None
        token = data.draw(st.sampled_from(self.tokens[-3:]))
        request = EndGoal(goal_id=goal_id, skill=skill, token=token, how=how, result=result)
        self.take(lambda core: core.step(request, self.now))

    @rule(goal=goals, data=st.data())
    def renew(self, goal: tuple[str, str], data: st.DataObject) -> None:
        request = RenewGoal(goal_id=goal[1], skill=goal[0], token=data.draw(st.sampled_from(self.tokens[-3:])))
        self.take(lambda core: core.step(request, self.now))

    @rule(skill=SKILLS, incarnation=INCARNATIONS)
    def attach(self, skill: str, incarnation: str) -> None:
        request = AttachManager(manager=f"skill/{skill}", incarnation=incarnation)
        self.take(lambda core: core.step(request, self.now))

    @rule(skill=SKILLS)
    def a_manager_is_lost(self, skill: str) -> None:
        self.take(lambda core: core.step(ManagerGone(f"skill/{skill}"), self.now))

    @rule(state=st.sampled_from(["ON", "OFF"]))
    def power(self, state: str) -> None:
        request = FireExtern(resource="power", target=state, source="grid")
        self.take(lambda core: core.step(request, self.now))

    @rule()
    def blackout(self) -> None:
        self.take(lambda core: core.step(FireEvent(event="blackout", source="grid"), self.now))

    @rule(name=st.sampled_from(["wind", "limit"]), value=st.sampled_from([0.5, 3.0, 10.0, 20.0]))
    def measure(self, name: str, value: float) -> None:
        sample = DataSample(name=name, value=value, t=self.now)
        self.take(lambda core: core.step(sample, self.now))

    @rule(seconds=st.sampled_from([0.0, 0.4, 2.0, 3.5]))
    def time_passes(self, seconds: float) -> None:
        self.now += seconds
        self.take(lambda core: core.step(TimePassed(), self.now))

    # --- what always holds -------------------------------------------------------------------------------------------

    @invariant()
    def the_journal_ends_where_the_last_step_has_led(self) -> None:
        kept = self.journal.snapshot()
        core = ResourceCore(CRANE, source="rm", new_record_id=RecordIds("rm"), snapshot=kept or EMPTY_SNAPSHOT)
        assert core.states == self.constant.states
        assert core.last_step == self.constant.last_step
        assert core.grants == self.constant.grants

    def teardown(self) -> None:
        self.journal.close()


TwoCores.TestCase.settings = settings(max_examples=40, stateful_step_count=30, deadline=None)
TestTwoCores = TwoCores.TestCase
