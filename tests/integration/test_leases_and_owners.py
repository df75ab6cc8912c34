"""Managers that hang and clients that vanish, in virtual time: every goal ends, and every resource gets free."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from skillwing.dsl import parse
from skillwing.dsl.model import Skillset
from skillwing.services.bus import Bus, Sample
from skillwing.services.bus.inprocess import InProcessBus
from skillwing.services.client.causal_feed import follow_records
from skillwing.services.client.goal_handle import GoalHandle
from skillwing.services.client.goal_tracker import VERDICT_PATIENCE
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.core.events import ManagerGone
from skillwing.services.core.goal_states import RENEWALS_UNTIL_UNWATCHED
from skillwing.services.core.leases import LOOK_PERIOD
from skillwing.services.core.skill_core import RENEWAL_PERIOD
from skillwing.services.managers.hooks import Goal, SkillHooks
from skillwing.services.managers.leased_core import DISPATCH_GRACE, GRANT_LEASE
from skillwing.services.managers.liveliness_monitor import LOSS_DEBOUNCE
from skillwing.services.mocking import MockRun, MockScript
from skillwing.services.names import skill_process
from skillwing.services.protocol import Keys, Lost, Record, RecordKind, StartGoal, State, decode, encode
from skillwing.services.testing import SkillsetInProcess

CRANE = parse(
    """
    skillset crane {
        resource hook { initial FREE  FREE -> TAKEN  TAKEN -> FREE }
        resource wind { initial WEAK  extern WEAK -> STRONG  extern STRONG -> WEAK }
        skill lift {
            dispatch_timeout=4.0
            effect { take: hook -> TAKEN  release: hook -> FREE }
            precondition { free: resource=(hook == FREE)  success take }
            invariant { calm: resource=(wind == WEAK) violation=release }
            interrupt { apply=release timeout=5.0 }
            result { UP: apply=release }
        }
    }
    """,
    "crane.skillset",
)
KEYS = Keys("crane")
LIFT = skill_process("lift")
FOREVER = MockRun(delay=600.0)


def crane(*runs: MockRun, skillset: Skillset = CRANE) -> SkillsetInProcess:
    return SkillsetInProcess(skillset, script=MockScript(skills={"lift": runs}))


class Mission:
    """A client that owns the goals it starts."""

    def __init__(self, robot: SkillsetInProcess, name: str = "mission", grace: float = 0.0) -> None:
        self._robot = robot
        self.bus: Bus = robot.network.bus(name)
        self.interface = SkillsetInterface(self.bus, robot.skillset, client=name, owns_goals=True, owner_grace=grace)

    def start(self) -> GoalHandle:
        goal = self.interface.start("lift", {})
        self._robot.run_until(lambda: goal.state is State.RUNNING)
        return goal


# --- managers --------------------------------------------------------------------------------------------------------


def test_a_goal_that_runs_for_long_keeps_its_grant() -> None:
    robot = crane(MockRun(delay=120.0))
    robot.start_skill("lift").assert_ended("S_UP", within=130.0)


def test_an_idle_system_says_nothing_about_grants(monkeypatch: pytest.MonkeyPatch) -> None:
    robot = crane(MockRun(delay=1.0))
    robot.start_skill("lift").assert_ended("S_UP")
    asked: list[str] = []
    monkeypatch.setattr(InProcessBus, "ask", lambda bus, key, *rest, **more: asked.append(key))
    robot.run(30.0)
    assert set(asked) == {KEYS.resource_attach}


def last_change(records: list[Record], resource: str) -> Record:
    return [record for record in records if record.subject == resource][-1]


def test_mistake_a_manager_that_hangs_keeps_its_resources_for_ever() -> None:
    robot = crane(MockRun(delay=10.0, hang=True), FOREVER)
    records: list[Record] = []
    follow_records(robot.bus, KEYS, records.append)
    goal = robot.start_skill("lift")
    taken_at = last_change(records, "hook").t
    goal.assert_ended("LOST", within=20.0, detected_by="resource_manager", reason="silent for")
    freed = last_change(records, "hook")
    assert freed.after == "FREE"
    assert GRANT_LEASE - RENEWAL_PERIOD <= freed.t - (taken_at + 10.0) <= GRANT_LEASE + 0.1
    assert robot.now() <= freed.t + VERDICT_PATIENCE + 0.5, "nobody waits for an answer that cannot come"


def test_a_manager_that_hangs_cannot_keep_a_violation_to_itself() -> None:
    robot = crane(MockRun(delay=1.0, hang=True))
    goal = robot.start_skill("lift")
    robot.run(1.1)
    robot.set_states(wind="STRONG")
    goal.assert_ended("RI", within=VERDICT_PATIENCE + 0.1, invariant="calm")
    assert goal.causes[:2] == ["wind STRONG", "lift.calm VIOLATED"]


def test_the_first_lease_leaves_time_for_a_slow_dispatch(monkeypatch: pytest.MonkeyPatch) -> None:
    # A manager that is still in `on_dispatch` renews nothing.
    monkeypatch.setattr("skillwing.services.core.skill_core.SkillCore.renewal", lambda core: None)
    robot = crane(FOREVER)
    goal = robot.start_skill("lift")
    robot.run(CRANE.skill("lift").dispatch_timeout + DISPATCH_GRACE - 0.1)
    goal.assert_running()
    goal.assert_ended("LOST", within=0.2, detected_by="resource_manager")


def test_a_hook_that_blocks_its_manager_is_on_the_timeline(monkeypatch: pytest.MonkeyPatch) -> None:
    blocked = 0.0
    virtual = InProcessBus.now
    monkeypatch.setattr(InProcessBus, "wall", lambda bus: virtual(bus) + blocked)

    class Lift(SkillHooks[Any, Any, Any]):
        skill = "lift"

        def on_dispatch(self, goal: Goal[Any]) -> None:
            nonlocal blocked
            blocked += 4.5

    robot = SkillsetInProcess(CRANE, [Lift])
    records: list[Record] = []
    follow_records(robot.bus, KEYS, records.append)
    goal = robot.start_skill("lift")
    goal.assert_running()
    [report] = [record for record in records if record.kind is RecordKind.PROCESS]
    assert (report.subject, report.after, report.goal_id) == (LIFT, "BLOCKED", goal.id)
    assert report.text == "`on_dispatch` blocked its manager for 4.5 s; hooks have to return"
    assert robot.chain(report.cause)[-1] == "lift DISPATCHING"


def test_a_manager_that_was_blocked_publishes_no_start_of_a_goal_that_it_has_lost(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    blocked = 0.0
    virtual = InProcessBus.now
    monkeypatch.setattr(InProcessBus, "wall", lambda bus: virtual(bus) + blocked)

    class Lift(SkillHooks[Any, Any, Any]):
        skill = "lift"

        def on_dispatch(self, goal: Goal[Any]) -> None:
            nonlocal blocked
            blocked += 10.0
            manager, _ = robot._running[LIFT]
            lost = Lost(goal_id=goal.id, skill="lift", reason="Silent.", t=0.0, step=1, record="rm#1", token=goal.token)
            # What the bus has received while the hook blocked.
            robot.bus.post(lambda: manager._step(lost))  # pyright: ignore[reportAttributeAccessIssue]

    robot = SkillsetInProcess(CRANE, [Lift])
    records: list[Record] = []
    follow_records(robot.bus, KEYS, records.append)
    Mission(robot).interface.start("lift", {})
    robot.run(1.0)
    told = [record.after for record in records if record.source == LIFT and record.kind is RecordKind.GOAL]
    assert told == ["VALIDATING", "DISPATCHING", "LOST"]


def test_a_manager_learns_that_its_goal_was_revoked_although_the_push_was_lost() -> None:
    class Lift(SkillHooks[Any, Any, Any]):
        skill = "lift"
        ended = ""

        def on_ended(self, goal: Goal[Any], terminal: Any) -> None:
            self.ended = terminal.label

    robot = SkillsetInProcess(CRANE, [Lift])
    robot.start_skill("lift")
    manager, _ = robot._running[LIFT]
    manager._on_verdict = lambda sample: None  # pyright: ignore[reportAttributeAccessIssue]
    judge, _ = robot._running["resource_manager"]
    judge._perform(ManagerGone(LIFT))  # pyright: ignore[reportAttributeAccessIssue]
    robot.run(RENEWAL_PERIOD + 0.1)
    assert robot.hooks["lift"].ended == "LOST"  # pyright: ignore[reportAttributeAccessIssue]


def test_a_goal_without_resource_manager_is_asked_to_stop() -> None:
    robot = crane(FOREVER)
    goal = robot.start_skill("lift")
    _, judges_bus = robot._running["resource_manager"]
    judges_bus.close()
    robot.run(RENEWALS_UNTIL_UNWATCHED * RENEWAL_PERIOD - 1.0)
    goal.assert_running()
    goal.assert_ended("ERROR", within=10.0, reason="nobody watches the invariants")


def test_a_revoked_token_is_published() -> None:
    robot = crane(MockRun(delay=1.0, hang=True))
    verdicts: list[Lost] = []

    def note(sample: Sample) -> None:
        verdicts.append(decode(sample.payload, Lost))

    robot.bus.subscribe(KEYS.verdict("*"), note, events=True)
    goal = robot.start_skill("lift")
    robot.run(4.0)
    [lost] = verdicts
    assert lost.goal_id == goal.id
    assert lost.token > 0


# --- clients ---------------------------------------------------------------------------------------------------------


def test_goals_of_a_client_that_dies_are_interrupted() -> None:
    robot = crane(MockRun(delay=600.0, stop_delay=1.0))
    mission = Mission(robot)
    goal_id = mission.start().goal_id
    mission.bus.close()
    robot.run(LOSS_DEBOUNCE + 0.1)
    robot.assert_states(hook="TAKEN", within=0.0)
    watch = robot.client.follow("lift", goal_id)
    robot.assert_states(hook="FREE")
    robot.run(0.1)
    assert watch.terminal is not None
    assert watch.terminal.label == "IT"
    assert watch.terminal.reason.startswith("Its owner mission-")


def test_a_client_whose_token_flaps_keeps_its_goals() -> None:
    robot = crane(FOREVER)
    mission = Mission(robot)
    goal = mission.start()
    owner = mission.interface._owner
    assert owner is not None
    for _ in range(5):
        robot.run(LOSS_DEBOUNCE / 2)
        mission.bus.declare_alive(KEYS.alive(owner)).cancel()  # the same key: gone for others, though never for itself
        mission.bus.declare_alive(KEYS.alive(owner))
    robot.run(5.0)
    assert goal.state is State.RUNNING


def test_goals_of_a_client_that_dies_run_on_for_its_grace() -> None:
    robot = crane(FOREVER)
    mission = Mission(robot, grace=20.0)
    goal_id = mission.start().goal_id
    mission.bus.close()
    robot.run(LOSS_DEBOUNCE + 20.0 - 0.1)
    robot.assert_states(hook="TAKEN", within=0.0)
    watch = robot.client.follow("lift", goal_id)
    robot.assert_states(hook="FREE", within=0.5)
    robot.run(0.1)
    assert watch.terminal is not None
    assert watch.terminal.reason.endswith("is gone, and has not come back within 20 s.")


def test_a_client_that_is_back_within_its_grace_keeps_its_goals() -> None:
    robot = crane(FOREVER)
    mission = Mission(robot, grace=20.0)
    mission.start()
    owner = mission.interface._owner
    assert owner is not None
    mission.bus.close()
    robot.run(15.0)
    robot.network.bus("back").declare_alive(KEYS.alive(owner))
    robot.run(60.0)
    robot.assert_states(hook="TAKEN", within=0.0)


@given(grace=st.floats(0.0, 60.0), absence=st.floats(0.1, 70.0))
@settings(max_examples=20)
def test_a_goal_ends_exactly_if_its_owner_is_away_for_longer_than_debounce_and_grace(
    grace: float, absence: float
) -> None:
    """A quarter of a second round the limit is left out: that is how often leases are looked at."""
    assume(abs(absence - LOSS_DEBOUNCE - grace) > LOOK_PERIOD)
    robot = crane(FOREVER)
    mission = Mission(robot, grace=grace)
    mission.start()
    owner = mission.interface._owner
    assert owner is not None
    mission.bus.close()
    robot.run(absence)
    robot.network.bus("back").declare_alive(KEYS.alive(owner))
    robot.run(LOOK_PERIOD)
    ended = absence > LOSS_DEBOUNCE + grace
    robot.assert_states(hook="FREE" if ended else "TAKEN", within=0.0)


def test_a_start_that_arrives_after_its_owner_has_died_gets_its_grace() -> None:
    robot = crane(FOREVER)
    request = StartGoal(
        goal_id="late",
        inputs={},
        client="mission",
        schema=CRANE.schema_hash,
        owner="client/mission-of-yesterday",
        owner_grace=5.0,
    )
    robot.bus.ask(KEYS.start("lift"), encode(request), lambda answer: None)
    robot.run(LOSS_DEBOUNCE + 4.5)
    robot.assert_states(hook="TAKEN", within=0.0)
    robot.run(1.0)
    robot.assert_states(hook="FREE", within=0.0)


def test_a_goal_that_nobody_owns_outlives_who_started_it() -> None:
    robot = crane(FOREVER)
    bus = robot.network.bus("cli")
    goal = SkillsetInterface(bus, CRANE, client="cli").start("lift", {})
    robot.run_until(lambda: goal.state is State.RUNNING)
    bus.close()
    robot.run(30.0)
    robot.assert_states(hook="TAKEN", within=0.0)


def test_a_skill_may_say_that_it_continues() -> None:
    skills = tuple(replace(skill, owner_lost="continue") for skill in CRANE.skills)
    robot = crane(FOREVER, skillset=replace(CRANE, skills=skills))
    mission = Mission(robot)
    mission.start()
    mission.bus.close()
    robot.run(30.0)
    robot.assert_states(hook="TAKEN", within=0.0)


def test_a_start_that_arrives_after_its_owner_has_died_does_not_run_on() -> None:
    robot = crane(FOREVER)
    request = StartGoal(
        goal_id="late", inputs={}, client="mission", schema=CRANE.schema_hash, owner="client/mission-of-yesterday"
    )
    robot.bus.ask(KEYS.start("lift"), encode(request), lambda answer: None)
    robot.run(LOSS_DEBOUNCE + 0.2)
    robot.assert_states(hook="FREE", within=0.0)


def test_the_goals_of_others_run_on() -> None:
    robot = crane(FOREVER)
    first, second = Mission(robot, "first"), Mission(robot, "second")
    goal = first.start()
    second.bus.close()
    robot.run(5.0)
    assert goal.state is State.RUNNING
