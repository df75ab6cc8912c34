"""Mocked skills and a mocked world on an in-process network: what the script says happens."""

from __future__ import annotations

from typing import Any

import pytest

from skillwing.dsl import parse
from skillwing.services.bus import Answer, Answered, NoReply, Refused
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.client.causal_feed import follow_records
from skillwing.services.client.interface import GoalHandle, SkillsetInterface
from skillwing.services.mocking import (
    InputDelay,
    MockRun,
    MockScript,
    MockWorld,
    Reaction,
    ScriptError,
    When,
    make_mock_managers,
)
from skillwing.services.mocking.fitting import fit_script
from skillwing.services.mocking.wording import run_text
from skillwing.services.mocking.world_core import Reactions
from skillwing.services.names import skill_process
from skillwing.services.protocol import (
    DataReading,
    DirectMock,
    Ending,
    ErrorCode,
    GoalStatus,
    Keys,
    Message,
    MockedData,
    MockPlan,
    QueryData,
    QueryMock,
    Record,
    ResetMock,
    SetMockedData,
    State,
    decode,
    encode,
)

ARM = parse("""
skillset arm {
    type Point { x: float64 [m]  z: float64 [m] }
    data { load: float64 [kg] period=0.5  at: Point period=0.1  note: string }
    resource power { initial ON  extern ON -> OFF  extern OFF -> ON }
    resource joints { initial FREE  FREE -> USED  USED -> FREE }
    event cut { guard resource=(power == ON) effect { power -> OFF } }
    skill reach {
        progress=0.5 { left: float64 [m] }
        input { target: Point }
        output { reached: Point }
        effect { take: joints -> USED  release: joints -> FREE }
        precondition { free: resource=(joints == FREE)  heavy: data=(load > 2.0)  success take }
        result { success THERE: apply=release  failure STUCK: apply=release }
        deadline=20.0
    }
    skill wave { result { success DONE } }
}
""")
KEYS = Keys("arm")
TARGET = {"target": {"x": 3.0, "z": 1.0}}


class Stage:
    """A mocked arm and a client."""

    def __init__(self, script: MockScript | None = None, *runs: MockRun) -> None:
        played = script or MockScript(skills={"reach": runs})
        self.network = InProcessNetwork()
        for node in (*make_mock_managers(ARM, played), MockWorld(ARM, played)):
            self.network.attach(node)
        self.bus = self.network.bus("client")
        self.records: list[Record] = []
        follow_records(self.bus, KEYS, self.records.append)
        self.client = SkillsetInterface(self.bus, ARM, client="client")
        self.network.run_for(0.2)

    def run(self, skill: str = "reach", inputs: Any = TARGET) -> str:
        goal = self.client.start(skill, inputs)
        return self.end(goal)

    def end(self, goal: GoalHandle) -> str:
        assert self.network.run_until(lambda: goal.done, 60.0)
        assert goal.terminal is not None
        self.network.run_for(0.1)
        return goal.terminal.label

    def running(self) -> GoalHandle:
        goal = self.client.start("reach", TARGET)
        assert self.network.run_until(lambda: goal.state is State.RUNNING, 5.0)
        return goal

    def ask(self, key: str, message: Message) -> Answer:
        answers: list[Answer] = []
        self.bus.ask(key, encode(message), answers.append)
        assert self.network.run_until(lambda: bool(answers), 10.0)
        return answers[0]

    def datum(self, name: str) -> Any:
        return self.client.reading(name).value


def direct(stage: Stage, when: Any = "next", **run: Any) -> Answer:
    return stage.ask(KEYS.mocked_skill("reach"), DirectMock(run=run, when=when))


# --- without a script ------------------------------------------------------------------------------------------------


def test_without_a_script_every_skill_can_be_started() -> None:
    stage = Stage()
    goal = stage.client.start("reach", TARGET)
    assert stage.end(goal) == "S_THERE"
    assert goal.terminal is not None
    assert goal.terminal.output == {"reached": {"x": 0.0, "z": 0.0}}
    assert goal.progress == {"left": 0.0}
    assert stage.run("wave", {}) == "S_DONE"


