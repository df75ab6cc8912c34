"""Attribution: the name of a certificate takes the place of the one that a sender gives."""

from __future__ import annotations

import pytest
from msgspec.structs import replace

from skillwing.services.core.attribution import attributed, vouched
from skillwing.services.core.refusal import RefusedError
from skillwing.services.protocol import (
    AttachManager,
    BeginGoal,
    EndGoal,
    Ending,
    EndKind,
    ErrorCode,
    FireEvent,
    FireExtern,
    InterruptGoal,
    Message,
    ModifyGoal,
    QueryStates,
    Record,
    RecordKind,
    RecordOutcome,
    RenewGoal,
    StartGoal,
    StartMission,
    Terminal,
)

START = StartGoal(goal_id="g", inputs={}, client="bob", schema="")


def test_without_a_name_nothing_changes() -> None:
    assert attributed(START, None) is START


def test_the_name_of_the_certificate_counts() -> None:
    assert attributed(START, "alice").client == "alice (bob)"
    assert attributed(InterruptGoal(goal_id="g", client="alice"), "alice").client == "alice"
    assert attributed(FireExtern(resource="r", target="X", source="bridge"), "m600.bridge").source == "m600.bridge"
    assert attributed(QueryStates(), "alice") == QueryStates()


@pytest.mark.parametrize(
    ("request_", "field"),
    [
        (START, "client"),
        (InterruptGoal(goal_id="g", client="bob"), "client"),
        (ModifyGoal(goal_id="g", request_id="m", inputs={}, client="bob", schema=""), "client"),
        (StartMission(request_id="m", mission="patrol", client="bob"), "client"),
        (FireExtern(resource="r", target="X", source="bob"), "source"),
        (FireEvent(event="storm", source="bob"), "source"),
    ],
)
def test_every_request_of_a_person_gets_the_name_and_keeps_the_rest(request_: Message, field: str) -> None:
    assert attributed(request_, "alice") == replace(request_, **{field: "alice (bob)"})


@pytest.mark.parametrize("given", ["", "bob) asked by (x", "a b", "x" * 41])
def test_what_could_be_mistaken_for_a_name_is_left_out(given: str) -> None:
    assert attributed(InterruptGoal(goal_id="g", client=given), "alice").client == "alice"


@pytest.mark.parametrize("owner", ["client/alice", "client/alice~cli-1"])
def test_an_own_owner_is_accepted(owner: str) -> None:
    request = StartGoal(goal_id="g", inputs={}, client="x", schema="", owner=owner)
    assert attributed(request, "alice").owner == owner


@pytest.mark.parametrize("owner", ["client/bob", "client/alice2", "client/alice-1", "mission"])
def test_an_owner_of_somebody_else_is_refused(owner: str) -> None:
    request = StartGoal(goal_id="g", inputs={}, client="x", schema="", owner=owner)
    with pytest.raises(RefusedError) as refused:
        attributed(request, "alice")
    assert (refused.value.code, refused.value.message, refused.value.help) == (
        ErrorCode.DENIED,
        f"`alice` gives `{owner}` as the owner of a goal, which belongs to somebody else.",
        "Give `client/alice` or no owner.",
    )


BEGIN = BeginGoal(goal_id="g", skill="land", inputs={}, manager="skill/land", owner="x", schema="")
OUTCOME = RecordOutcome(
    goal_id="g",
    skill="land",
    terminal=Terminal(ending=Ending.BUSY, reason="It runs another."),
    manager="skill/land",
    incarnation="i",
)


@pytest.mark.parametrize(
    "request_",
    [
        AttachManager(manager="skill/land", incarnation="i"),
        BEGIN,
        EndGoal(goal_id="g", skill="land", token=1, how=EndKind.ERROR),
        RenewGoal(goal_id="g", skill="land", token=1),
        OUTCOME,
        replace(OUTCOME, manager="skill/goto"),
        replace(BEGIN, manager="skill/goto"),
    ],
)
def test_a_manager_asks_for_its_own_skill_only(request_: BeginGoal) -> None:
    """The manager that a request names is its asker, and so is the one of the skill that it is about."""
    foreign = isinstance(request_, BeginGoal | RecordOutcome) and request_.manager != "skill/land"
    if not foreign:
        assert attributed(request_, "m600.skill.land") == request_
    for other in ("m600.skill.goto", "m600.bridge", "skill.land", "alice", "m600.x.skill.land"):
        with pytest.raises(RefusedError) as refused:
            attributed(request_, other)
        assert refused.value.code is ErrorCode.DENIED
        assert refused.value.message.startswith(f"`{other}` asks in the name of `skill/")
        assert refused.value.help == "A manager asks for its own skill only."


def record(record_id: str, source: str) -> Record:
    return Record(id=record_id, t=0.0, source=source, kind=RecordKind.GOAL, subject="land", before=None, after="LOST")


def test_a_record_has_the_name_of_its_writer_as_its_source() -> None:
    own = [(record("skill/land~1#1", "skill/land"), "m600.skill.land"), (record("alice~m#1", "alice~m"), "alice")]
    for each, writer in own:
        assert vouched(each, writer) is each
    forged = vouched(record("alice~m#1", "resource_manager"), "alice")
    assert forged is not None
    assert forged.source == "alice"
    foreign = vouched(record("x#1", "skill/goto"), "m600.skill.land")
    assert foreign is not None
    assert foreign.source == "m600.skill.land"


@pytest.mark.parametrize("record_id", ["resource_manager~1#1", "alice2~1#1", "bob~1#1", "fault/zed/blackout@1.000"])
def test_a_person_takes_no_id_of_others(record_id: str) -> None:
    assert vouched(record(record_id, "alice~m"), "alice") is None
