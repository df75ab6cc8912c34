"""Interface, managers and mocks on one in-process network: every ending, and what happens when a part is missing."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from skillwing.dsl import parse
from skillwing.dsl.model import UnknownNameError
from skillwing.services.bus import Answer, Answered, Refused
from skillwing.services.bus.inprocess import InProcessBus, InProcessNetwork
from skillwing.services.client.causal_feed import follow_records
from skillwing.services.client.interface import GoalHandle, SkillsetInterface
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.skill_core import SkillCore
from skillwing.services.core.skill_events import Event
from skillwing.services.errors import InvalidInputError, InvalidOptionError
from skillwing.services.managers.data_manager import make_data_manager
from skillwing.services.managers.hooks import Goal, SkillHooks
from skillwing.services.managers.liveliness_monitor import LOSS_DEBOUNCE
from skillwing.services.managers.skill_manager import SkillManagerNode, make_skill_manager
from skillwing.services.mocking import MockRun, MockScript, make_mock_managers
from skillwing.services.names import RESOURCE_MANAGER, skill_process
from skillwing.services.protocol import (
    MAX_MESSAGE_BYTES,
    AttachManager,
    DataSample,
    Ending,
    ErrorCode,
    GoalStatus,
    InterruptGoal,
    Keys,
    QueryData,
    Record,
    State,
    Terminal,
    encode,
)

SKILLSET_TEXT = """
skillset arm {
    data { load: float64 [kg] period=0.5 }
    resource power { initial ON  extern ON -> OFF  extern OFF -> ON }
    resource joints { initial FREE  FREE -> USED  USED -> FREE }
    resource hatch { initial SHUT  extern SHUT -> OPEN  extern OPEN -> SHUT }
    event cut { guard resource=(power == ON) effect { power -> OFF } }
    skill reach {
        progress=0.5 { left: float64 [m]  steps: int64 = 0  note: string = "" }
        input { distance: float64 [m] in 0.0..2.0 }
        output { reached: float64 [m]  steps: int64 = 0  note: string = "" }
        effect { take: joints -> USED  release: joints -> FREE }
        precondition { power: resource=(power == ON)  free: resource=(joints == FREE)  success take }
        invariant { power: resource=(power == ON) violation=release }
        interrupt { apply=release timeout=2.0 }
        result {
            success THERE: apply=release post resource=(hatch == SHUT)
            failure STUCK: apply=release
        }
    }
    skill weigh {
        effect { none {} }
        precondition { known: data=(load >= 0.0)  success none }
        invariant { light: data=(load < 5.0) violation=none }
        result { END: apply=none }
    }
}
"""
ARM = parse(SKILLSET_TEXT, "arm.skillset")
KEYS = Keys("arm")


class System:
    """All managers of the arm, and a client."""

    def __init__(self, *runs: MockRun, without: tuple[str, ...] = (), hooks: SkillHooks[Any, Any, Any] | None = None):
        self.network = InProcessNetwork()
        self.buses: dict[str, Any] = {}
        script = MockScript(
            skills={"reach": runs or (MockRun(result="THERE"),), "weigh": (MockRun(delay=60.0, result="END"),)}
        )
        nodes = make_mock_managers(ARM, script)
        if hooks is not None:
            nodes = [node for node in nodes if node.name != skill_process("reach")] + [SkillManagerNode(hooks, ARM)]
        self.nodes = {node.name: node for node in nodes}
        for name, node in self.nodes.items():
            if name not in without:
                self.buses[name] = self.network.attach(node)
        self.bus = self.network.bus("client")
        self.records: dict[str, Record] = {}
        self.terminals: list[tuple[str, Terminal]] = []
        follow_records(self.bus, KEYS, self._on_record, self._on_status)
        self.client = SkillsetInterface(self.bus, ARM, client="client")
        self.network.run_for(0.1)

    def _on_record(self, record: Record) -> None:
        assert record.id not in self.records
        self.records[record.id] = record

    def _on_status(self, status: GoalStatus) -> None:
        if status.terminal is not None:
            self.terminals.append((status.goal_id, status.terminal))

    def run(self, goal: GoalHandle, timeout: float = 60.0) -> Terminal:
        assert self.network.run_until(lambda: goal.done, timeout), f"{goal} has no answer"
        assert goal.terminal is not None
        self.network.run_for(1.0)
        assert [name for name, _ in self.terminals].count(goal.goal_id) <= 1
        return goal.terminal

    def until(self, goal: GoalHandle, state: State) -> None:
        assert self.network.run_until(lambda: goal.state is state, 60.0), f"{goal} never was {state}"

    def trigger(self, resource: str, target: str, cause: str | None = None) -> Answer:
        answers: list[Answer] = []
        self.client.trigger(resource, target, answers.append, cause)
        assert self.network.run_until(lambda: bool(answers), 5.0)
        self.network.run_for(0.01)
        return answers[0]

    def load(self, kilograms: Any, name: str = "load") -> None:
        sample = DataSample(name=name, value=kilograms, t=self.network.now())
        self.bus.advertise(KEYS.data("load")).put(encode(sample))
        self.network.run_for(0.01)

    def kill(self, process: str) -> None:
        self.buses[process].close()

    def replace(self, process: str) -> None:
        """Have another process of that name make itself known; it does not stay."""
        answers: list[Answer] = []
        rival = encode(AttachManager(manager=process, incarnation="one that comes and goes"))
        self.bus.ask(KEYS.resource_attach, rival, answers.append)
        assert self.network.run_until(lambda: bool(answers), 5.0)

    def restart(self, process: str) -> None:
        [node] = [node for node in make_mock_managers(ARM) if node.name == process]
        self.buses[process] = self.network.attach(node)

    def chain(self, record_id: str | None) -> list[str]:
        steps: list[str] = []
        while record_id is not None:
            record = self.records.get(record_id)
            steps.append(f"{record.subject} {record.after}" if record else record_id)
            record_id = record.cause if record else None
        return steps[::-1]


REACH = {"distance": 1.0}
UNTOLD = {"steps": 0, "note": ""}


def test_success() -> None:
    system = System(MockRun(delay=3.0, result="THERE", output={"reached": 1.0}, progress={"left": 0.5}))
    assert system.client.ready
    goal = system.client.start("reach", REACH)
    assert goal.state is None
    system.until(goal, State.RUNNING)
    system.network.run_for(1.0)
    assert goal.progress == {"left": 0.5, **UNTOLD}
    assert system.client.state("joints") == "USED"
    terminal = system.run(goal)
    assert (terminal.label, terminal.success, terminal.output) == ("S_THERE", True, {"reached": 1.0, **UNTOLD})
    assert system.client.states["joints"] == "FREE"


def test_feedback_reaches_only_the_clients_of_its_skill(monkeypatch: pytest.MonkeyPatch) -> None:
    keys: list[tuple[str, str]] = []
    subscribe = InProcessBus.subscribe

    def record(bus: InProcessBus, key: str, *arguments: Any, **options: Any) -> Any:
        keys.append((bus.name, key))
        return subscribe(bus, key, *arguments, **options)

    monkeypatch.setattr(InProcessBus, "subscribe", record)
    system = System(*[MockRun(delay=3.0, result="THERE", output={"reached": 1.0}, progress={"left": 0.5})] * 2)
    follower = SkillsetInterface(system.network.bus("follower"), ARM, client="follower")
    system.load(1.0)
    system.run(system.client.start("weigh"))
    assert not [key for _, key in keys if key.endswith("/progress")]
    for _ in range(2):
        goal = system.client.start("reach", REACH)
        system.until(goal, State.RUNNING)
        followed = follower.follow("reach", goal.goal_id)
        system.network.run_for(0.6)
        assert goal.progress == followed.progress == {"left": 0.5, **UNTOLD}
        system.run(goal)
    heard = [(bus, key) for bus, key in keys if key.endswith("/progress")]
    assert heard == [(system.bus.name, KEYS.progress("reach")), ("follower", KEYS.progress("reach"))]


ENDINGS: list[tuple[str, MockRun, dict[str, Any], Callable[[System], Any] | None, str]] = [
    ("out of range", MockRun(), {"distance": 9.0}, None, "NV"),
    ("the developer says no", MockRun(invalid="The cable is too short."), REACH, None, "NV"),
    ("no power", MockRun(), REACH, lambda system: system.trigger("power", "OFF"), "NR"),
    ("a result that is a failure", MockRun(result="STUCK"), REACH, None, "S_STUCK"),
    ("a postcondition", MockRun(result="THERE"), REACH, lambda system: system.trigger("hatch", "OPEN"), "N_THERE"),
    ("a failing hook", MockRun(error="A gear broke."), REACH, None, "ERROR"),
]


@pytest.mark.parametrize(("name", "run", "inputs", "before", "label"), ENDINGS, ids=[case[0] for case in ENDINGS])
def test_endings(
    name: str, run: MockRun, inputs: dict[str, Any], before: Callable[[System], Any] | None, label: str
) -> None:
    del name
    system = System(run)
    if before is not None:
        before(system)
    terminal = system.run(system.client.start("reach", inputs))
    assert terminal.label == label
    assert terminal.reason
    assert not terminal.success
    assert system.client.states["joints"] == "FREE"


def test_a_violated_invariant_reads_as_one_chain() -> None:
    system = System(MockRun(delay=30.0, result="THERE"))
    goal = system.client.start("reach", REACH, cause="mission#1")
    system.until(goal, State.RUNNING)
    system.trigger("power", "OFF", cause="fuse#1")
    terminal = system.run(goal)
    assert (terminal.ending, terminal.invariant, terminal.subject) == (Ending.INVARIANT_VIOLATED, "power", "power")
    assert system.chain(goal.record) == ["fuse#1", "power OFF", "reach.power VIOLATED", "reach RI"]
    assert system.client.change_record("power") is not None
    assert system.client.states["joints"] == "FREE"


def test_mistake_busy_leaves_the_running_goal_alone() -> None:
    system = System(MockRun(delay=3.0, result="THERE"))
    first = system.client.start("reach", REACH)
    system.until(first, State.RUNNING)
    second = system.client.start("reach", REACH)
    terminal = system.run(second)
    assert (terminal.ending, terminal.running_goal) == (Ending.BUSY, first.goal_id)
    assert system.run(first).label == "S_THERE"


@pytest.mark.parametrize("wait", [0.0, 0.0003, 0.0005, 0.0007, 1.0])
def test_an_interrupt_at_any_time_ends_the_goal_once(wait: float) -> None:
    system = System(MockRun(delay=30.0, result="THERE", stop_delay=0.5))
    goal = system.client.start("reach", REACH)
    system.network.run_for(wait)
    for _ in range(3):
        system.client.interrupt(goal)
    terminal = system.run(goal, 5.0)
    assert terminal.ending is Ending.INTERRUPTED
    assert not terminal.forced
    assert system.client.states["joints"] == "FREE"
    system.client.interrupt(goal)


def test_resources_are_kept_until_the_skill_has_stopped() -> None:
    system = System(MockRun(delay=30.0, result="THERE", stop_delay=1.0))
    goal = system.client.start("reach", REACH)
    system.until(goal, State.RUNNING)
    system.client.interrupt(goal)
    system.until(goal, State.INTERRUPTING)
    system.network.run_for(0.9)
    assert system.client.states["joints"] == "USED"
    assert not system.run(goal).forced


def test_an_interrupt_that_nobody_confirms_is_forced() -> None:
    system = System(MockRun(delay=30.0, result="THERE", stop_delay="never"))
    goal = system.client.start("reach", REACH)
    system.until(goal, State.RUNNING)
    asked_at = system.network.now()
    system.client.interrupt(goal)
    terminal = system.run(goal)
    assert terminal.forced
    assert system.network.now() - asked_at == pytest.approx(3.0, abs=0.1)
    assert system.client.states["joints"] == "FREE"


def test_the_same_goal_id_runs_once() -> None:
    system = System(MockRun(delay=1.0, result="THERE"))
    goals = [system.client.start("reach", REACH, goal_id="same") for _ in range(3)]
    assert system.run(goals[0]).label == "S_THERE"
    again = system.client.start("reach", REACH, goal_id="same")
    assert system.run(again).label == "S_THERE"
    assert [terminal.label for _, terminal in system.terminals] == ["S_THERE"]


# --- parts that are missing or die -----------------------------------------------------------------------------------


def test_mistake_no_manager_and_no_answer_ever() -> None:
    system = System(without=(skill_process("reach"),))
    terminal = system.run(system.client.start("reach", REACH), 10.0)
    assert (terminal.ending, terminal.detected_by) == (Ending.LOST, "client")


def test_no_resource_manager_ends_in_an_error_that_says_so() -> None:
    system = System(without=(RESOURCE_MANAGER,))
    assert not system.client.ready
    assert system.client.states == {}
    terminal = system.run(system.client.start("reach", REACH), 30.0)
    assert terminal.ending is Ending.ERROR
    assert "resource manager does not answer" in terminal.reason
    system.restart(RESOURCE_MANAGER)
    system.network.run_for(5.0)
    assert system.client.ready
    assert system.client.states["joints"] == "FREE"
    assert system.run(system.client.start("reach", REACH)).label == "S_THERE"


def test_a_resource_manager_that_comes_a_little_later_is_waited_for() -> None:
    system = System(without=(RESOURCE_MANAGER,))
    goal = system.client.start("reach", REACH)
    system.network.run_for(0.5)
    system.restart(RESOURCE_MANAGER)
    assert system.run(goal).label == "S_THERE"


def test_mistake_the_server_dies_and_no_callback_ever_comes() -> None:
    system = System(MockRun(delay=30.0, result="THERE"))
    goal = system.client.start("reach", REACH)
    system.until(goal, State.RUNNING)
    system.kill(skill_process("reach"))
    terminal = system.run(goal, 5.0)
    assert (terminal.ending, terminal.detected_by) == (Ending.LOST, "client")
    system.network.run_for(LOSS_DEBOUNCE)
    assert system.client.states["joints"] == "FREE"
    system.restart(skill_process("reach"))
    system.network.run_for(0.1)
    assert system.run(system.client.start("reach", REACH)).label == "S_THERE"


def test_a_manager_replaced_at_once_does_not_leave_its_goal_in_limbo() -> None:
    system = System(MockRun(delay=30.0, result="THERE"))
    goal = system.client.start("reach", REACH)
    system.until(goal, State.RUNNING)
    system.kill(skill_process("reach"))
    system.network.run_for(LOSS_DEBOUNCE + 0.1)
    system.restart(skill_process("reach"))
    assert system.run(goal, 5.0).ending is Ending.LOST


@pytest.mark.parametrize("away", [0.0, LOSS_DEBOUNCE / 2])
def test_a_manager_that_is_back_before_its_token_counts_as_gone_frees_what_its_predecessor_held(away: float) -> None:
    system = System(MockRun(delay=30.0, result="THERE"))
    goal = system.client.start("reach", REACH)
    system.until(goal, State.RUNNING)
    system.kill(skill_process("reach"))
    system.network.run_for(away)
    system.restart(skill_process("reach"))
    assert system.run(goal, 5.0).ending is Ending.LOST
    assert system.client.states["joints"] == "FREE"
    assert system.run(system.client.start("reach", REACH)).label == "S_THERE"


def test_a_manager_that_outlived_its_successor_ends_at_the_next_goal_and_can_be_restarted() -> None:
    system = System(MockRun(delay=30.0, result="THERE"))
    system.replace(skill_process("reach"))
    assert not system.buses[skill_process("reach")].closed
    terminal = system.run(system.client.start("reach", REACH))
    assert (terminal.ending, terminal.detected_by) == (Ending.LOST, "client")
    assert system.terminals == [], "its successor might run that goal"
    assert system.buses[skill_process("reach")].closed
    assert system.client.states["joints"] == "FREE"
    system.restart(skill_process("reach"))
    system.network.run_for(0.1)
    assert system.run(system.client.start("reach", REACH)).label == "S_THERE"


def test_a_manager_that_loses_its_goal_to_a_successor_ends() -> None:
    system = System(MockRun(delay=30.0, result="THERE"))
    goal = system.client.start("reach", REACH)
    system.until(goal, State.RUNNING)
    system.replace(skill_process("reach"))
    assert system.run(goal, 5.0).ending is Ending.LOST
    assert system.buses[skill_process("reach")].closed


def test_a_manager_that_was_cut_off_and_not_replaced_lives_on() -> None:
    system = System(MockRun(delay=30.0, result="THERE"), MockRun(result="THERE"))
    bus, manager = system.buses[skill_process("reach")], system.nodes[skill_process("reach")]
    assert isinstance(manager, SkillManagerNode)
    goal = system.client.start("reach", REACH)
    system.until(goal, State.RUNNING)
    manager._alive.cancel()
    assert system.run(goal, 5.0).ending is Ending.LOST
    bus.declare_alive(KEYS.alive(manager.name))
    assert system.run(system.client.start("reach", REACH)).label == "S_THERE"


def test_a_network_that_heals_in_time_takes_nothing_from_a_manager() -> None:
    system = System(MockRun(delay=5.0, result="THERE"))
    goal = system.client.start("reach", REACH)
    system.until(goal, State.RUNNING)
    manager = system.nodes[skill_process("reach")]
    assert isinstance(manager, SkillManagerNode)
    manager._alive.cancel()
    system.network.run_for(LOSS_DEBOUNCE / 2)
    system.buses[manager.name].declare_alive(KEYS.alive(manager.name))
    assert system.run(goal).label == "S_THERE"


def test_a_manager_in_good_order_frees_its_goal() -> None:
    system = System(MockRun(delay=30.0, result="THERE"))
    goal = system.client.start("reach", REACH)
    system.until(goal, State.RUNNING)
    system.nodes[skill_process("reach")].detach()
    system.kill(skill_process("reach"))
    assert system.run(goal, 5.0).ending is Ending.LOST
    assert system.client.states["joints"] == "FREE"


# --- hooks that misbehave --------------------------------------------------------------------------------------------


class Boastful(SkillHooks[dict[str, Any], None, dict[str, Any]]):
    """Feeds back more steps than a message can hold."""

    skill = "reach"

    def __init__(self, steps: int) -> None:
        self.steps = steps

    def progress(self, goal: Goal[dict[str, Any]]) -> dict[str, Any]:
        return {"left": 0.5, "steps": self.steps}


class Clumsy(SkillHooks[dict[str, Any], None, dict[str, Any]]):
    """Raises where it is told to, and reports its end from within `on_dispatch` otherwise."""

    skill = "reach"

    def __init__(self, where: str) -> None:
        self.where = where
        self.ended: list[str] = []

    def _stumble(self, here: str) -> None:
        if self.where == here:
            raise ValueError(f"stumbled in {here}")

    def setup(self) -> None:
        self.bus.subscribe("fl/ping", lambda sample: self._stumble("callback"))

    def validate(self, goal: Goal[dict[str, Any]]) -> str | None:
        self._stumble("validate")
        return None

    def on_dispatch(self, goal: Goal[dict[str, Any]]) -> None:
        self._stumble("on_dispatch")
        if self.where == "nowhere":
            self.terminated(goal.id, "THERE")

    def progress(self, goal: Goal[dict[str, Any]]) -> dict[str, Any] | None:
        self._stumble("progress")
        return None

    def on_interrupt(self, goal: Goal[dict[str, Any]]) -> None:
        self._stumble("on_interrupt")

    def on_ended(self, goal: Goal[dict[str, Any]], terminal: Terminal) -> None:
        self.ended.append(terminal.label)
        assert self.current is None
        self._stumble("on_ended")


@pytest.mark.parametrize("where", ["validate", "on_dispatch", "progress", "on_interrupt", "callback"])
def test_whatever_a_hook_raises_ends_the_goal_and_the_process_lives(where: str) -> None:
    hooks = Clumsy(where)
    system = System(hooks=hooks)
    for _ in range(2):
        goal = system.client.start("reach", REACH)
        system.network.run_for(0.1)
        if where == "on_interrupt":
            system.client.interrupt(goal)
        system.bus.advertise("fl/ping").put(b"")
        terminal = system.run(goal)
        assert terminal.ending is Ending.ERROR
        assert "stumbled" in terminal.reason
        assert system.client.states["joints"] == "FREE"
    assert hooks.ended == ([] if where == "validate" else ["ERROR", "ERROR"])


@pytest.mark.parametrize("where", ["nowhere", "on_ended"])
def test_an_end_from_within_a_hook_or_an_exception_after_the_end_is_fine(where: str) -> None:
    hooks = Clumsy(where)
    system = System(hooks=hooks)
    goal = system.client.start("reach", REACH)
    system.network.run_for(0.1)
    if where == "on_ended":
        hooks.terminated(goal.goal_id, "THERE")
    assert system.run(goal).label == "S_THERE"
    assert hooks.ended == ["S_THERE"]


UNSENDABLE = [
    ("steps", 2**70, "has to lie between"),
    ("steps", 10**5000, "beyond all bounds"),
    ("reached", float("nan"), "a finite number"),
    ("note", "\ud800", "cannot be sent"),
    ("note", "x" * MAX_MESSAGE_BYTES, "cannot be sent"),
    ("note", object(), "unsupported"),
]


@pytest.mark.parametrize(("name", "value", "sentence"), UNSENDABLE, ids=range(len(UNSENDABLE)))
def test_an_output_that_cannot_be_sent_ends_the_goal_and_the_process_lives(
    name: str, value: object, sentence: str
) -> None:
    hooks = Clumsy("elsewhere")
    system = System(hooks=hooks)
    goal = system.client.start("reach", REACH)
    system.until(goal, State.RUNNING)
    output = {"reached": 1.0, "steps": 1, "note": "", name: value}
    hooks.bus.post(lambda: hooks.terminated(goal.goal_id, "THERE", output))
    terminal = system.run(goal)
    assert terminal.ending is Ending.ERROR
    assert sentence in terminal.reason
    assert system.client.states["joints"] == "FREE"


@pytest.mark.parametrize("value", [2**70, 10**5000], ids=["large", "beyond words"])
def test_a_feedback_that_cannot_be_sent_is_dropped(value: int, caplog: pytest.LogCaptureFixture) -> None:
    system = System(hooks=Boastful(value))
    goal = system.client.start("reach", REACH)
    system.until(goal, State.RUNNING)
    system.network.run_for(2.0)
    assert goal.progress is None
    assert "dropped a feedback" in caplog.text


@pytest.mark.parametrize("text", ["\ud800", "x" * MAX_MESSAGE_BYTES], ids=["no encoding", "too long"])
def test_a_reason_that_cannot_be_sent_is_made_sendable(text: str) -> None:
    hooks = Clumsy("elsewhere")
    system = System(hooks=hooks)
    goal = system.client.start("reach", REACH)
    system.until(goal, State.RUNNING)
    hooks.bus.post(lambda: hooks.failed(goal.goal_id, text))
    assert system.run(goal).ending is Ending.ERROR


# --- data ------------------------------------------------------------------------------------------------------------


def test_data_are_judged_where_goals_are_granted() -> None:
    system = System()
    assert system.run(system.client.start("weigh")).failing == ("known",)
    system.load(1.0)
    goal = system.client.start("weigh")
    system.until(goal, State.RUNNING)
    assert not system.client.reading("load").stale
    terminal = system.run(goal, 5.0)
    assert (terminal.ending, terminal.subject) == (Ending.INVARIANT_VIOLATED, "load")
    assert system.client.reading("load").stale
    assert system.client.reading("load").value == 1.0


def test_the_data_manager_tells_late_comers_and_the_timeline() -> None:
    system = System()
    system.load(2.0)
    late = SkillsetInterface(system.network.bus("late"), ARM, client="late")
    system.network.run_for(0.1)
    assert late.reading("load").value == 2.0
    system.network.run_for(2.0)
    assert late.reading("load").stale
    fresh = [record.after for record in system.records.values() if record.subject == "load"]
    assert fresh == ["FRESH", "STALE"]


@pytest.mark.parametrize("value", ["heavy", None, [1.0]])
def test_malformed_data_are_dropped(value: Any) -> None:
    system = System()
    system.load(2.0)
    system.load(value)
    system.load(3.0, name="other")
    assert system.client.reading("load").value == 2.0


# --- bad requests ----------------------------------------------------------------------------------------------------


def ask(system: System, key: str, payload: bytes) -> Answer:
    answers: list[Answer] = []
    system.bus.ask(key, payload, answers.append)
    assert system.network.run_until(lambda: bool(answers), 5.0)
    return answers[0]


@pytest.mark.parametrize(
    "key",
    [
        KEYS.start("reach"),
        KEYS.interrupt("reach"),
        KEYS.goal("reach"),
        KEYS.resource_extern,
        KEYS.resource_goal,
        KEYS.resource_states,
        KEYS.event("cut"),
        KEYS.data("load"),
    ],
)
@pytest.mark.parametrize("payload", [b"", b"\xc1", b"hello", encode(DataSample(name="x", value=1, t=0.0))])
def test_a_malformed_payload_is_refused_and_the_process_lives(key: str, payload: bytes) -> None:
    system = System()
    answer = ask(system, key, payload)
    assert isinstance(answer, Refused)
    assert answer.error.code is ErrorCode.BAD_REQUEST
    assert answer.error.help
    assert system.run(system.client.start("reach", REACH)).label == "S_THERE"


def test_names_that_do_not_exist() -> None:
    system = System()
    client = system.client
    for call in (
        lambda: client.start("raech"),
        lambda: client.start("reach", {"distanse": 1.0}),
        lambda: client.state("joint"),
        lambda: client.reading("lood"),
        lambda: client.trigger("power", "ONN", lambda answer: None),
        lambda: client.fire("cutt", lambda answer: None),
    ):
        with pytest.raises(UnknownNameError, match="did you mean"):
            call()
    for inputs in ({}, {"distance": "far"}, {"distance": float("nan")}, {"distance": True}):
        with pytest.raises(InvalidInputError, match="distance"):
            client.start("reach", inputs)
    answer = ask(system, KEYS.data("lood"), encode(QueryData()))
    assert isinstance(answer, Refused)
    assert answer.error.known == ("load",)


def test_events_and_extern_transitions_answer_with_the_states() -> None:
    system = System()
    answers: list[Answer] = []
    system.client.fire("cut", answers.append)
    system.client.fire("cut", answers.append)
    system.network.run_for(0.1)
    assert [type(answer) for answer in answers] == [Answered, Refused]
    assert system.client.states["power"] == "OFF"
    refused = system.trigger("joints", "USED")
    assert isinstance(refused, Refused)
    assert refused.error.code is ErrorCode.NOT_ALLOWED


def test_two_versions_of_a_skillset_refuse_each_other() -> None:
    system = System()
    other = parse(SKILLSET_TEXT.replace("0.0..2.0", "0.0..9.0"), "arm.skillset")
    client = SkillsetInterface(system.network.bus("stranger"), other, client="stranger")
    terminal = system.run(client.start("reach", REACH))
    assert terminal.ending is Ending.ERROR
    assert ARM.schema_hash in terminal.reason
    assert other.schema_hash in terminal.reason


def test_a_tree_is_woken_by_changes_until_it_no_longer_listens() -> None:
    system = System()
    calls: list[float] = []
    listening = system.client.on_change(lambda: calls.append(system.network.now()))
    system.trigger("power", "OFF")
    assert len(calls) == 1
    listening.cancel()
    listening.cancel()
    system.trigger("power", "ON")
    assert len(calls) == 1


def test_following_a_goal_that_nobody_knows_ends() -> None:
    system = System()
    terminal = system.run(system.client.follow("reach", "nobody's"), 5.0)
    assert terminal.ending is Ending.ERROR
    assert "knows of no goal nobody's" in terminal.reason


def test_a_refused_interrupt_is_asked_again(monkeypatch: pytest.MonkeyPatch) -> None:
    system = System(MockRun(delay=30.0, result="THERE"))
    goal = system.client.start("reach", REACH)
    system.until(goal, State.RUNNING)
    step, refusals = SkillCore.step, [RefusedError(ErrorCode.UNAVAILABLE, "Not now.")]

    def refuse_once(core: SkillCore, event: Event, now: float) -> Any:
        if refusals and isinstance(event, InterruptGoal):
            raise refusals.pop()
        return step(core, event, now)

    monkeypatch.setattr(SkillCore, "step", refuse_once)
    system.client.interrupt(goal)
    assert system.run(goal, 10.0).ending is Ending.INTERRUPTED
    assert refusals == []


def test_a_goal_of_somebody_else_can_be_followed() -> None:
    system = System(MockRun(delay=2.0, result="THERE"))
    goal = system.client.start("reach", REACH)
    system.until(goal, State.RUNNING)
    watcher = SkillsetInterface(system.network.bus("watcher"), ARM, client="watcher")
    seen = watcher.follow("reach", goal.goal_id)
    assert system.run(seen).label == "S_THERE"


# --- factories -------------------------------------------------------------------------------------------------------


def test_factories_say_what_is_wrong_with_their_options(tmp_path: Path) -> None:
    file = tmp_path / "arm.skillset"
    file.write_text(SKILLSET_TEXT)
    good = {"skillset": str(file), "hooks": f"{__name__}:Steady"}
    assert make_skill_manager(good).name == "skill/reach"
    assert make_data_manager(good).name == "data_manager"
    for options, message in (
        ({"skillset": str(file)}, "`hooks` is missing"),
        ({"hooks": f"{__name__}:Steady"}, "`skillset` is missing"),
        ({**good, "hooks": "no.such:Thing"}, "there is no module `no`"),
        ({**good, "hooks": f"{__name__}:Nothing"}, "has no `Nothing`"),
        ({**good, "hooks": f"{__name__}:System"}, "no skill manager"),
    ):
        with pytest.raises(InvalidOptionError, match=message):
            make_skill_manager(options)


class Steady(SkillHooks[dict[str, Any], None, None]):
    skill = "reach"