def test_data_are_fresh_whatever_their_period() -> None:
    stage = Stage()
    stage.network.run_for(7.0)
    for name in ("load", "at", "note"):
        assert not stage.client.reading(name).stale
    assert stage.datum("load") > 2.0


# --- skills ----------------------------------------------------------------------------------------------------------


def test_the_endings_of_a_run() -> None:
    stage = Stage(
        None,
        MockRun(invalid="The cable is too short."),
        MockRun(error="A gear broke."),
        MockRun(result="STUCK", delay=0.2),
        MockRun(),
    )
    assert [stage.run() for _ in range(5)] == ["NV", "ERROR", "S_STUCK", "S_THERE", "S_THERE"]


def test_a_goal_that_was_not_ready_leaves_its_run_to_the_next() -> None:
    stage = Stage(None, MockRun(result="STUCK"), MockRun())
    stage.ask(KEYS.mocked_world, SetMockedData(data={"load": 0.0}))
    stage.network.run_for(0.1)
    assert stage.run() == "NR"
    stage.ask(KEYS.mocked_world, ResetMock())
    stage.network.run_for(1.0)
    assert [stage.run(), stage.run()] == ["S_STUCK", "S_THERE"]


def test_a_crash_costs_the_goal_and_frees_what_it_held() -> None:
    stage = Stage(None, MockRun(crash=True))
    assert stage.run() == "LOST"
    stage.network.run_for(2.0)
    assert stage.client.states["joints"] == "FREE"
    assert isinstance(stage.ask(KEYS.mocked_skill("reach"), QueryMock()), NoReply)


def test_who_hangs_answers_nobody_and_keeps_its_token() -> None:
    stage = Stage(None, MockRun(hang=True, delay=0.5))
    stage.running()
    stage.network.run_for(1.0)
    answer = stage.ask(KEYS.mocked_skill("reach"), QueryMock())
    assert answer == NoReply(timed_out=True)
    tokens: list[str] = []
    stage.bus.watch_alive(KEYS.alive("**"), lambda key, alive: tokens.append(key))
    stage.network.run_for(0.1)
    assert KEYS.alive(skill_process("reach")) in tokens


def test_a_stop_that_is_never_confirmed_is_forced() -> None:
    stage = Stage(None, MockRun(forever=True, stop_delay="never"))
    goal = stage.running()
    stage.client.interrupt(goal)
    assert stage.end(goal) == "IT"
    assert goal.terminal is not None
    assert goal.terminal.forced


# --- directing -------------------------------------------------------------------------------------------------------


def test_the_next_goal_is_directed_and_those_after_it_are_not() -> None:
    stage = Stage()
    answer = direct(stage, result="STUCK", delay=0.2)
    assert isinstance(answer, Answered)
    plan = decode(answer.payload, MockPlan)
    assert plan.given == ({"result": "STUCK", "delay": 0.2},)
    assert plan.script == ({"result": "THERE"},)
    assert [stage.run(), stage.run()] == ["S_STUCK", "S_THERE"]


def test_all_goals_are_directed_until_the_script_restarts() -> None:
    stage = Stage()
    direct(stage, "always", result="STUCK")
    assert [stage.run(), stage.run()] == ["S_STUCK", "S_STUCK"]
    stage.ask(KEYS.mocked_skill("reach"), ResetMock())
    assert stage.run() == "S_THERE"


def test_the_goal_that_runs_is_directed() -> None:
    stage = Stage(None, MockRun(forever=True))
    goal = stage.running()
    direct(stage, "now", result="STUCK", delay=0.5)
    assert stage.end(goal) == "S_STUCK"
    refused = direct(stage, "now", result="STUCK")
    assert isinstance(refused, Refused)
    assert refused.error.code is ErrorCode.NOT_ALLOWED


