"""Goals of a manager whose process is lost, replaced, or gives them up."""

from __future__ import annotations

import pytest
from rig import Bench, granted

from skillwing.services.core.events import ManagerGone
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.snapshot import FinishedGoal, ManagerEntry
from skillwing.services.protocol import AttachManager, Ended, EndKind, ErrorCode, Lost, Record


def test_a_lost_manager_loses_its_goals_and_its_token(bench: Bench) -> None:
    token = granted(bench.begin("move", "g")).token
    bench.perform(bench.core.step(ManagerGone("skill/shine"), 0.0))
    assert bench.core.states["axes"] == "USED"
    bench.perform(bench.core.step(ManagerGone("skill/move"), 0.0))
    assert bench.core.states["axes"] == "FREE"
    lost = bench.of(Lost)
    assert [(each.goal_id, each.token) for each in lost] == [("g", token)]
    assert [record.after for record in bench.of(Record, lambda record: record.id == lost[0].record)] == ["LOST"]
    granted(bench.begin("move", "next"))
    for verdict in (
        bench.end("move", "g", token, result="DONE"),
        bench.end("move", "g", 0, EndKind.ERROR),
        bench.begin("move", "g"),
        bench.renew("move", "g", token),
    ):
        assert [verdict] == lost, "its step and its record are those of the loss"
    assert bench.core.states["axes"] == "USED", "what the old process says frees nothing of the new one's"


def test_the_begin_of_a_later_incarnation_takes_what_the_earlier_one_held(bench: Bench) -> None:
    granted(bench.begin("move", "g", incarnation="first"))
    granted(bench.begin("move", "next", incarnation="second"))
    assert [each.goal_id for each in bench.of(Lost)] == ["g"]
    with pytest.raises(RefusedError) as refusal:
        bench.begin("move", "late", incarnation="first")
    assert refusal.value.code is ErrorCode.REPLACED
    assert [grant.goal_id for grant in bench.core.grants] == ["next"]


def test_an_incarnation_that_attaches_again_loses_nothing(bench: Bench) -> None:
    granted(bench.begin("move", "g", incarnation="first"))
    for manager, incarnation in (("skill/move", "first"), ("skill/shine", "other")):
        request = AttachManager(manager=manager, incarnation=incarnation)
        bench.perform(bench.core.step(request, 0.0))
    assert bench.core.states["axes"] == "USED"
    bench.perform(bench.core.step(AttachManager(manager="skill/move", incarnation="second"), 0.0))
    assert bench.core.states["axes"] == "FREE"


def test_a_goal_given_up_before_its_begin_arrives_is_never_granted(bench: Bench) -> None:
    assert isinstance(bench.end("move", "g", 0, EndKind.ERROR), Ended)
    assert isinstance(bench.begin("move", "g"), Ended)
    assert bench.core.states["axes"] == "FREE"


def test_a_goal_given_up_without_its_token_is_freed_all_the_same(bench: Bench) -> None:
    bench.begin("move", "g", incarnation="this")
    assert isinstance(bench.end("move", "g", 0, EndKind.ERROR, incarnation="this"), Ended)
    assert bench.core.states["axes"] == "FREE"


@pytest.mark.parametrize("attached", [True, False])
def test_a_goal_of_the_successor_is_not_given_up_by_a_process_without_its_token(bench: Bench, attached: bool) -> None:
    if attached:
        bench.perform(bench.core.step(AttachManager(manager="skill/move", incarnation="first"), 0.0))
    granted(bench.begin("move", "g", incarnation="second"))
    for incarnation in ("first", ""):
        with pytest.raises(RefusedError) as refusal:
            bench.end("move", "g", 0, EndKind.ERROR, incarnation=incarnation)
        assert refusal.value.code is ErrorCode.STALE_TOKEN
    assert bench.core.states["axes"] == "USED"


