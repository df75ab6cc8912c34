"""A client's subscriptions in causal order, on a network whose resource manager may be silent."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from standing_time import BusInStandingTime

from faulty_network import FaultyNetwork, NetworkConditions
from skillwing.services.bus import Bus, Request
from skillwing.services.bus.identity import SessionIdentity, signed
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.client.causal_feed import NO_ANSWER, SILENCES_UNTIL_SHOWN, CausalFeed, follow_records
from skillwing.services.names import RESOURCE_MANAGER
from skillwing.services.protocol import (
    ErrorCode,
    ErrorReply,
    GoalStatus,
    Keys,
    QueryStates,
    Record,
    RecordKind,
    ResourceStates,
    ResourceStep,
    State,
    decode,
    encode,
)

KEYS = Keys("rover")


class Managers:
    """A resource manager and a skill manager, by hand."""

    def __init__(self, *, answers: bool = True, network: InProcessNetwork | None = None) -> None:
        self.network = network or InProcessNetwork()
        resources, skill = self.network.bus("resource_manager"), self.network.bus("skill/drive")
        self._steps = resources.advertise(KEYS.resource_steps, events=True)
        self._status = skill.advertise(KEYS.status("drive"), events=True)
        self.number = 7
        self.asked = 0
        self.silent = not answers
        self.refusing = self.unreadable = False
        self.resources = resources
        self.resources.serve(KEYS.resource_states, self._answer)

    def _answer(self, request: Request) -> None:
        decode(request.payload, QueryStates)
        self.asked += 1
        if self.refusing:
            request.refuse(ErrorReply(code=ErrorCode.INTERNAL, message="A test refuses.", help=""))
        elif self.unreadable:
            request.reply(b"{}")
        elif not self.silent:
            request.reply(encode(self.states()))

    def states(self) -> ResourceStates:
        return ResourceStates(step=self.number, states={"power": "ON"}, t=0.0)

    def step(self, *, told: bool = True) -> None:
        self.number += 1
        record = Record(
            id=f"rm#{self.number}", t=0.0, source="rm", kind=RecordKind.GOAL, subject="x", before=None, after="y"
        )
        if told:
            self.tell(ResourceStep(number=self.number, t=0.0, records=(record,)))

    def tell(self, step: ResourceStep) -> None:
        self._steps.put(encode(step))

    def status(self, after_step: int) -> None:
        status = GoalStatus(
            goal_id="g",
            skill="drive",
            state=State.RUNNING,
            t=0.0,
            record="d#1",
            source="skill/drive",
            after_step=after_step,
        )
        self._status.put(encode(status))

    def wait(self, seconds: float = 1.0) -> None:
        self.network.run_for(seconds)


def test_a_lost_step_is_asked_for_and_the_status_is_shown_after_it() -> None:
    managers = Managers()
    seen: list[tuple[int | None, str]] = []
    feed = CausalFeed(
        managers.network.bus("client"), KEYS, on_status=lambda status: seen.append((feed.view.number, status.state))
    )
    managers.wait()
    managers.step(told=False)
    managers.status(8)
    managers.wait()
    assert seen == [(8, "RUNNING")]
    assert managers.asked == 2


def test_nobody_asks_while_nothing_is_missing() -> None:
    managers = Managers()
    CausalFeed(managers.network.bus("client"), KEYS)
    managers.wait()
    managers.step()
    managers.status(8)
    managers.wait(10.0)
    assert managers.asked == 1


def test_a_silent_resource_manager_hides_no_goal(caplog: pytest.LogCaptureFixture) -> None:
    managers = Managers(answers=False)
    seen: list[str] = []
    feed = CausalFeed(managers.network.bus("client"), KEYS, on_status=lambda status: seen.append(status.state))
    assert not feed.silent, "no question has failed yet"
    managers.status(9)
    managers.wait(30.0)
    assert (seen, feed.silent) == (["RUNNING"], True)
    assert caplog.records == [], "nothing was held back"


def test_what_is_held_back_is_shown_with_a_warning_when_nobody_answers(caplog: pytest.LogCaptureFixture) -> None:
    managers = Managers()
    seen: list[str] = []
    feed = CausalFeed(managers.network.bus("client"), KEYS, on_status=lambda status: seen.append(status.state))
    managers.wait()
    managers.silent = True
    managers.status(9)
    managers.wait(0.05)
    assert seen == []
    managers.wait(60.0)
    assert (seen, feed.silent) == (["RUNNING"], True)
    assert [each.getMessage().startswith("the resource manager is silent") for each in caplog.records] == [True]


def test_states_are_asked_for_ten_times_before_a_status_is_shown_without_them() -> None:
    managers = Managers()
    asked: list[int] = []
    feed = CausalFeed(managers.network.bus("client"), KEYS, on_status=lambda status: asked.append(managers.asked))
    managers.wait()
    assert not feed.silent
    managers.silent = True
    managers.status(9)
    managers.wait(60.0)
    assert asked == [1 + SILENCES_UNTIL_SHOWN]
    managers.number, managers.silent = 9, False
    managers.wait(10.0)
    assert (feed.silent, feed.view.number) == (False, 9)


def test_each_missing_step_is_asked_for_once() -> None:
    managers = Managers()
    seen: list[int] = []
    CausalFeed(managers.network.bus("client"), KEYS, on_status=lambda status: seen.append(status.after_step))
    managers.wait()
    for number in (8, 9, 10):
        managers.step(told=False)
        for _ in range(3):
            managers.status(number)
        managers.wait()
        assert managers.asked == number - 6
    assert seen == [8, 8, 8, 9, 9, 9, 10, 10, 10]


def test_nobody_asks_again_while_a_question_is_open() -> None:
    managers = Managers(answers=False)
    CausalFeed(managers.network.bus("client"), KEYS)
    managers.step()
    managers.wait(0.5)
    managers.status(8)
    managers.wait(0.5)
    assert managers.asked == 1, "the first question takes its timeout of 2 s"


def test_a_refused_question_is_asked_again() -> None:
    managers = Managers()
    seen: list[str] = []
    CausalFeed(managers.network.bus("client"), KEYS, on_status=lambda status: seen.append(status.state))
    managers.wait()
    managers.refusing = True
    managers.step(told=False)
    managers.status(8)
    managers.wait()
    assert seen == []
    managers.refusing = False
    managers.wait()
    assert seen == ["RUNNING"]


def test_states_that_cannot_be_read_are_asked_for_again_and_logged_once(caplog: pytest.LogCaptureFixture) -> None:
    managers = Managers()
    called: list[str] = []
    managers.unreadable = True
    feed = CausalFeed(managers.network.bus("client"), KEYS)
    feed.after_step(7, called.append)
    managers.wait()
    assert not feed.view.ready
    assert called == [NO_ANSWER]
    managers.unreadable = False
    managers.wait()
    assert feed.view.ready
    assert len([line for line in caplog.messages if line.startswith("Left out the states of resource_manager")]) == 1


def test_what_waits_for_a_step_is_called_when_its_states_are_known() -> None:
    managers = Managers()
    called: list[tuple[str, int | None]] = []
    feed = CausalFeed(managers.network.bus("client"), KEYS)
    managers.wait()
    feed.after_step(7, lambda remark: called.append((remark, feed.view.number)))
    assert (called, managers.asked) == ([("", 7)], 1), "they are known"
    managers.step(told=False)
    feed.after_step(8, lambda remark: called.append((remark, feed.view.number)))
    managers.wait()
    assert (called[1:], managers.asked) == ([("", 8)], 2)


def test_what_waits_for_the_step_of_a_silent_manager_is_called_with_a_sentence() -> None:
    managers = Managers(answers=False)
    called: list[str] = []
    CausalFeed(managers.network.bus("client"), KEYS).after_step(8, called.append)
    managers.wait(60.0)
    assert called == [NO_ANSWER]


def test_a_reply_to_a_change_that_was_overtaken_is_given_after_its_states() -> None:
    managers = Managers()
    called: list[int | None] = []
    feed = CausalFeed(managers.network.bus("client"), KEYS)
    managers.wait()
    change, question = feed.note_question(), feed.note_question()
    feed.take_states(encode(ResourceStates(step=8, states={"power": "ON"}, t=0.0)), question)
    managers.number = 9
    feed.take_change(encode(managers.states()), change, lambda: called.append(feed.view.number))
    assert called == [], "the reply to the later question does not hold the change"
    managers.wait()
    assert (called, managers.asked) == ([9], 2)


def test_a_reply_to_a_change_that_cannot_be_read_is_given_at_once() -> None:
    managers = Managers()
    called: list[str] = []
    feed = CausalFeed(managers.network.bus("client"), KEYS)
    feed.take_change(b"{}", feed.note_question(), lambda: called.append("given"))
    assert called == ["given"]


def test_a_callback_that_raises_keeps_no_message_back() -> None:
    managers = Managers()
    seen: list[int | str] = []

    def take(status: GoalStatus) -> None:
        seen.append(status.after_step)
        if len(seen) == 1:
            raise ValueError("a listener of a test")

    CausalFeed(managers.network.bus("client"), KEYS, on_status=take, on_change=lambda: seen.append("states"))
    managers.wait()
    seen.clear()
    managers.step(told=False)
    for _ in range(3):
        managers.status(8)
    with pytest.raises(ValueError, match="a listener of a test"):
        managers.wait()
    managers.wait()
    assert seen == [8, 8, 8, "states"]


def test_a_step_that_nobody_has_taken_costs_one_question() -> None:
    managers = Managers()
    steps: list[int] = []
    feed = CausalFeed(managers.network.bus("client"), KEYS, on_step=lambda step: steps.append(step.number))
    managers.wait()
    managers.tell(ResourceStep(number=2**50, t=0.0))
    managers.wait(10.0)
    assert (managers.asked, steps, feed.view.number) == (2, [2**50], 7)


def test_a_resource_manager_that_returns_is_asked_for_its_states() -> None:
    managers = Managers()
    managers.resources.declare_alive(KEYS.alive(RESOURCE_MANAGER)).cancel()
    feed = CausalFeed(managers.network.bus("client"), KEYS)
    managers.wait()
    managers.step(told=False)
    managers.wait()
    assert (managers.asked, feed.view.number) == (1, 7), "nothing shows that a step is missing"
    token = managers.resources.declare_alive(KEYS.alive(RESOURCE_MANAGER))
    managers.wait()
    assert (managers.asked, feed.view.number) == (2, 8)
    managers.resources.declare_alive(KEYS.alive(RESOURCE_MANAGER))
    token.cancel()
    managers.wait()
    assert managers.asked == 2, "it has not been away"


def test_a_change_of_the_states_is_reported_once_after_its_messages() -> None:
    managers = Managers()
    told: list[str] = []
    feed = CausalFeed(
        managers.network.bus("client"),
        KEYS,
        on_step=lambda step: told.append(f"step {step.number}"),
        on_status=lambda status: told.append(f"status {status.after_step}"),
        on_change=lambda: told.append(f"states {feed.view.number}"),
    )
    managers.wait()
    managers.status(8)
    managers.wait(0.05)
    managers.step()
    managers.wait()
    managers.status(8)
    managers.wait()
    assert told == ["states 7", "step 8", "status 8", "states 8", "status 8"]


def test_a_lost_step_is_asked_for_although_robot_time_stands_still() -> None:
    managers = Managers()
    seen: list[str] = []
    bus: Any = BusInStandingTime(managers.network.bus("client"))
    CausalFeed(bus, KEYS, on_status=lambda status: seen.append(status.state))
    managers.wait()
    managers.step(told=False)
    managers.status(8)
    managers.wait()
    assert seen == ["RUNNING"]


def test_a_network_that_loses_messages_costs_no_record_and_no_status() -> None:
    managers = Managers(network=FaultyNetwork(conditions=NetworkConditions(loss=0.4)))
    records: list[str] = []
    statuses: list[int] = []
    follow_records(
        managers.network.bus("client"),
        KEYS,
        lambda record: records.append(record.id),
        lambda status: statuses.append(status.after_step),
    )
    timeline = managers.network.bus("mission").advertise(KEYS.timeline, events=True)
    for number in range(8, 28):
        managers.step()
        managers.status(number)
        timeline.put(
            encode(
                Record(id=f"m#{number}", t=0.0, source="m", kind=RecordKind.MISSION, subject="m", before=None, after="")
            )
        )
        managers.wait(0.2)
    managers.wait(30.0)
    assert statuses == list(range(8, 28))
    assert [each for each in records if each.startswith("rm")] == [f"rm#{number}" for number in range(8, 28)]
    assert [each for each in records if each.startswith("m")] == [f"m#{number}" for number in range(8, 28)]


def test_records_come_from_steps_statuses_and_the_timeline_once_each() -> None:
    managers = Managers()
    records: list[str] = []
    follow_records(managers.network.bus("client"), KEYS, lambda record: records.append(record.id))
    managers.wait()
    managers.status(8)
    managers.step()
    managers.network.bus("mission").advertise(KEYS.timeline, events=True).put(
        encode(Record(id="m#1", t=0.0, source="m", kind=RecordKind.MISSION, subject="m", before=None, after="RUNNING"))
    )
    managers.wait()
    assert sorted(records) == ["d#1", "m#1", "rm#8"]
    assert records.index("rm#8") < records.index("d#1"), "causes come before effects"


class KnownBus:
    """A bus of somebody with keys, on a network without."""

    identity = SessionIdentity("alice", Path("keys"))

    def __init__(self, bus: Bus) -> None:
        self._bus = bus

    def __getattr__(self, name: str) -> Any:
        return getattr(self._bus, name)


def test_with_keys_a_record_has_the_name_of_its_writer() -> None:
    managers = Managers()
    sources: dict[str, str] = {}
    bus: Any = KnownBus(managers.network.bus("client"))
    follow_records(bus, KEYS, lambda record: sources.update({record.id: record.source}))

    def write(writer: str, record_id: str, source: str) -> None:
        record = Record(
            id=record_id, t=0.0, source=source, kind=RecordKind.MISSION, subject="m", before=None, after="RUNNING"
        )
        managers.network.bus(record_id).advertise(signed(KEYS.timeline, writer), events=True).put(encode(record))

    write("bob", "bob~m#1", "resource_manager")
    write("bob", "rm#9", "bob~m")
    write("rover.mission", "m#1", "mission")
    managers.network.bus("carol").advertise(KEYS.timeline, events=True).put(b"unsigned")
    managers.wait()
    assert sources == {"bob~m#1": "bob", "m#1": "mission"}
