"""Silence, leases and owners, while a goal waits for its grant or holds it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from rig import RIG
from skill_desk import REFUSED, TOKEN, Desk, dispatching, interrupting, owned, running, validating

from skillwing.services.core.delivery import SILENCES_UNTIL_ERROR
from skillwing.services.core.goal_states import RENEWALS_UNTIL_UNWATCHED
from skillwing.services.core.owners import ProcessExits, owner_grace
from skillwing.services.core.skill_actions import AskResources, Hook
from skillwing.services.core.skill_events import OwnerGone, RenewalAnswered
from skillwing.services.protocol import (
    EndGoal,
    Ending,
    ErrorCode,
    ErrorReply,
    Granted,
    ModifyGoal,
    NodesExited,
    RenewGoal,
    State,
)


@pytest.mark.parametrize(("context", "how"), [(validating, None), (running, "DONE")])
def test_silence_of_the_resource_manager_is_asked_again_and_ends_in_an_answer(
    context: Callable[[], Desk], how: str | None
) -> None:
    desk = context()
    if how:
        desk.terminated(how)
    first = desk.asked.call
    for silences in range(1, SILENCES_UNTIL_ERROR):
        desk.answer(None)
        assert desk.asked == AskResources(first, silences)
    assert desk.terminals == []
    desk.answer(None)
    assert desk.terminal().ending is Ending.ERROR
    assert "resource manager does not answer" in desk.terminal().reason
    settling = desk.asked.call
    assert isinstance(settling, EndGoal), "what may have been granted is still to be given back"
    assert settling.incarnation == "this", "by this process, and by no other of its name"
    desk.answer(None)
    assert desk.asked == AskResources(settling, SILENCES_UNTIL_ERROR + 1)
    count = len(desk.actions)
    desk.ended()
    assert len(desk.actions) == count


def test_an_empty_reply_is_no_refusal() -> None:
    desk = validating()
    desk.answer(None)
    desk.granted()
    assert desk.state is State.DISPATCHING


@pytest.mark.parametrize(
    ("context", "held"),
    [(Desk, False), (validating, False), (dispatching, True), (running, True), (interrupting, True)],
)
def test_a_grant_is_renewed_for_as_long_as_it_is_held(context: Callable[[], Desk], held: bool) -> None:
    renewal = context().core.renewal()
    assert renewal == (RenewGoal(goal_id="g", skill="move", token=TOKEN) if held else None)


def test_a_grant_is_renewed_until_its_end_is_acknowledged() -> None:
    desk = running()
    desk.terminated()
    assert desk.core.renewal() is not None
    desk.ended()
    assert desk.core.renewal() is None


@pytest.mark.parametrize(
    "answer",
    [
        None,
        Granted(goal_id="g", token=TOKEN, step=1, record="rm#1"),
        ErrorReply(code=ErrorCode.INTERNAL, message="The disk is full."),
    ],
)
def test_a_renewal_without_a_verdict_changes_nothing(answer: Any) -> None:
    desk = running()
    count = len(desk.actions)
    desk.renewed(answer)
    assert len(desk.actions) == count
    assert desk.state is State.RUNNING


@pytest.mark.parametrize("answer", [None, ErrorReply(code=ErrorCode.UNAVAILABLE, message="Its disk is full.")])
def test_a_goal_whose_invariants_nobody_watches_is_asked_to_stop(answer: Any) -> None:
    desk = running()
    for _ in range(RENEWALS_UNTIL_UNWATCHED - 1):
        desk.renewed(answer)
    desk.renewed(Granted(goal_id="g", token=TOKEN, step=1, record="rm#1"))
    for _ in range(RENEWALS_UNTIL_UNWATCHED - 1):
        desk.renewed(answer)
    assert desk.state is State.RUNNING
    desk.renewed(answer)
    assert desk.state is State.INTERRUPTING
    assert desk.hooks[-1] is Hook.INTERRUPT
    desk.renewed(answer)
    desk.interrupted()
    desk.ended()
    assert desk.terminal().label == "IT"
    assert desk.terminal().reason == "The resource manager is silent, and nobody watches the invariants."


def test_silent_renewals_are_counted_through_all_states_without_a_request_to_stop() -> None:
    """The hook `on_dispatch` may take long, and new inputs may arrive: neither makes anybody watch the invariants."""

    def modify(desk: Desk, request_id: str, problem: str | None) -> None:
        desk.step(
            ModifyGoal(goal_id="g", request_id=request_id, inputs={"speed": 2.0}, client="test", schema=RIG.schema_hash)
        )
        desk.renewed(None)
        desk.validated(problem)

    desk = dispatching()
    desk.renewed(None)
    desk.dispatched()
    modify(desk, "m1", None)
    modify(desk, "m2", "Too windy.")
    for _ in range(RENEWALS_UNTIL_UNWATCHED - 4):
        desk.renewed(None)
    assert desk.state is State.RUNNING
    desk.renewed(None)
    assert desk.state is State.INTERRUPTING


def test_a_verdict_on_a_renewal_has_the_hooks_stop() -> None:
    desk = running()
    desk.renewed(REFUSED)
    assert desk.hooks[-1] is Hook.ENDED
    assert desk.terminal().reason == REFUSED.message


def test_a_verdict_on_an_old_goal_leaves_the_next_one_alone() -> None:
    desk = running()
    desk.step(RenewalAnswered(RenewGoal(goal_id="old", skill="move", token=3), REFUSED))
    assert desk.state is State.RUNNING


def test_a_goal_whose_owner_is_gone_is_asked_to_stop_and_says_why() -> None:
    desk = owned()
    desk.owner_gone()
    assert desk.state is State.INTERRUPTING
    assert desk.hooks[-1] is Hook.INTERRUPT
    desk.interrupted()
    desk.ended()
    assert desk.terminal().reason == "Its owner mission-1 is gone."


def test_a_goal_has_the_grace_that_its_owner_asked_for_and_no_other() -> None:
    desk = Desk()
    assert owner_grace(desk.core.current, "client/mission-1") == 0.0
    desk.start(owner="client/mission-1", owner_grace=20.0)
    assert owner_grace(desk.core.current, "client/mission-1") == 20.0
    assert owner_grace(desk.core.current, "client/mission-2") == 0.0
    desk.validated()
    desk.granted()
    desk.dispatched()
    desk.owner_gone()
    assert desk.records[-1].text == "Its owner mission-1 is gone, and has not come back within 20 s."


@pytest.mark.parametrize(
    ("owner", "nodes", "after", "cause"),
    [
        ("client/mission-1", ("mission",), 0.5, "launcher#1"),
        ("client/mission-1", ("recorder", "mission"), -1.0, "launcher#1"),
        ("client/mission-1", ("mission",), -3.0, None),
        ("client/mission-1", ("skill/look",), 0.5, None),
        ("client/anna~mission-1", ("mission",), 0.5, "launcher#1"),
        ("client/look-1", ("skill/look",), 0.5, "launcher#1"),
        ("client/ground-station-1", ("ground-station",), 0.5, "launcher#1"),
        ("client/ground-station-1", ("ground",), 0.5, None),
    ],
)
def test_an_interrupt_for_an_owner_has_the_exit_of_its_process_as_its_cause(
    owner: str, nodes: tuple[str, ...], after: float, cause: str | None
) -> None:
    desk = Desk()
    desk.start(owner=owner)
    desk.validated()
    desk.granted()
    desk.dispatched()
    exits = ProcessExits()
    exits.note(NodesExited(nodes=nodes, record="launcher#1", t=desk.now + after))
    desk.step(OwnerGone(owner, exits.of_owner(owner)))
    assert (desk.state, desk.records[-1].cause) == (State.INTERRUPTING, cause)


@pytest.mark.parametrize("context", [running, owned])
def test_the_end_of_another_client_is_nothing_to_a_goal(context: Callable[[], Desk]) -> None:
    desk = context()
    desk.owner_gone("client/mission-2")
    assert desk.state is State.RUNNING


def test_a_skill_may_go_on_without_its_owner() -> None:
    skills = tuple(replace(skill, owner_lost="continue") for skill in RIG.skills)
    desk = owned(skillset=replace(RIG, skills=skills))
    desk.owner_gone()
    assert desk.state is State.RUNNING


def test_a_resource_manager_that_cannot_decide_now_is_asked_again() -> None:
    desk = Desk()
    desk.start()
    desk.validated()
    first = desk.asked.call
    desk.answer(ErrorReply(code=ErrorCode.UNAVAILABLE, message="Its disk is full."))
    assert desk.asked == AskResources(first, 1)
    desk.granted()
    assert desk.core.current is not None