@pytest.mark.parametrize("run", [{"forever": True}, {"result": "STUCK", "delay": 5.0}])
def test_a_goal_that_is_directed_while_it_stops_still_stops(run: dict[str, Any]) -> None:
    stage = Stage(None, MockRun(forever=True, stop_delay=1.0))
    goal = stage.running()
    stage.client.interrupt(goal)
    assert stage.network.run_until(lambda: goal.state is State.INTERRUPTING, 5.0)
    assert isinstance(direct(stage, "now", **run), Answered)
    stage.end(goal)
    assert goal.terminal is not None
    assert (goal.terminal.ending, goal.terminal.forced) == (Ending.INTERRUPTED, False)


def test_a_delay_comes_from_an_input_of_the_goal() -> None:
    stage = Stage(None, MockRun(delay=InputDelay("target.x")))
    goal = stage.running()
    stage.network.run_for(TARGET["target"]["x"] - 0.3)
    assert goal.state is State.RUNNING
    stage.network.run_for(0.6)
    assert goal.terminal is not None
    assert goal.terminal.label == "S_THERE"


def test_a_run_with_a_delay_from_an_input_is_directed() -> None:
    stage = Stage(None, MockRun(forever=True))
    answer = direct(stage, "next", result="STUCK", delay={"input": "target.z"})
    assert isinstance(answer, Answered)
    (run,) = decode(answer.payload, MockPlan).given
    assert run_text(run) == "STUCK after `target.z` seconds"
    assert stage.run() == "S_STUCK"
    stage.running()
    assert isinstance(direct(stage, "now", result="THERE", delay={"input": "target.z"}), Answered)


def test_a_typing_error_changes_nothing() -> None:
    stage = Stage()
    for run in ({"result": "STUK"}, {"dely": 1.0}, {"delay": -1.0}, {"output": {"reached": 1.0}}):
        refused = direct(stage, **run)
        assert isinstance(refused, Refused)
        assert refused.error.code is ErrorCode.BAD_REQUEST
    refused = stage.ask(KEYS.mocked_world, SetMockedData(data={"laod": 1.0}))
    assert isinstance(refused, Refused)
    assert "did you mean `load`?" in refused.error.message
    assert stage.run() == "S_THERE"


def test_data_are_directed() -> None:
    stage = Stage()
    refused = stage.ask(KEYS.mocked_world, SetMockedData(data={"load": {"from": 9.0, "to": 4.0}}))
    assert "data.load does not say how long it takes. Add `over`, in seconds." in str(refused)
    answer = stage.ask(KEYS.mocked_world, SetMockedData(data={"load": {"from": 9.0, "to": 4.0, "over": 5.0}}))
    assert isinstance(answer, Answered)
    assert decode(answer.payload, MockedData).values["load"] == pytest.approx(9.0)
    stage.network.run_for(2.6)
    assert stage.datum("load") == pytest.approx(6.5, abs=0.3)
    stage.network.run_for(9.0)
    assert stage.datum("load") == 4.0


# --- reactions -------------------------------------------------------------------------------------------------------


def script(*reactions: Reaction, **more: Any) -> MockScript:
    return MockScript(reactions=reactions, **more)


def test_the_world_begins_as_configured() -> None:
    stage = Stage(
        script(Reaction(after=5.0, set={"note": "late"}), resources={"power": "OFF"}, data={"at": {"x": 1.0}})
    )
    stage.network.run_for(1.0)
    assert stage.client.states["power"] == "OFF"
    assert stage.datum("at") == {"x": 1.0, "z": 0.0}
    assert stage.datum("note") == ""
    stage.network.run_for(5.0)
    assert stage.datum("note") == "late"


