"""A client's subscriptions in causal order, on a network whose resource manager may be silent."""

from __future__ import annotations

import pytest

from skillwing.services.bus import Request
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.client.causal_feed import CausalFeed, follow_records
from skillwing.services.protocol import (
    GoalStatus,
    Keys,
    Record,
    RecordKind,
    ResourceStates,
    ResourceStep,
    State,
    encode,
)

KEYS = Keys("rover")


class Managers:
    """A resource manager and a skill manager, by hand."""

    def __init__(self, *, answers: bool = True) -> None:
        self.network = InProcessNetwork()
        resources, skill = self.network.bus("resource_manager"), self.network.bus("skill/drive")
        self._steps = resources.advertise(KEYS.resource_steps, events=True)
        self._status = skill.advertise(KEYS.status("drive"), events=True)
        self.number = 7
        self.asked = 0
        self.silent = not answers
        resources.serve(KEYS.resource_states, self._answer)

    def _answer(self, request: Request) -> None:
        self.asked += 1
        if not self.silent:
            request.reply(encode(ResourceStates(step=self.number, states={"power": "ON"}, t=0.0)))

    def step(self, *, told: bool = True) -> None:
        self.number += 1
        record = Record(
            id=f"rm#{self.number}", t=0.0, source="rm", kind=RecordKind.GOAL, subject="x", before=None, after="y"
        )
        if told:
            self._steps.put(encode(ResourceStep(number=self.number, t=0.0, records=(record,))))

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
    assert ["the resource manager is silent" in each.getMessage() for each in caplog.records] == [True]


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