def test_a_renewal_tells_how_the_goal_stands(bench: Bench) -> None:
    grant = granted(bench.begin("move", "g"))
    assert bench.renew("move", "g", grant.token) == grant
    ended = bench.end("move", "g", grant.token, result="DONE")
    assert bench.renew("move", "g", grant.token) == ended
    for skill, goal_id, token, code in (
        ("move", "g2", grant.token, ErrorCode.UNKNOWN_GOAL),
        ("fly", "g", grant.token, ErrorCode.UNKNOWN_NAME),
        ("watch", "g", grant.token, ErrorCode.BAD_REQUEST),
    ):
        with pytest.raises(RefusedError) as refusal:
            bench.renew(skill, goal_id, token)
        assert refusal.value.code is code
        assert (skill if code is ErrorCode.UNKNOWN_NAME else goal_id) in refusal.value.message
    assert bench.of(Lost) == []


def test_a_renewal_with_another_token_is_refused(bench: Bench) -> None:
    bench.now = 1.0
    token = granted(bench.begin("move", "g")).token
    for wrong in (token - 1, token + 1):
        with pytest.raises(RefusedError, match="g was granted with") as refusal:
            bench.renew("move", "g", wrong)
        assert refusal.value.code is ErrorCode.STALE_TOKEN
    assert bench.core.states["axes"] == "USED"


def test_a_successor_learns_that_its_predecessors_goal_was_lost(bench: Bench) -> None:
    bench.now = 1.0
    first = granted(bench.begin("move", "g", incarnation="first"))
    bench.now = 2.0
    verdict = bench.begin("move", "g", incarnation="second")
    assert isinstance(verdict, Lost)
    assert (verdict.goal_id, verdict.skill, verdict.token, verdict.t) == ("g", "move", first.token, 2.0)
    assert verdict.reason == "The manager `skill/move` was lost: another process has taken its place."
    [record] = bench.of(Record, lambda record: record.id == verdict.record)
    assert (record.after, record.goal_id, record.text) == ("LOST", "g", verdict.reason)
    assert record.cause is None, "the grant lost nothing"
    assert bench.core.states["axes"] == "FREE"
    assert bench.begin("move", "g", incarnation="first") == verdict


def test_a_replaced_process_that_asks_for_its_successors_goal_takes_nothing(bench: Bench) -> None:
    bench.attach("skill/move", "first")
    second = granted(bench.begin("move", "g", incarnation="second"))
    with pytest.raises(RefusedError) as refusal:
        bench.begin("move", "g", incarnation="first")
    assert refusal.value.code is ErrorCode.REPLACED
    assert bench.of(Lost) == []
    assert bench.begin("move", "g", incarnation="second") == second
    third = bench.begin("move", "g", incarnation="third")
    assert isinstance(third, Lost)
    assert bench.kept[-1] == FinishedGoal("g", "move", second.token, third)
    assert ManagerEntry("skill/move", "third") in bench.kept


def test_the_same_process_and_one_that_does_not_tell_get_the_same_grant_again(bench: Bench) -> None:
    first = granted(bench.begin("move", "g", incarnation="first"))
    assert bench.begin("move", "g", incarnation="first") == first
    assert bench.begin("move", "g") == first
    assert bench.begin("move", "g", manager="another", incarnation="second") == first
    assert bench.of(Lost) == []


def test_each_incarnation_is_noted_once_and_a_replaced_one_cannot_come_back(bench: Bench) -> None:
    for incarnation in ("first", "first", "second", "second"):
        states = bench.attach("skill/move", incarnation)
        assert (states.states, states.step) == (dict(bench.core.states), bench.core.last_step)
    bench.attach("skill/watch", "first")
    assert bench.kept == [
        ManagerEntry("skill/move", "first"),
        ManagerEntry("skill/move", "second"),
        ManagerEntry("skill/watch", "first"),
    ]
    with pytest.raises(RefusedError, match="place of this `skill/move`") as refusal:
        bench.attach("skill/move", "first")
    assert refusal.value.code is ErrorCode.REPLACED
    bench.attach("skill/watch", "first")
