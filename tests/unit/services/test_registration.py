"""A manager that was replaced learns of it within a few seconds."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from rig import RIG

from skillwing.dsl import parse
from skillwing.services.bus import Request
from skillwing.services.bus.inprocess import InProcessBus, InProcessNetwork
from skillwing.services.errors import WrongSkillsetError
from skillwing.services.managers.hooks import SkillHooks
from skillwing.services.managers.registration import REGISTRATION_PERIOD, Registration
from skillwing.services.managers.resource_manager import ResourceManagerNode
from skillwing.services.managers.skill_manager import SkillManagerNode
from skillwing.services.protocol import AttachManager, ErrorCode, ErrorReply, Keys, ResourceStates, encode

KEYS = Keys(RIG.name)
THIS = AttachManager(manager="skill/watch", incarnation="this")
TAKEN = encode(ResourceStates(step=0, states={}, t=0.0))
SLACK = 0.01
"""Seconds that messages take."""


class ScriptedResourceManager:
    """A resource manager with scripted answers to `AttachManager`."""

    def __init__(self, network: InProcessNetwork) -> None:
        self._network = network
        self.refuses: ErrorCode | None = None
        self.asked_at: list[float] = []
        network.bus("resource_manager").serve(KEYS.resource_attach, self._answer)

    def _answer(self, request: Request) -> None:
        self.asked_at.append(self._network.now())
        if self.refuses is None:
            request.reply(TAKEN)
        else:
            request.refuse(ErrorReply(code=self.refuses, message="So it is."))

    @property
    def pauses(self) -> list[float]:
        return [later - earlier for earlier, later in zip(self.asked_at, self.asked_at[1:], strict=False)]


def standing(network: InProcessNetwork, on_replaced: Callable[[ErrorReply], None]) -> Registration:
    result = Registration(network.bus("skill/watch"), KEYS, THIS, on_replaced)
    result.ask()
    return result


def test_a_registered_process_asks_again_periodically() -> None:
    network = InProcessNetwork()
    judge, replaced = ScriptedResourceManager(network), list[ErrorReply]()
    standing(network, replaced.append)
    network.run_for(4.5 * REGISTRATION_PERIOD)
    assert judge.pauses == [pytest.approx(REGISTRATION_PERIOD, abs=SLACK)] * 4
    assert replaced == []


def test_a_replaced_process_is_notified_once_and_stops_asking() -> None:
    network = InProcessNetwork()
    judge, replaced = ScriptedResourceManager(network), list[ErrorReply]()
    mine = standing(network, replaced.append)
    network.run_for(1.0)
    judge.refuses = ErrorCode.REPLACED
    mine.ask()
    mine.ask()
    network.run_for(3 * REGISTRATION_PERIOD)
    assert [error.code for error in replaced] == [ErrorCode.REPLACED]
    asked = len(judge.asked_at)
    mine.ask()
    network.run_for(3 * REGISTRATION_PERIOD)
    assert len(judge.asked_at) == asked


def test_what_cannot_be_written_down_is_asked_again_with_growing_pauses() -> None:
    network = InProcessNetwork()
    judge, replaced = ScriptedResourceManager(network), list[ErrorReply]()
    judge.refuses = ErrorCode.UNAVAILABLE
    standing(network, replaced.append)
    network.run_for(5.0)
    expected = [0.05, 0.1, 0.2, 0.4, 0.8, 1.0, 1.0]
    assert judge.pauses[: len(expected)] == pytest.approx(expected, abs=SLACK)
    judge.refuses = None
    network.run_for(1.0 + SLACK)
    asked = len(judge.asked_at)
    network.run_for(REGISTRATION_PERIOD - 2 * SLACK - 1.0)
    assert len(judge.asked_at) == asked, "once it is written down there is no haste"
    assert replaced == []


def test_any_other_refusal_is_no_reason_to_hurry() -> None:
    network = InProcessNetwork()
    judge = ScriptedResourceManager(network)
    judge.refuses = ErrorCode.BAD_REQUEST
    standing(network, lambda error: None)
    network.run_for(2.5 * REGISTRATION_PERIOD)
    assert judge.pauses == [pytest.approx(REGISTRATION_PERIOD, abs=SLACK)] * 2


def test_a_refusal_is_logged_once_until_it_has_ended(caplog: pytest.LogCaptureFixture) -> None:
    network = InProcessNetwork()
    judge = ScriptedResourceManager(network)
    standing(network, lambda error: None)
    for refuses in (ErrorCode.BAD_REQUEST, None, ErrorCode.BAD_REQUEST):
        judge.refuses = refuses
        network.run_for(3 * REGISTRATION_PERIOD)
    warnings = [record.message for record in caplog.records if record.levelname == "WARNING"]
    assert warnings == ["the resource manager has not accepted skill/watch yet: So it is."] * 2


def test_who_gives_up_asks_no_more_even_of_nobody() -> None:
    network = InProcessNetwork()
    mine = standing(network, lambda error: None)
    network.run_for(3.0)
    mine.give_up()
    network.run_for(3.0)
    judge = ScriptedResourceManager(network)
    network.run_for(3 * REGISTRATION_PERIOD)
    assert judge.asked_at == []


class Watch(SkillHooks[dict[str, object], None, None]):
    """A skill without goals."""

    skill = "watch"


def test_an_idle_manager_that_was_replaced_says_so_and_ends(caplog: pytest.LogCaptureFixture) -> None:
    network = InProcessNetwork()
    network.attach(ResourceManagerNode(RIG))
    loser = network.attach(SkillManagerNode(Watch(), RIG))
    assert isinstance(loser, InProcessBus)
    network.run_for(1.0)
    rival = AttachManager(manager="skill/watch", incarnation="that")
    network.bus("rival").ask(KEYS.resource_attach, encode(rival), lambda answer: None)
    network.run_for(REGISTRATION_PERIOD + SLACK)
    assert loser.closed
    assert [record.message for record in caplog.records if record.levelname == "ERROR"] == [
        "Another process has taken the place of this `skill/watch`. This one ends."
    ]


def test_a_manager_of_another_version_of_the_skillset_ends() -> None:
    """The manager would never get a grant. It reports that at its start, and not to a mission hours later."""
    other = parse("skillset rig { skill watch { result { success SEEN } } }", "rig.skillset")
    assert other.name == RIG.name

    class Watch(SkillHooks[None, None, None]):
        skill = "watch"

    network = InProcessNetwork()
    network.attach(ResourceManagerNode(RIG))
    network.attach(SkillManagerNode(Watch(), other))
    with pytest.raises(WrongSkillsetError, match=rf"version {other.schema_hash} of `rig`, .* Start both from the same"):
        network.run_for(1.0)
