"""A client that loses a goal by itself shows the loss after the states that it has brought about."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from standing_time import BusInStandingTime

from skillwing.dsl import parse
from skillwing.services.bus import Request
from skillwing.services.bus.inprocess import InProcessNetwork, SentMessage
from skillwing.services.client.causal_feed import (
    HOLDS_UNTIL_SHOWN,
    NO_ANSWER,
    SILENCES_UNTIL_SHOWN,
    STILL_HELD,
    CausalFeed,
)
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.mocking import MockRun, MockScript
from skillwing.services.names import RESOURCE_MANAGER
from skillwing.services.protocol import (
    ErrorCode,
    ErrorReply,
    Holder,
    InterruptGoal,
    Keys,
    ReadyReport,
    ResourceStates,
    SkillReady,
    State,
    decode,
    encode,
)
from skillwing.services.testing import SkillsetInProcess

SKILLSET = parse(
    """
    skillset rover {
        resource wheels { initial PARKED  PARKED -> DRIVING  DRIVING -> PARKED }
        skill drive {
            effect { roll: wheels -> DRIVING  park: wheels -> PARKED }
            precondition { parked: resource=(wheels == PARKED)  success roll }
            interrupt { apply=park }
            lost { apply=park }
            result { success ARRIVED: apply=park }
        }
    }
    """,
    "rover.skillset",
)
KEYS = Keys(SKILLSET.name)
DRIVE = "skill/drive"


class Watcher:
    """A client that drives, and notes each end with the states that it shows then."""

    def __init__(self) -> None:
        self.robot = SkillsetInProcess(SKILLSET, script=MockScript(skills={"drive": (MockRun(forever=True),)}))
        self.interface = SkillsetInterface(self.robot.network.bus("watcher"), SKILLSET, client="watcher")
        self.robot.run(1.0)
        self.goal = self.interface.start("drive")
        self.robot.run(0.5)
        assert (self.goal.state, self.interface.states["wheels"]) == (State.RUNNING, "DRIVING")
        self.ends: list[tuple[str, str, bool]] = []
        self.goal.on_change(lambda goal: self._note())

    def _note(self) -> None:
        if self.goal.terminal is not None:
            silent = self.interface.resource_manager_silent
            self.ends.append((self.goal.terminal.label, self.interface.states["wheels"], silent))

    @property
    def reason(self) -> str:
        assert self.goal.terminal is not None
        return self.goal.terminal.reason


@pytest.mark.parametrize("away", [3.0, 4.0])
def test_a_loss_is_shown_after_the_release_of_what_the_goal_held(away: float) -> None:
    """The resource manager is away when its client loses the goal, and releases it only some time after its return."""
    watcher = Watcher()
    watcher.robot.kill(RESOURCE_MANAGER)
    watcher.robot.kill(DRIVE)
    watcher.robot.run(away)
    assert watcher.ends == [], "states from after the loss are unknown"
    watcher.robot.restart(RESOURCE_MANAGER)
    watcher.robot.run(5.0)
    assert watcher.ends == [("LOST", "PARKED", False)]


def test_a_loss_is_shown_without_its_states_if_the_resource_manager_stays_away() -> None:
    watcher = Watcher()
    watcher.robot.kill(RESOURCE_MANAGER)
    watcher.robot.kill(DRIVE)
    watcher.robot.run(60.0)
    assert watcher.ends == [("LOST", "DRIVING", True)]
    assert watcher.reason.endswith(NO_ANSWER)
    watcher.robot.restart(RESOURCE_MANAGER)
    watcher.robot.run(5.0)
    assert (watcher.interface.states["wheels"], watcher.interface.resource_manager_silent) == ("PARKED", False)


def test_a_goal_of_a_manager_that_came_back_before_its_loss_was_shown_is_interrupted() -> None:
    watcher = Watcher()
    robot = watcher.robot
    robot.kill(RESOURCE_MANAGER)
    robot.kill(DRIVE)
    robot.run(3.0)
    robot.restart(DRIVE)
    asked: list[SentMessage] = []
    robot.network.tap = asked.append
    robot.run(30.0)
    assert watcher.ends == [("LOST", "DRIVING", True)]
    asks = [said for said in asked if said.what == "ask"]
    interrupts = [decode(said.payload, InterruptGoal) for said in asks if said.key == KEYS.interrupt("drive")]
    assert {each.cause for each in interrupts} == {watcher.goal.record}, "the record of the end that was shown"


class ReadyDesk:
    """A feed, and a resource manager that answers by hand whether the goal `g` holds its grant.

    Robot time stands still: the mission has to learn of a loss all the same.
    """

    def __init__(self, answer: Callable[[Request], None]) -> None:
        self.network = InProcessNetwork()
        manager = self.network.bus("resource_manager")
        self.asked = 0
        self._answer = answer
        manager.serve(KEYS.resource_ready, self._ready)
        self.refuses_states = self.hides_states = False
        manager.serve(KEYS.resource_states, self._states)
        bus: Any = BusInStandingTime(self.network.bus("client"))
        self.feed = CausalFeed(bus, KEYS)
        self.remarks: list[str] = []
        self.network.run_for(1.0)
        self.lose()

    def lose(self) -> None:
        self.feed.after_release("drive", "g", self.remarks.append)

    def _states(self, request: Request) -> None:
        if self.refuses_states:
            refuse(request)
        elif not self.hides_states:
            request.reply(encode(ResourceStates(step=7, states={"wheels": "PARKED"}, t=0.0)))

    def _ready(self, request: Request) -> None:
        self.asked += 1
        self._answer(request)


def held_by(goal_id: str) -> Callable[[Request], None]:
    running = Holder(skill="drive", goal_id=goal_id)
    report = ReadyReport(step=7, t=0.0, skills=(SkillReady(skill="drive", ready=False, running=running),))
    return lambda request: request.reply(encode(report))


def refuse(request: Request) -> None:
    request.refuse(ErrorReply(code=ErrorCode.BAD_REQUEST, message="A test refuses.", help=""))


@pytest.mark.parametrize("answer", [held_by("g"), refuse, lambda request: request.reply(b"\xc1")])
def test_a_loss_waits_until_a_reply_says_that_its_goal_is_released(answer: Callable[[Request], None]) -> None:
    desk = ReadyDesk(answer)
    desk.network.run_for(HOLDS_UNTIL_SHOWN - 2.0)
    assert desk.remarks == []
    desk.network.run_for(60.0)
    assert (desk.remarks, desk.asked, desk.feed.silent) == ([STILL_HELD], HOLDS_UNTIL_SHOWN, False)


def test_a_loss_is_shown_while_another_goal_holds_the_grant() -> None:
    desk = ReadyDesk(held_by("another"))
    desk.network.run_for(1.0)
    assert (desk.remarks, desk.asked) == ([""], 1)


def test_a_loss_says_that_its_states_are_unknown_if_they_are_refused() -> None:
    desk = ReadyDesk(held_by("another"))
    desk.refuses_states = True
    desk.network.run_for(1.0)
    assert desk.remarks == [NO_ANSWER]


def test_a_loss_says_that_its_states_are_unknown_if_nobody_tells_them() -> None:
    desk = ReadyDesk(held_by("another"))
    desk.hides_states = True
    desk.network.run_for(60.0)
    assert (desk.remarks, desk.feed.silent) == ([NO_ANSWER], True)


def test_a_silent_resource_manager_delays_only_the_first_loss() -> None:
    """The client asks ten times at the first loss. Then one silence is enough, until there is an answer."""
    desk = ReadyDesk(lambda request: None)
    desk.hides_states = True
    desk.network.run_for(60.0)
    assert (desk.remarks, desk.asked, desk.feed.silent) == ([NO_ANSWER], SILENCES_UNTIL_SHOWN, True)
    desk.lose()
    desk.network.run_for(60.0)
    assert (desk.remarks, desk.asked) == ([NO_ANSWER] * 2, SILENCES_UNTIL_SHOWN + 1)
    desk.hides_states = False
    desk.network.run_for(5.0)
    assert not desk.feed.silent, "the states were asked for until there was an answer"
