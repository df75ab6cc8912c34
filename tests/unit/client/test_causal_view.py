"""Order in which a client shows what it hears: a status comes after the states that it follows from."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

import pytest
from hypothesis import given
from hypothesis import strategies as st

from law_settings import examples
from skillwing.services.client.causal_view import CausalView, Delivered, Held
from skillwing.services.protocol import GoalStatus, Record, RecordKind, ResourceStates, ResourceStep, State

RESOURCES = ("camera", "lidar")


def change(number: int, resource: str, before: str, after: str) -> Record:
    return Record(
        id=f"rm#{number}",
        t=float(number),
        source="rm",
        kind=RecordKind.RESOURCE,
        subject=resource,
        before=before,
        after=after,
    )


def status(after_step: int, goal_id: str = "g") -> GoalStatus:
    return GoalStatus(goal_id=goal_id, skill="look", state=State.RUNNING, t=0.0, after_step=after_step)


@dataclass
class Robot:
    """A resource manager that steps, and skill managers that follow it; what they tell waits to be delivered."""

    number: int = 10
    epoch: str = "1"
    states: dict[str, str] = field(default_factory=lambda: dict.fromkeys(RESOURCES, "0"))
    past: dict[int, dict[str, str]] = field(default_factory=dict[int, dict[str, str]])
    """States after each step. Numbers of different epochs differ."""
    told: list[ResourceStep | GoalStatus] = field(default_factory=list[ResourceStep | GoalStatus])
    goals: int = 0

    def __post_init__(self) -> None:
        self.past[self.number] = dict(self.states)

    def step(self, resource: str) -> None:
        self.number += 1
        before = self.states[resource]
        self.states[resource] = str(self.number)
        self.past[self.number] = dict(self.states)
        record = change(self.number, resource, before, self.states[resource])
        self.told.append(ResourceStep(number=self.number, epoch=self.epoch, t=0.0, records=(record,)))

    def forget(self) -> None:
        """Begin again without a journal: another epoch, with larger numbers."""
        self.epoch, self.number = str(int(self.epoch) + 1), self.number + 1000
        self.states = dict.fromkeys(RESOURCES, "0")
        self.past[self.number] = dict(self.states)

    def lose_step(self) -> None:
        """Lose the latest step, and use its number again: the journal was not on its disk when the power failed."""
        self.number -= 1
        self.states = dict(self.past[self.number])

    def invent(self) -> None:
        """A step that the resource manager has not taken, from the future."""
        record = change(self.number + 500, "camera", "0", "forged")
        self.told.append(ResourceStep(number=self.number + 500, epoch=self.epoch, t=0.0, records=(record,)))

    def follow(self) -> None:
        self.goals += 1
        self.told.append(status(self.number, f"g{self.goals}"))

    def answer(self) -> ResourceStates:
        return ResourceStates(step=self.number, epoch=self.epoch, states=dict(self.states), t=0.0)


@dataclass
class Client:
    """A client of the robot. Each look at it compares what it shows with what was."""

    robot: Robot
    view: CausalView = field(default_factory=CausalView)
    shown: list[str] = field(default_factory=list[str])
    answers: list[tuple[int, ResourceStates]] = field(default_factory=list[tuple[int, ResourceStates]])
    heard_steps: Counter[int] = field(default_factory=Counter[int])
    shown_steps: Counter[int] = field(default_factory=Counter[int])
    known_steps: set[int] = field(default_factory=set[int])
    """Heard steps, without those from before the states went back to an earlier step."""
    number: int = 0

    def look(self, delivered: tuple[Delivered, ...], *, giving_up: bool = False) -> None:
        for message in delivered:
            if isinstance(message, GoalStatus):
                self.shown.append(message.goal_id)
                if self.view.number is not None and not giving_up:
                    assert message.after_step <= self.view.number, "a status is shown before its step"
            else:
                self.shown_steps[message.number] += 1
        if (self.view.number or 0) < self.number:
            self.known_steps.clear()
        self.number = self.view.number or 0
        assert self.shown_steps <= self.heard_steps, "a step is shown more often than it was heard"
        if self.view.number is not None and not self.view.incomplete:
            assert dict(self.view.states) == self.robot.past[self.view.number], "the states are those of one step"
            self.look_at_causes()
            if self.robot.number in self.heard_steps and not self.view.waiting:
                assert self.view.number == self.robot.number, "the latest step was heard, and its states are unknown"

    def look_at_causes(self) -> None:
        """Each state but the first has the number of the step that led to it."""
        for resource, state in self.view.states.items():
            cause = self.view.change_record(resource)
            assert cause in (f"rm#{state}", None), "the cause of a state is an older change"
            assert cause or int(state) not in self.known_steps, "the cause of a state is not known any more"

    def hear(self, message: ResourceStep | GoalStatus) -> None:
        if isinstance(message, ResourceStep):
            self.heard_steps[message.number] += 1
            self.known_steps.add(message.number)
            self.look(self.view.take_step(message))
        else:
            self.look(self.view.take_status(message))

    def ask(self) -> None:
        """The answer is made now, and arrives later."""
        self.answers.append((self.view.note_question(), self.robot.answer()))

    def hear_answer(self, number: int) -> None:
        if self.answers:
            question, states = self.answers.pop(number % len(self.answers))
            self.look(self.view.take_states(states, question))

    def give_up(self) -> None:
        """Show everything, since nobody answers."""
        known = self.view.ready
        self.look(self.view.give_up(), giving_up=True)
        assert not known or not (self.view._held or self.view._early), "something is held back"


ACTIONS = st.tuples(
    st.sampled_from(
        ["step", "follow", "deliver", "deliver", "ask", "answer", "lose", "repeat", "give_up", "forget", "invent"]
    ),
    st.integers(0, 20),
)


def carry(robot: Robot, client: Client, action: str, choice: int) -> set[str]:
    """Deliver, repeat or lose one of the messages that wait. Return the id of the goal whose status gets lost."""
    if not robot.told:
        return set()
    index = choice % len(robot.told)
    message = robot.told[index] if action == "repeat" else robot.told.pop(index)
    if action != "lose":
        client.hear(message)
    return {message.goal_id} if action == "lose" and isinstance(message, GoalStatus) else set()


@given(st.booleans(), st.lists(ACTIONS, min_size=20, max_size=60))
@examples(60)
def test_in_any_order_of_messages_no_status_is_shown_before_its_step(
    begins_connected: bool, actions: list[tuple[str, int]]
) -> None:
    robot = Robot()
    client = Client(robot)
    if begins_connected:
        client.ask()
        client.hear_answer(0)
    lost: set[str] = set()
    for action, choice in actions:
        match action:
            case "step":
                robot.step(RESOURCES[choice % len(RESOURCES)])
            case "follow":
                robot.follow()
            case "ask":
                client.ask()
            case "forget":
                robot.forget()
            case "invent":
                robot.invent()
            case "give_up":
                client.give_up()
            case "answer":
                client.hear_answer(choice)
            case _:
                lost |= carry(robot, client, action, choice)
    for message in list(robot.told):
        client.hear(message)
    for _ in range(2 if client.view.incomplete else 1):
        client.ask()
        client.hear_answer(-1)
    assert not client.view.waiting, "an answer to the latest question ends all waiting"
    assert client.view.states == robot.states
    assert {f"g{number + 1}" for number in range(robot.goals)} - lost <= set(client.shown), "nothing is kept for ever"
    assert set(client.heard_steps) == set(client.shown_steps), "no record of a step is kept for ever"


def connected() -> tuple[Robot, Client]:
    """A robot, and a client that knows its states."""
    robot = Robot()
    client = Client(robot)
    client.ask()
    client.hear_answer(0)
    return robot, client


def test_a_status_waits_for_the_step_that_it_follows_from() -> None:
    robot, client = connected()
    robot.step("camera")
    robot.follow()
    step, end = robot.told
    client.hear(end)
    assert (client.shown, client.view.waiting) == ([], True)
    client.hear(step)
    assert (client.shown, client.view.waiting) == (["g1"], False)
    assert client.view.change_record("camera") == "rm#11"


def test_a_step_looks_only_at_the_statuses_that_it_releases(monkeypatch: pytest.MonkeyPatch) -> None:
    """A recorder that lagged behind held thousands, looked at each for every step, and never caught up."""
    looked_at: list[GoalStatus] = []
    after_step = Held.__dict__["after_step"]

    def read(held: Held) -> int:
        looked_at.append(held.status)
        return after_step.__get__(held)

    monkeypatch.setattr(Held, "after_step", property(read))
    robot, view = Robot(), CausalView()
    view.take_states(robot.answer(), view.note_question())
    far = [status(robot.number + 1000, f"far{number}") for number in range(1000)]
    for each in far:
        assert view.take_status(each) == ()
    looked_at.clear()
    for _ in range(10):
        robot.step("camera")
        robot.follow()
        step, released = robot.told.pop(0), robot.told.pop(0)
        assert isinstance(step, ResourceStep) and isinstance(released, GoalStatus)
        assert view.take_status(released) == ()
        assert view.take_step(step) == (step, released)
    assert len(looked_at) < 100


def test_a_step_that_is_lost_is_made_good_by_the_states() -> None:
    robot, client = connected()
    robot.step("camera")
    robot.step("lidar")
    robot.follow()
    client.hear(robot.told[2])
    client.hear(robot.told[1])
    assert client.view.states["lidar"] == "0", "the step before is missing"
    client.ask()
    client.hear_answer(0)
    assert (client.shown, client.view.states["lidar"]) == (["g1"], "12")


def test_an_answer_from_before_a_status_does_not_release_it() -> None:
    robot, client = connected()
    client.ask()
    robot.step("camera")
    robot.follow()
    client.hear(robot.told[1])
    client.hear_answer(0)
    assert client.shown == []


def test_an_answer_releases_the_statuses_before_its_question_once_and_keeps_the_later_ones() -> None:
    robot, view = Robot(), CausalView()
    view.take_states(robot.answer(), view.note_question())
    before, after = status(robot.number + 5, "before"), status(robot.number + 6, "after")
    assert view.take_status(before) == ()
    question = view.note_question()
    assert view.take_status(after) == ()
    assert view.take_states(robot.answer(), question) == (before,)
    assert view.waiting
    assert view.take_states(robot.answer(), view.note_question()) == (after,)
    assert not view.waiting


def test_an_overtaken_answer_releases_the_statuses_before_its_question() -> None:
    robot, view = Robot(), CausalView()
    view.take_states(robot.answer(), view.note_question())
    before, late = status(robot.number + 5), robot.answer()
    assert view.take_status(before) == ()
    question = view.note_question()
    robot.step("camera")
    (step,) = robot.told
    assert isinstance(step, ResourceStep)
    assert view.take_step(step) == (step,)
    assert view.take_states(late, question) == (before,)


def test_a_client_that_joins_late_is_ready_when_it_knows_what_it_was_shown() -> None:
    robot = Robot()
    client = Client(robot)
    client.ask()
    robot.step("camera")
    robot.follow()
    client.hear(robot.told[1])
    assert client.shown == ["g1"], "nothing is known yet that could be out of order"
    client.hear_answer(0)
    assert not client.view.ready, "the answer is older than what was shown"
    client.ask()
    client.hear_answer(0)
    assert client.view.ready


def test_a_manager_that_has_forgotten_its_steps_ends_the_waiting() -> None:
    robot = Robot(number=1000)
    view = CausalView()
    view.take_states(robot.answer(), view.note_question())
    assert view.take_status(status(1005)) == ()
    question = view.note_question()
    again = ResourceStates(step=3, epoch="2", states=robot.states, t=0.0)
    assert view.take_states(again, question) == (status(1005),)
    assert view.number == 3


def test_changes_of_another_epoch_are_no_causes_any_more() -> None:
    robot, client = connected()
    robot.step("camera")
    client.hear(robot.told[0])
    assert client.view.change_record("camera") == "rm#11"
    robot.forget()
    client.ask()
    client.hear_answer(0)
    assert client.view.change_record("camera") is None


def test_a_state_that_came_with_a_snapshot_has_its_own_cause_or_none() -> None:
    robot, client = connected()
    robot.step("camera")
    robot.step("camera")
    client.hear(robot.told[0])
    client.ask()
    client.hear_answer(0)
    assert (client.view.states["camera"], client.view.change_record("camera")) == ("12", None)
    client.hear(robot.told[1])
    assert client.view.change_record("camera") == "rm#12"
    client.hear(robot.told[0])
    assert client.view.change_record("camera") == "rm#12", "an older step comes again"


def test_a_step_that_nobody_has_taken_is_waited_for_until_the_next_answer() -> None:
    robot, client = connected()
    robot.invent()
    client.hear(robot.told[0])
    assert client.view.waiting
    client.ask()
    client.hear_answer(0)
    assert (client.view.waiting, dict(client.view.states), client.shown_steps) == (False, robot.states, {510: 1})


def test_a_step_that_came_after_a_question_is_not_dropped_by_its_answer() -> None:
    robot, client = connected()
    client.ask()
    robot.step("camera")
    robot.step("lidar")
    client.hear(robot.told[1])
    client.hear_answer(0)
    assert (client.view.waiting, client.shown_steps) == (True, {})
    client.hear(robot.told[0])
    assert (client.view.number, client.view.states["lidar"]) == (12, "12")


def test_a_manager_that_has_lost_its_latest_step_is_believed() -> None:
    robot, client = connected()
    robot.step("camera")
    client.ask()
    client.hear(robot.told[0])
    robot.lose_step()
    client.ask()
    client.hear_answer(0)
    assert client.view.number == 11, "the first question came before the step"
    client.hear_answer(0)
    assert (client.view.number, client.view.change_record("camera"), client.view.waiting) == (10, None, True)
    assert client.view.states == robot.states
    client.ask()
    client.hear_answer(0)
    assert not client.view.waiting, "no step that seemed late is missing"
    robot.step("lidar")
    client.hear(robot.told[1])
    assert (client.view.number, client.view.change_record("lidar")) == (11, "rm#11")


def test_a_number_that_a_manager_has_lost_and_used_again_does_not_hide_its_states() -> None:
    robot, client = connected()
    robot.step("camera")
    client.hear(robot.told[0])
    robot.lose_step()
    client.known_steps.clear()
    version = client.view.version
    robot.step("lidar")
    assert client.view.number == robot.number == 11
    client.ask()
    client.hear_answer(0)
    assert client.view.states == robot.states
    assert client.view.version > version, "the states have changed"
    assert (client.view.change_record("camera"), client.view.change_record("lidar")) == (None, None)
    assert client.view.waiting, "the answer may have been on its way since before the loss"
    client.ask()
    client.hear_answer(0)
    assert (client.view.states, client.view.waiting) == (robot.states, False)


def test_a_lost_step_is_noticed_although_the_next_one_overtakes_the_answer() -> None:
    for hears_the_return in (True, False):
        robot, client = connected()
        robot.step("camera")
        client.hear(robot.told.pop())
        robot.lose_step()
        robot.step("lidar")
        returned = robot.told.pop()
        if hears_the_return and isinstance(returned, ResourceStep):
            client.view.take_step(returned)
        question, answer = client.view.note_question(), robot.answer()
        robot.step("lidar")
        following = robot.told.pop()
        assert isinstance(following, ResourceStep)
        client.view.take_step(following)
        client.view.take_states(answer, question)
        assert client.view.states != robot.states
        assert client.view.waiting, "so it asks once more"
        client.view.take_states(robot.answer(), client.view.note_question())
        assert (client.view.states, client.view.waiting) == (robot.states, False)


def test_an_early_step_that_was_lost_does_not_hide_the_answer() -> None:
    robot, client = connected()
    robot.step("lidar")
    robot.told.clear()
    robot.step("camera")
    client.hear(robot.told.pop())
    for _ in range(2):
        robot.lose_step()
    robot.step("lidar")
    question, answer = client.view.note_question(), robot.answer()
    returned = robot.told.pop()
    assert isinstance(returned, ResourceStep)
    client.view.take_step(returned)
    assert client.view.number == 12, "the early step seems to follow"
    client.view.take_states(answer, question)
    assert (client.view.number, client.view.states) == (11, robot.states)
    assert client.view.waiting, "it asks once more"


def test_changes_of_a_lost_step_are_no_causes() -> None:
    robot, client = connected()
    robot.step("camera")
    client.hear(robot.told.pop())
    robot.lose_step()
    client.view.take_step(ResourceStep(number=11, epoch=robot.epoch, t=0.0))
    assert (client.view.change_record("camera"), client.view.waiting) == (None, True)


def test_a_step_that_is_told_twice_is_no_lost_one() -> None:
    robot, client = connected()
    robot.step("camera")
    client.hear(robot.told[0])
    client.hear(robot.told[0])
    assert not client.view.waiting


def test_a_resource_of_another_skillset_is_forgotten() -> None:
    robot, client = connected()
    del robot.states["lidar"]
    robot.number += 1
    for _ in range(2):
        client.view.take_states(robot.answer(), client.view.note_question())
        assert (client.view.states, client.view.waiting) == ({"camera": "0"}, False)


@given(st.integers(1, 4), st.lists(st.sampled_from(["heard", "missed"]), max_size=6))
@examples(60)
def test_after_any_loss_of_steps_the_answer_to_the_next_question_counts(lost: int, taken: list[str]) -> None:
    robot, client = connected()
    for _ in range(4):
        robot.step("camera")
        client.hear(robot.told.pop())
    for _ in range(lost):
        robot.lose_step()
    before = (dict(client.view.states), client.view.version)
    for heard in taken:
        robot.step("lidar")
        step = robot.told.pop()
        if heard == "heard" and isinstance(step, ResourceStep):
            client.view.take_step(step)
    for _ in range(2):
        client.view.take_states(robot.answer(), client.view.note_question())
        assert client.view.states == robot.states
    assert not client.view.waiting
    assert (client.view.version > before[1]) == (client.view.states != before[0])


def test_an_answer_that_brings_nothing_new_is_no_change() -> None:
    robot, client = connected()
    version = client.view.version
    client.ask()
    client.hear_answer(0)
    assert client.view.version == version
    robot.step("camera")
    client.hear(robot.told[0])
    assert client.view.version > version


def test_a_late_answer_does_not_bring_back_older_states() -> None:
    robot, client = connected()
    client.ask()
    robot.step("camera")
    client.hear(robot.told[0])
    client.hear_answer(0)
    assert client.view.states["camera"] == "11"
    assert not client.view.waiting, "a later change is no sign of a lost step"


def test_an_older_answer_to_a_later_question_does_not_count() -> None:
    robot, client = connected()
    older = robot.answer()
    robot.step("camera")
    first, second = client.view.note_question(), client.view.note_question()
    client.view.take_states(robot.answer(), first)
    client.view.take_states(older, second)
    assert client.view.states == robot.states


def test_a_late_answer_of_a_manager_that_is_gone_does_not_count() -> None:
    robot, client = connected()
    client.ask()
    robot.forget()
    robot.step("lidar")
    client.hear(robot.told[0])
    client.ask()
    client.hear_answer(1)
    client.hear_answer(0)
    assert dict(client.view.states) == robot.states


def test_what_is_held_is_shown_if_nobody_answers() -> None:
    robot, client = connected()
    robot.step("camera")
    robot.step("lidar")
    robot.follow()
    client.hear(robot.told[1])
    client.hear(robot.told[2])
    client.give_up()
    assert (client.shown, client.view.waiting) == (["g1"], True), "the states are still asked for"
    assert client.view.states["lidar"] == "12"
    client.ask()
    client.hear_answer(0)
    assert (client.view.waiting, dict(client.view.states)) == (False, robot.states)


def test_steps_of_a_manager_that_is_gone_are_shown_before_the_states_of_the_next() -> None:
    robot, client = connected()
    robot.step("camera")
    robot.step("lidar")
    client.hear(robot.told[1])
    assert client.shown_steps == {}, "the step before is missing"
    robot.forget()
    client.ask()
    client.hear_answer(0)
    assert client.shown_steps == {12: 1}
    assert (client.view.states, client.view.change_record("lidar")) == (robot.states, None)


def test_a_snapshot_of_a_missing_step_lets_the_later_ones_follow() -> None:
    robot, client = connected()
    robot.step("camera")
    client.ask()
    robot.step("lidar")
    client.hear(robot.told[1])
    client.hear_answer(0)
    assert (client.view.number, client.view.waiting) == (12, False)
    assert client.shown_steps == {12: 1}


def test_a_snapshot_shows_the_early_steps_that_it_holds() -> None:
    client = Client(Robot())
    client.view.take_states(client.robot.answer(), client.view.note_question())
    for resource in ("camera", "lidar", "camera"):
        client.robot.step(resource)
    _, second, third = client.robot.told
    assert client.view.take_step(second) == client.view.take_step(third) == ()
    assert client.view.take_states(client.robot.answer(), client.view.note_question()) == (second, third)


def test_a_step_that_comes_after_its_states_is_shown_at_once() -> None:
    robot, client = connected()
    robot.step("camera")
    client.ask()
    client.hear_answer(0)
    client.hear(robot.told[0])
    assert (client.shown_steps, client.view.waiting) == ({11: 1}, False)


def test_steps_of_the_next_manager_are_shown_at_once_and_count_after_its_states() -> None:
    robot, client = connected()
    robot.forget()
    client.ask()
    robot.step("camera")
    robot.step("lidar")
    for step in reversed(robot.told):
        client.hear(step)
    assert client.shown_steps == {1011: 1, 1012: 1}
    assert client.view.states["camera"] == "0", "states of the new epoch are unknown"
    assert client.view.waiting
    client.hear_answer(0)
    assert (client.view.number, dict(client.view.states)) == (1012, robot.states)
    assert client.shown_steps == {1011: 1, 1012: 1}
    assert client.view.change_record("camera") == "rm#1011"


def test_an_answer_that_newer_states_have_overtaken_keeps_what_it_does_not_hold() -> None:
    robot, client = connected()
    client.ask()
    robot.step("camera")
    robot.step("lidar")
    robot.follow()
    step, _, end = robot.told
    client.hear(step)
    client.hear(end)
    client.hear_answer(0)
    assert (client.shown, client.view.number) == ([], 11)


def test_a_step_that_was_shown_before_the_first_states_is_not_shown_again_when_its_turn_comes() -> None:
    robot = Robot()
    client = Client(robot)
    client.ask()
    for resource in ("camera", "lidar"):
        robot.step(resource)
    client.hear(robot.told[1])
    client.hear_answer(0)
    client.hear(robot.told[0])
    assert (client.shown_steps, client.view.number) == ({11: 1, 12: 1}, 12)


def test_a_late_answer_of_a_manager_that_is_gone_does_not_end_the_waiting_for_the_next() -> None:
    robot, client = connected()
    client.ask()
    robot.forget()
    robot.step("lidar")
    client.hear(robot.told[0])
    client.hear_answer(0)
    assert client.view.waiting, "the states after the step of the new manager are unknown"
    client.ask()
    client.hear_answer(0)
    assert (dict(client.view.states), client.view.waiting) == (robot.states, False)


def test_steps_of_a_manager_that_is_gone_end_no_waiting_and_begin_none() -> None:
    robot, client = connected()
    robot.step("camera")
    robot.forget()
    client.ask()
    client.hear_answer(0)
    client.hear(robot.told[0])
    assert client.view.waiting, "nobody knows yet which epoch is over"
    client.ask()
    client.hear_answer(0)
    assert (dict(client.view.states), client.view.waiting) == (robot.states, False)