def test_the_world_is_there_when_it_is_as_the_script_begins() -> None:
    played = script(resources={"power": "OFF"})
    network = InProcessNetwork()
    bus = network.bus("client")
    seen: list[tuple[str, str]] = []

    def note(key: str, alive: bool) -> None:
        if alive:
            seen.append((key.rsplit("/", 1)[-1], client.states.get("power", "")))

    client = SkillsetInterface(bus, ARM, client="client")
    bus.watch_alive(KEYS.alive("**"), note)
    network.attach(MockWorld(ARM, played))
    network.run_for(2.0)
    assert seen == []
    for node in make_mock_managers(ARM, played):
        network.attach(node)
    network.run_for(2.0)
    assert ("mocked_world", "OFF") in seen


def test_who_waits_for_the_world_finds_its_data_known() -> None:
    """`load` is told every 0.5 s, `note` every second: nobody has to wait for the next time."""
    network = InProcessNetwork()
    bus = network.bus("client")
    network.attach(MockWorld(ARM, MockScript()))
    network.run_for(0.3)
    client = SkillsetInterface(bus, ARM, client="client")
    goals: list[GoalHandle] = []
    answers: list[Answer] = []

    def begin(key: str, alive: bool) -> None:
        goals.append(client.start("reach", TARGET))
        bus.ask(KEYS.data("note"), encode(QueryData()), answers.append)

    bus.watch_alive(KEYS.alive("mocked_world"), begin)
    for node in make_mock_managers(ARM, MockScript()):
        network.attach(node)
    assert network.run_until(lambda: bool(goals and answers) and goals[0].state is not None, 5.0)
    network.run_for(0.1)
    assert goals[0].state is State.RUNNING
    (answer,) = answers
    assert isinstance(answer, Answered)
    assert decode(answer.payload, DataReading).value == ""


def test_a_resource_that_changes_is_reacted_to_with_its_record_as_cause() -> None:
    stage = Stage(
        script(
            Reaction(after=2.0, fire="cut"),
            Reaction(when=When(resource="power", becomes="OFF"), after=1.0, trigger={"power": "ON"}),
        )
    )
    stage.network.run_for(4.0)
    changes = [each for each in stage.records if each.subject == "power"]
    assert [each.after for each in changes] == ["OFF", "ON"]
    assert changes[1].cause == changes[0].id
    assert changes[1].t - changes[0].t == pytest.approx(1.0, abs=0.01)


def test_data_follow_a_goal() -> None:
    stage = Stage(
        script(
            Reaction(when=When(starts="reach"), set={"at": {"to": {"input": "target"}, "over": 1.0}}),
            Reaction(when=When(ends="reach", ending="THERE"), set={"note": "there"}),
            Reaction(when=When(ends="reach", ending=("STUCK", "RI")), set={"note": "failed"}),
        )
    )
    goal = stage.running()
    stage.network.run_for(0.55)
    assert stage.datum("at")["x"] == pytest.approx(1.5, abs=0.2)
    assert stage.end(goal) == "S_THERE"
    stage.network.run_for(0.5)
    assert stage.datum("at") == TARGET["target"]
    assert stage.datum("note") == "there"


ON_THE_WAY = (
    Reaction(when=When(starts="reach"), set={"at": {"to": {"input": "target"}, "over": 2.0}}),
    Reaction(when=When(starts="reach"), after=1.0, fire="cut"),
    Reaction(when=When(starts="reach"), after=1.0, set={"note": "late"}),
)


def test_an_interrupted_goal_stops_what_it_began() -> None:
    stage = Stage(script(*ON_THE_WAY, skills={"reach": (MockRun(delay=5.0),)}))
    goal = stage.running()
    stage.network.run_for(0.5)
    stage.client.interrupt(goal)
    assert stage.end(goal) == "IT"
    there = stage.datum("at")["x"]
    assert 0.0 < there < 1.5
    stage.network.run_for(5.0)
    assert stage.datum("at")["x"] == pytest.approx(there, abs=0.2)
    assert stage.datum("note") == ""
    assert stage.client.states["power"] == "ON"


