"""Histories of a shared place of which it is known whether they can have happened."""

from __future__ import annotations

import pytest
from linearizability import Operation, check
from place_history import FREE, UNCLEAR, Answer, Call, Change, GiveBack, PlaceHistory, PlaceModel, Renew, Take, Told

from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.protocol import BeginGoal, FireEvent, Granted, Keys, Message, NotReady, ResourceStates, encode

YES, NO, OVER, REFUSED = Answer.YES, Answer.NO, Answer.OVER, Answer.REFUSED


def op(call: Call, answer: Answer | None, called: int, answered: int | None) -> Told:
    return Operation("anybody", call, answer, called, answered)


CLEARED = op(Change(FREE), YES, 0, 1)
LEFT = op(Take("left"), YES, 2, 3)

POSSIBLE = {
    "the second one gets it when it was given back and seen empty": [
        *(CLEARED, LEFT, op(Take("right"), NO, 4, 5), op(GiveBack("left"), OVER, 6, 7)),
        *(op(Take("right"), NO, 8, 9), op(Change(FREE), YES, 10, 11), op(Take("right"), YES, 12, 13)),
    ],
    "a start that overlaps the clearing": [op(Change(FREE), YES, 0, 9), op(Take("left"), YES, 1, 2)],
    "the judge ends a goal itself": [
        *(CLEARED, LEFT, op(GiveBack("left"), None, 2, None)),
        *(op(Renew("left"), OVER, 5, 6), op(Change(FREE), YES, 7, 8), op(Take("right"), YES, 9, 10)),
    ],
    "a repeated start is the same grant": [CLEARED, LEFT, op(Take("left"), YES, 4, 5)],
    "an error tells nothing": [CLEARED, LEFT, op(GiveBack("left"), REFUSED, 4, 5), op(Renew("left"), YES, 6, 7)],
    "an unanswered start may have been lost": [CLEARED, op(Take("left"), None, 2, None), op(Take("right"), YES, 4, 5)],
    "an intruder": [CLEARED, op(Change(UNCLEAR), YES, 2, 3), op(Take("left"), NO, 4, 5)],
}
IMPOSSIBLE = {
    "two at once": [CLEARED, LEFT, op(Take("right"), YES, 4, 5)],
    "free without being seen empty": [CLEARED, LEFT, op(GiveBack("left"), OVER, 4, 5), op(Take("right"), YES, 6, 7)],
    "free from the start": [LEFT],
    "refused although it is free": [CLEARED, op(Take("left"), NO, 2, 3)],
    "cleared while it is held": [CLEARED, LEFT, op(Change(FREE), YES, 4, 5)],
    "renewed after its end": [CLEARED, LEFT, op(GiveBack("left"), OVER, 4, 5), op(Renew("left"), YES, 6, 7)],
    "a grant that is forgotten": [CLEARED, LEFT, op(Renew("left"), OVER, 4, 5)],
}


@pytest.mark.parametrize("history", POSSIBLE.values(), ids=POSSIBLE)
def test_a_history_that_can_have_happened(history: list[Told]) -> None:
    assert check(PlaceModel(), history).linearizable


@pytest.mark.parametrize("history", IMPOSSIBLE.values(), ids=IMPOSSIBLE)
def test_a_history_that_cannot(history: list[Told]) -> None:
    assert not check(PlaceModel(), history).linearizable


def begin(goal: str, skill: str = "hold_pad") -> BeginGoal:
    return BeginGoal(goal_id=goal, skill=skill, inputs={}, manager="m", owner="o", schema="")


def granted(goal: str) -> Granted:
    return Granted(goal_id=goal, token=1, step=1, record="r")


@pytest.mark.parametrize("right", [NotReady, Granted])
def test_a_history_is_read_from_the_messages_of_a_network(right: type[Message]) -> None:
    """The first question is lost: nobody serves its key yet."""
    network, keys, history = InProcessNetwork(), Keys("yard"), PlaceHistory("pad")
    network.tap = history.take
    asker, judge = network.bus("hold_pad", "yard"), network.bus("judge", "yard")
    answers: list[Message] = [granted("left"), granted("right")]
    if right is NotReady:
        answers[1] = NotReady(goal_id="right", failing={"free": "held"}, step=1, record="r")

    def ask(key: str, message: Message) -> None:
        asker.ask(key, encode(message), lambda answer: None)
        network.run_for(0.1)

    ask(keys.resource_goal, begin("lost"))
    judge.serve(keys.resource_goal, lambda request: request.reply(encode(answers.pop(0))))
    cleared = ResourceStates(states={}, step=1, epoch="e", t=0.0)
    judge.serve(keys.event("pad_cleared"), lambda request: request.reply(encode(cleared)))
    ask(keys.event("pad_cleared"), FireEvent(event="pad_cleared", source="places"))
    ask(keys.resource_goal, begin("left"))
    ask(keys.resource_goal, begin("right"))
    assert len(history.operations) == 5 + (right is Granted)
    assert history.judge().linearizable is (right is NotReady)


@pytest.mark.parametrize("apart", [0.0, 0.01])
def test_answers_of_two_places_at_one_moment_are_told_apart(apart: float) -> None:
    """One drone holds the pad and gets the corridor, when another one is refused the pad."""
    network, keys = InProcessNetwork(), Keys("yard")
    histories = {place: PlaceHistory(place) for place in ("pad", "corridor")}
    network.tap = lambda message: [history.take(message) for history in histories.values()]
    buses = {place: network.bus(f"hold_{place}", "yard") for place in histories}
    judge = network.bus("judge", "yard")
    refused = NotReady(goal_id="right", failing={"free": "held"}, step=1, record="r")
    answers = [granted("left"), granted("left in"), refused]
    cleared = ResourceStates(states={}, step=1, epoch="e", t=0.0)
    judge.serve(keys.resource_goal, lambda request: request.reply(encode(answers.pop(0))))

    def ask(place: str, key: str, message: Message) -> None:
        buses[place].ask(key, encode(message), lambda answer: None)

    for place in histories:
        judge.serve(keys.event(f"{place}_cleared"), lambda request: request.reply(encode(cleared)))
        ask(place, keys.event(f"{place}_cleared"), FireEvent(event=f"{place}_cleared", source="places"))
    network.run_for(0.1)
    ask("pad", keys.resource_goal, begin("left"))
    network.run_for(0.1)
    ask("corridor", keys.resource_goal, begin("left in", "hold_corridor"))
    network.run_for(apart)
    ask("pad", keys.resource_goal, begin("right"))
    network.run_for(0.1)
    assert {place: len(history.operations) for place, history in histories.items()} == {"pad": 4, "corridor": 3}
    assert all(history.judge().linearizable for history in histories.values())
