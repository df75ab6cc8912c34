"""One goal's correspondence with a manager that answers as it is told, or not at all."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

import pytest

from skillwing.services.bus import Answer, Answered, NoReply, Request
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.bus.reading import message_reader
from skillwing.services.client.goal_handle import GoalHandle
from skillwing.services.client.goal_tracker import VERDICT_PATIENCE, GoalTracker
from skillwing.services.client.retry import LONGEST_DELAY
from skillwing.services.protocol import (
    Ending,
    ErrorCode,
    ErrorReply,
    GoalStatus,
    InterruptGoal,
    Keys,
    Lost,
    ModifyGoal,
    QueryGoal,
    Record,
    StartGoal,
    State,
    Terminal,
    Violated,
    decode,
    encode,
)
from skillwing.services.timeline import Timeline

KEYS = Keys("rover")
UNKNOWN = ErrorReply(code=ErrorCode.UNKNOWN_GOAL, message="`drive` knows of no goal g.", help="Start one.")
SUCCESS = Terminal(ending=Ending.SUCCEEDED, reason="It arrived.", result="THERE", success=True)
LOST = Lost(goal_id="g", skill="drive", reason="It was silent.", t=0.0, step=3, record="rm#9", token=7)
VIOLATED = Violated(
    goal_id="g",
    skill="drive",
    invariant="on",
    subject="power",
    reason="power is OFF.",
    t=0.0,
    step=2,
    record="rm#8",
    token=7,
)


def status(state: State, terminal: Terminal | None = None, goal_id: str = "g") -> GoalStatus:
    return GoalStatus(goal_id=goal_id, skill="drive", state=state, t=0.0, terminal=terminal, record=f"m#{state}")


RUNNING, INTERRUPTING = status(State.RUNNING), status(State.INTERRUPTING)
ENDED = status(State.TERMINATED, SUCCESS)


class Manager:
    """Takes down what it is asked, and gives the answers to each kind of question in turn; then it stays silent."""

    def __init__(self, network: InProcessNetwork) -> None:
        bus = network.bus("skill/drive")
        self.starts: list[StartGoal] = []
        self.interrupts: list[InterruptGoal] = []
        self.questions: list[QueryGoal] = []
        self.to_start: deque[GoalStatus | ErrorReply | bytes | None] = deque()
        self.to_interrupt: deque[GoalStatus | ErrorReply | bytes | None] = deque()
        self.to_question: deque[GoalStatus | ErrorReply | bytes | None] = deque()
        self.modifications: list[ModifyGoal] = []
        self.to_modify: deque[GoalStatus | ErrorReply | bytes | None] = deque()
        bus.serve(
            KEYS.modify("drive"),
            lambda request: self._take(request, ModifyGoal, self.modifications, self.to_modify),
        )
        bus.serve(KEYS.start("drive"), lambda request: self._take(request, StartGoal, self.starts, self.to_start))
        bus.serve(
            KEYS.interrupt("drive"),
            lambda request: self._take(request, InterruptGoal, self.interrupts, self.to_interrupt),
        )
        bus.serve(KEYS.goal("drive"), lambda request: self._take(request, QueryGoal, self.questions, self.to_question))

    def _take(
        self,
        request: Request,
        kind: type[StartGoal | InterruptGoal | ModifyGoal | QueryGoal],
        taken: list[StartGoal] | list[InterruptGoal] | list[ModifyGoal] | list[QueryGoal],
        answers: deque[GoalStatus | ErrorReply | bytes | None],
    ) -> None:
        taken.append(decode(request.payload, kind))  # pyright: ignore[reportArgumentType] - of the list's kind
        match answers.popleft() if answers else None:
            case ErrorReply() as refusal:
                request.refuse(refusal)
            case bytes() as payload:
                request.reply(payload)
            case GoalStatus() as told:
                request.reply(encode(told))
            case None:
                pass


class Desk:
    """A client that tracks one goal. there: whether there is a manager at all; alive: whether its token is seen."""

    def __init__(self, *, there: bool = True, alive: bool = True) -> None:
        self.network = InProcessNetwork()
        self.manager = Manager(self.network) if there else None
        self.alive = alive
        self.handle = GoalHandle("g", "drive")
        self.changes: list[str] = []
        self.steps = True
        """The states after a step become known at once; never, if not."""
        self.awaited: list[tuple[int, Callable[[str], None]]] = []
        """Steps whose states are waited for, and what is to be called then."""
        self.releases = True
        """The release of a lost goal becomes known at once; never, if not."""
        self.released: list[tuple[str, str]] = []
        """Goals whose release was asked for."""
        self.records: list[Record] = []
        self.network.bus("listener").subscribe(KEYS.timeline, message_reader(Record, self.records.append), events=True)
        bus = self.network.bus("mission")
        self.tracker = GoalTracker(
            bus,
            KEYS,
            Timeline(bus, KEYS),
            self.handle,
            client="mission",
            manager_alive=lambda: self.alive,
            take_reply=self._take_reply,
            after_step=self._after_step,
            after_release=self._after_release,
            on_change=lambda handle: self.changes.append(
                handle.terminal.label if handle.terminal else handle.state or ""
            ),
        )

    def _take_reply(self, status: GoalStatus) -> None:
        self.tracker.advance(status)

    def _after_step(self, step: int, then: Callable[[str], None]) -> None:
        self.awaited.append((step, then))
        if self.steps:
            then("")

    def _after_release(self, skill: str, goal_id: str, then: Callable[[str], None]) -> None:
        self.released.append((skill, goal_id))
        if self.releases:
            then("")

    def start(self) -> None:
        self.tracker.start(
            StartGoal(goal_id="g", inputs={"speed": 1.0}, client="mission", schema="s", owner="client/x")
        )

    @property
    def asked(self) -> Manager:
        assert self.manager is not None
        return self.manager

    @property
    def terminal(self) -> Terminal:
        assert self.handle.terminal is not None
        return self.handle.terminal

    def wait(self, seconds: float = 60.0) -> None:
        self.network.run_for(seconds)

    def ended_after(self) -> float:
        """Seconds from now until the goal is over."""
        begun = self.network.now()
        assert self.network.run_until(lambda: self.handle.done, 60.0)
        return self.network.now() - begun


def test_a_start_is_repeated_word_for_word_until_it_is_answered() -> None:
    desk = Desk()
    desk.asked.to_start.extend([None, None, RUNNING])
    desk.start()
    desk.wait()
    assert len(desk.asked.starts) == 3
    assert desk.asked.starts[0] == desk.asked.starts[1] == desk.asked.starts[2]
    assert desk.asked.starts[0].owner == "client/x"
    assert (desk.handle.state, desk.changes) == (State.RUNNING, ["RUNNING"])


@pytest.mark.parametrize(
    ("alive", "questions", "words"), [(True, 10, "is connected and does not answer"), (False, 6, "is gone")]
)
def test_a_manager_that_stays_silent_is_given_up(alive: bool, questions: int, words: str) -> None:
    desk = Desk(alive=alive)
    desk.start()
    desk.wait()
    assert len(desk.asked.starts) == questions
    assert (desk.terminal.ending, desk.terminal.detected_by) == (Ending.LOST, "client")
    assert f"The manager of `drive` {words}" in desk.terminal.reason
    assert desk.changes == ["LOST"]
    [record] = desk.records
    assert (record.subject, record.before, record.after, record.goal_id) == ("drive", "SENT", "LOST", "g")
    assert record.text == desk.terminal.reason
    assert desk.handle.record == record.id


@pytest.mark.parametrize(("alive", "seconds"), [(True, 5.55), (False, 1.55)])
def test_nobody_there_is_known_soon(alive: bool, seconds: float) -> None:
    desk = Desk(there=False, alive=alive)
    desk.start()
    assert desk.ended_after() == pytest.approx(seconds, abs=0.05)


def test_a_manager_whose_token_comes_back_gets_the_patience_of_the_living() -> None:
    desk = Desk(alive=False)
    desk.start()
    desk.network.run_until(lambda: len(desk.asked.starts) == 5, 60.0)
    desk.alive = True
    desk.wait()
    assert len(desk.asked.starts) == 10


def test_a_refusal_to_start_is_an_error_with_its_sentence() -> None:
    desk = Desk()
    desk.asked.to_start.append(ErrorReply(code=ErrorCode.TOO_LATE, message="It came too late.", help="Start again."))
    desk.start()
    desk.wait()
    assert (desk.terminal.ending, desk.terminal.detected_by) == (Ending.ERROR, "client")
    assert desk.terminal.reason == "The manager refused to start: It came too late. Start again."
    assert not desk.asked.questions


@pytest.mark.parametrize(("answer", "label"), [(ENDED, "S_THERE"), (UNKNOWN, "ERROR")])
def test_who_failed_at_the_start_is_asked_what_became_of_it(answer: GoalStatus | ErrorReply, label: str) -> None:
    desk = Desk()
    desk.asked.to_start.append(ErrorReply(code=ErrorCode.INTERNAL, message="It failed.", help=""))
    desk.asked.to_question.append(answer)
    desk.start()
    desk.wait()
    assert [each.goal_id for each in desk.asked.questions] == ["g"]
    assert desk.terminal.label == label
    assert desk.terminal.reason == (SUCCESS.reason if answer is ENDED else "The manager refused to start: It failed.")


def test_interrupting_twice_asks_once() -> None:
    desk = Desk()
    desk.asked.to_interrupt.append(INTERRUPTING)
    desk.tracker.interrupt(cause="tree#3")
    desk.tracker.interrupt(cause="tree#4")
    desk.wait()
    [request] = desk.asked.interrupts
    assert (request.goal_id, request.client, request.cause) == ("g", "mission", "tree#3")


def test_nothing_is_asked_for_what_is_over() -> None:
    desk = Desk()
    desk.tracker.advance(ENDED)
    desk.tracker.interrupt()
    desk.tracker.probe()
    desk.wait()
    assert not desk.asked.interrupts
    assert not desk.asked.questions


def test_an_interrupt_is_repeated_until_somebody_hears_it_and_lost_with_a_manager_that_is_gone() -> None:
    desk = Desk()
    desk.asked.to_interrupt.extend([None, INTERRUPTING])
    desk.tracker.interrupt()
    desk.wait()
    assert (len(desk.asked.interrupts), desk.handle.state) == (2, State.INTERRUPTING)
    desk = Desk(alive=False)
    desk.tracker.interrupt()
    desk.wait()
    assert (len(desk.asked.interrupts), desk.terminal.ending) == (6, Ending.LOST)


def test_an_interrupt_that_was_not_carried_out_is_asked_for_again_with_its_cause() -> None:
    desk = Desk()
    desk.asked.to_interrupt.extend([ErrorReply(code=ErrorCode.INTERNAL, message="It failed.", help=""), INTERRUPTING])
    desk.tracker.interrupt(cause="tree#3")
    desk.wait(LONGEST_DELAY / 2)
    assert len(desk.asked.interrupts) == 1
    desk.wait()
    assert [each.cause for each in desk.asked.interrupts] == ["tree#3", "tree#3"]
    assert desk.handle.state is State.INTERRUPTING


def test_an_interrupt_is_sent_again_while_the_goal_still_runs() -> None:
    desk = Desk()
    desk.asked.to_interrupt.extend([UNKNOWN, INTERRUPTING])
    desk.tracker.interrupt(cause="tree#3")
    desk.wait()
    assert (len(desk.asked.interrupts), desk.handle.done) == (1, False)
    desk.tracker.advance(RUNNING)
    desk.wait()
    assert [each.cause for each in desk.asked.interrupts] == ["tree#3", "tree#3"]
    desk.tracker.advance(INTERRUPTING)
    desk.wait()
    assert len(desk.asked.interrupts) == 2


def test_a_goal_that_its_manager_has_forgotten_is_lost() -> None:
    desk = Desk()
    desk.asked.to_question.append(UNKNOWN)
    desk.tracker.advance(RUNNING)
    desk.tracker.probe()
    desk.wait()
    assert (desk.terminal.ending, desk.terminal.detected_by) == (Ending.LOST, "client")
    assert desk.terminal.reason == "The manager of `drive` was replaced and no longer knows the goal."
    [record] = desk.records
    assert (record.before, record.cause) == ("RUNNING", None), "the goal's start lost nothing"


def test_a_goal_that_nobody_knows_yet_may_still_arrive() -> None:
    desk = Desk()
    desk.asked.to_question.append(UNKNOWN)
    desk.tracker.probe()
    desk.wait()
    assert not desk.handle.done


@pytest.mark.parametrize("question", ["probe", "interrupt"])
def test_a_question_that_has_overtaken_the_start_does_not_make_the_goal_lost(question: str) -> None:
    desk = Desk()
    desk.asked.to_interrupt.append(UNKNOWN)
    desk.asked.to_question.extend([UNKNOWN] * (question == "probe") + [ENDED])
    getattr(desk.tracker, question)()
    desk.tracker.advance(RUNNING)
    desk.wait()
    assert desk.terminal.label == "S_THERE"


def test_following_an_unknown_goal_is_answered_so() -> None:
    desk = Desk()
    desk.asked.to_question.append(UNKNOWN)
    desk.tracker.follow()
    desk.wait()
    assert (desk.terminal.ending, desk.terminal.reason, desk.terminal.detected_by) == (
        Ending.ERROR,
        UNKNOWN.message,
        "client",
    )


def test_one_asks_once_at_a_time_how_a_goal_is_and_then_again() -> None:
    desk = Desk()
    desk.asked.to_question.extend([RUNNING, ENDED])
    desk.tracker.probe()
    desk.tracker.probe()
    desk.wait()
    assert (len(desk.asked.questions), desk.handle.state) == (1, State.RUNNING)
    desk.tracker.probe()
    desk.wait()
    assert (len(desk.asked.questions), desk.terminal.label) == (2, "S_THERE")


def test_an_answer_that_cannot_be_read_is_an_error() -> None:
    desk = Desk()
    desk.asked.to_start.append(b"\xc1")
    desk.start()
    desk.wait()
    assert desk.terminal.ending is Ending.ERROR
    assert desk.terminal.reason.startswith("The manager's answer is unreadable: ")


@pytest.mark.parametrize(
    "news",
    [
        status(State.TERMINATED, SUCCESS, goal_id="another"),
        status(State.TERMINATED),
        status(State.RUNNING, SUCCESS),
    ],
)
def test_news_of_others_and_news_that_contradict_themselves_change_nothing(news: GoalStatus) -> None:
    desk = Desk()
    desk.tracker.advance(news)
    assert (desk.handle.state, desk.changes) == (None, [])


def test_old_news_change_nothing() -> None:
    desk = Desk()
    desk.tracker.advance(RUNNING)
    desk.tracker.advance(status(State.DISPATCHING))
    assert (desk.handle.state, desk.changes) == (State.RUNNING, ["RUNNING"])


@pytest.mark.parametrize(("verdict", "label"), [(VIOLATED, "RI"), (LOST, "LOST")])
def test_a_verdict_that_the_manager_does_not_pass_on_counts_after_a_second(
    verdict: Violated | Lost, label: str
) -> None:
    desk = Desk()
    desk.tracker.advance(RUNNING)
    desk.tracker.on_verdict(verdict)
    assert desk.ended_after() == pytest.approx(VERDICT_PATIENCE)
    desk.wait(1.0)
    assert desk.terminal.label == label
    assert desk.terminal.reason == verdict.reason
    [record] = desk.records
    assert (record.cause, record.goal_id) == (verdict.record, "g")


def test_a_verdict_counts_once_the_states_after_its_step_are_known() -> None:
    desk = Desk()
    desk.steps = False
    desk.tracker.advance(RUNNING)
    desk.tracker.on_verdict(LOST)
    desk.wait()
    [(step, then)] = desk.awaited
    assert (step, desk.handle.done) == (LOST.step, False)
    then("")
    assert (desk.terminal.label, desk.terminal.reason) == ("LOST", LOST.reason)


def test_the_outcome_of_the_manager_comes_before_the_verdict() -> None:
    desk = Desk()
    desk.tracker.advance(RUNNING)
    desk.tracker.on_verdict(LOST)
    desk.tracker.advance(ENDED)
    desk.wait()
    assert (desk.terminal.label, desk.changes, desk.records) == ("S_THERE", ["RUNNING", "S_THERE"], [])


def test_new_inputs_are_asked_for_in_order_each_until_it_is_answered() -> None:
    desk = Desk()
    desk.asked.to_start.append(RUNNING)
    desk.asked.to_modify.extend([None, ErrorReply(code=ErrorCode.UNAVAILABLE, message="Not yet."), modified(1)])
    desk.asked.to_modify.append(modified(2))
    desk.start()
    answers: list[Answer] = []
    for request_id, speed in (("first", 1.0), ("second", 2.0)):
        request = ModifyGoal(
            goal_id="g", request_id=request_id, inputs={"speed": speed}, client="mission", schema="0" * 16
        )
        desk.tracker.modify(request, answers.append)
    desk.network.run_until(lambda: len(answers) == 2, 10.0)
    assert [request.request_id for request in desk.asked.modifications] == ["first", "first", "first", "second"]
    assert all(isinstance(answer, Answered) for answer in answers)
    assert desk.changes == ["RUNNING", "RUNNING", "RUNNING"], "each modification is news"


def test_new_inputs_for_a_goal_that_ends_first_get_no_answer() -> None:
    desk = Desk()
    desk.asked.to_start.append(RUNNING)
    desk.start()
    answers: list[Answer] = []
    request = ModifyGoal(goal_id="g", request_id="m", inputs={"speed": 1.0}, client="mission", schema="0" * 16)
    desk.tracker.modify(request, answers.append)
    desk.tracker.advance(ENDED)
    desk.network.run_until(lambda: bool(answers), 10.0)
    assert isinstance(answers[0], NoReply)
    assert desk.terminal == SUCCESS


def test_it_is_unknown_whether_new_inputs_counted_before_a_manager_was_replaced() -> None:
    desk = Desk()
    desk.asked.to_start.append(RUNNING)
    desk.start()
    desk.tracker.advance(RUNNING)
    desk.asked.to_modify.extend([None, ErrorReply(code=ErrorCode.UNKNOWN_GOAL, message="No goal g.")])
    answers: list[Answer] = []
    request = ModifyGoal(goal_id="g", request_id="m", inputs={"speed": 1.0}, client="mission", schema="0" * 16)
    desk.tracker.modify(request, answers.append)
    desk.network.run_until(lambda: bool(answers), 10.0)
    assert isinstance(answers[0], NoReply)


def test_a_goal_that_runs_on_before_its_loss_is_shown_is_interrupted() -> None:
    desk = Desk(alive=False)
    desk.releases = False
    desk.tracker.advance(RUNNING)
    desk.tracker.interrupt(cause="tree#3")
    desk.network.run_until(lambda: bool(desk.released), 30.0)
    before = len(desk.asked.interrupts)
    desk.tracker.advance(RUNNING)
    desk.network.run_until(lambda: len(desk.asked.interrupts) > before, 10.0)
    assert len(desk.asked.interrupts) > before
    assert desk.asked.interrupts[-1].cause == "tree#3"
    assert desk.handle.terminal is None, "its loss is not shown yet"


def test_the_release_of_a_lost_goal_is_asked_for_once() -> None:
    desk = Desk(alive=False)
    desk.releases = False
    desk.tracker.advance(RUNNING)
    desk.tracker.probe()
    desk.network.run_until(lambda: bool(desk.released), 30.0)
    desk.tracker.probe()
    desk.wait()
    assert desk.released == [("drive", "g")]


def test_a_goal_that_has_ended_is_lost_no_more() -> None:
    desk = Desk(alive=False)
    desk.tracker.advance(RUNNING)
    desk.tracker.probe()
    desk.tracker.advance(ENDED)
    desk.wait()
    assert (desk.terminal, desk.released) == (SUCCESS, [])


def modified(revision: int) -> GoalStatus:
    return GoalStatus(goal_id="g", skill="drive", state=State.RUNNING, t=0.0, record=f"m#{revision}", revision=revision)