def test_a_goal_that_ends_with_a_result_leaves_its_reactions_to_go_on() -> None:
    stage = Stage(script(*ON_THE_WAY, skills={"reach": (MockRun(delay=0.5),)}))
    assert stage.run() == "S_THERE"
    stage.network.run_for(5.0)
    assert stage.datum("at") == TARGET["target"]
    assert stage.datum("note") == "late"
    assert stage.client.states["power"] == "OFF"


def test_a_reaction_to_the_interrupt_goes_on_from_the_place_of_the_stop() -> None:
    back = Reaction(when=When(ends="reach", ending="IT"), set={"at": {"to": {"x": 0.0, "z": 0.0}, "over": 1.0}})
    stage = Stage(script(*ON_THE_WAY, back, skills={"reach": (MockRun(delay=5.0),)}))
    goal = stage.running()
    stage.network.run_for(0.8)
    stage.client.interrupt(goal)
    assert stage.end(goal) == "IT"
    stage.network.run_for(2.0)
    assert stage.datum("at") == {"x": 0.0, "z": 0.0}


def test_a_reaction_ends_a_goal() -> None:
    end = Reaction(when=When(resource="power", becomes="OFF"), end={"reach": "STUCK"})
    stage = Stage(script(end, Reaction(after=3.0, fire="cut"), skills={"reach": (MockRun(forever=True),)}))
    assert stage.end(stage.running()) == "S_STUCK"


@pytest.mark.parametrize(
    ("when", "follows"),
    [
        (None, (False, False)),
        (When(starts="reach"), (True, False)),
        (When(ends="reach"), (True, False)),
        (When(resource="power", becomes="OFF"), (False, True)),
    ],
)
def test_a_world_subscribes_only_to_what_its_script_reacts_to(when: When | None, follows: tuple[bool, bool]) -> None:
    said = MockScript(reactions=(Reaction(when=when, set={"load": 1.0}),))
    reactions = Reactions(fit_script(said, ARM))
    assert (reactions.follow_goals, reactions.follow_resources) == follows


def test_once_is_once() -> None:
    ups = Reaction(when=When(ends="wave"), set={"load": {"to": 7.0}}, once=True)
    downs = Reaction(when=When(starts="wave"), set={"load": 5.0})
    stage = Stage(script(ups, downs))
    stage.run("wave", {})
    assert stage.datum("load") == 7.0
    stage.run("wave", {})
    assert stage.datum("load") == 5.0


def test_what_the_model_forbids_is_logged_and_the_world_lives(caplog: pytest.LogCaptureFixture) -> None:
    stage = Stage(
        script(Reaction(trigger={"power": "ON"}), Reaction(after=1.0, fire="cut"), Reaction(after=2.0, fire="cut"))
    )
    stage.network.run_for(3.0)
    assert "could not fire cut" in caplog.text
    assert not stage.client.reading("load").stale


def test_a_script_that_does_not_fit_is_refused_where_it_is_given() -> None:
    with pytest.raises(ScriptError, match="did you mean `STUCK`"):
        make_mock_managers(ARM, MockScript(skills={"reach": (MockRun(result="STUKC"),)}))
    with pytest.raises(ScriptError, match="There is no skill `raech`"):
        MockWorld(ARM, MockScript(skills={"raech": ()}))


def test_a_repeated_status_counts_once() -> None:
    stage = Stage(script(Reaction(when=When(ends="wave"), fire="cut")))
    goal = stage.client.start("wave", {})
    stage.end(goal)
    assert stage.client.states["power"] == "OFF"
    stage.client.trigger("power", "ON", lambda answer: None)
    told = GoalStatus(goal_id=goal.goal_id, skill="wave", state=State.TERMINATED, t=0.0, terminal=goal.terminal)
    stage.bus.advertise(KEYS.status("wave"), events=True).put(encode(told))
    stage.network.run_for(1.0)
    assert stage.client.states["power"] == "ON"
