"""Leases that run out, as seen by a process that may not have been listening."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rig import RIG

from skillwing.services.bus import Handle
from skillwing.services.bus.inprocess import InProcessBus, InProcessNetwork
from skillwing.services.bus.reading import message_reader
from skillwing.services.core.leases import LONGEST_PAUSE, LOOK_PERIOD, RECOVERY, Expired, Leases
from skillwing.services.journal.errors import JournalWriteError
from skillwing.services.journal.journal import Journal
from skillwing.services.managers.lease_watch import LeaseWatch
from skillwing.services.managers.leased_core import GRANT_LEASE
from skillwing.services.managers.liveliness_monitor import LOSS_DEBOUNCE, LivelinessMonitor
from skillwing.services.managers.resource_manager import WRITE_AGAIN, ResourceManagerNode
from skillwing.services.protocol import BeginGoal, Keys, Lost, encode

KEYS = Keys(RIG.name)


def look_until(leases: Leases, begin: float, end: float, *, hearing: bool = True) -> list[tuple[str, float]]:
    """Look as often as one has to; returns whose lease ran out, and when."""
    now, found = begin, []
    while now < end:
        found += [(expired.key, now) for expired in leases.look(now, hearing=hearing)]
        delay = leases.next_look(now)
        now += LOOK_PERIOD if delay is None else delay
    return found


def test_a_lease_that_nobody_renews_runs_out_once() -> None:
    leases = Leases()
    leases.begin("g", 2.0, 10.0)
    [(key, when)] = look_until(leases, 10.0, 20.0)
    assert key == "g"
    assert 12.0 <= when < 12.01


def test_the_silence_is_reported() -> None:
    leases = Leases()
    leases.begin("g", 0.5, 0.0)
    [expired] = leases.look(0.75, hearing=True)
    assert expired.silence == 0.75


def test_a_lease_that_is_extended_runs_from_its_beginning_and_is_never_cut_short() -> None:
    leases = Leases()
    leases.begin("g", 1.0, 10.0)
    leases.extend("g", 4.0)
    leases.extend("g", 2.0)
    leases.extend("unknown", 2.0)
    [(key, when)] = look_until(leases, 10.0, 20.0)
    assert key == "g"
    assert 14.0 <= when < 14.01


@given(st.lists(st.floats(0.1, 1.9), min_size=1, max_size=20))
def test_a_renewed_lease_is_kept(gaps: list[float]) -> None:
    leases, now = Leases(), 0.0
    leases.begin("g", 2.0, now)
    for gap in gaps:
        assert look_until(leases, now, now + gap) == []
        now += gap
        leases.renew("g", 2.0, now)
    assert "g" in leases


def test_a_renewal_gives_nothing_to_whom_nothing_was_given() -> None:
    leases = Leases()
    leases.renew("g", 2.0, 0.0)
    assert leases.keys == ()
    assert leases.next_look(0.0) is None


def test_the_first_lease_may_be_longer_than_the_next() -> None:
    leases = Leases()
    leases.begin("g", 6.0, 0.0)
    assert look_until(leases, 0.0, 5.0) == []
    leases.renew("g", 2.0, 5.0)
    [(_, when)] = look_until(leases, 5.0, 20.0)
    assert 7.0 <= when < 7.01


@given(st.floats(0.0, 60.0))
def test_nobody_is_silent_while_we_are_cut_off(seconds: float) -> None:
    leases = Leases()
    leases.begin("g", 2.0, 0.0)
    assert look_until(leases, 0.0, seconds, hearing=False) == []
    assert "g" in leases


def test_after_we_were_cut_off_the_others_get_the_time_to_come_back_and_a_whole_lease() -> None:
    leases = Leases()
    leases.begin("g", 2.0, 0.0)
    look_until(leases, 0.0, 10.0, hearing=False)
    [(_, when)] = look_until(leases, 10.0, 20.0)
    assert 11.5 + RECOVERY <= when <= 12.1 + RECOVERY


def test_after_we_did_not_run_ourselves_nobody_is_blamed() -> None:
    leases = Leases()
    leases.begin("g", 2.0, 0.0)
    assert leases.look(0.25, hearing=True) == ()
    assert leases.look(0.25 + LONGEST_PAUSE + 5.0, hearing=True) == ()
    assert "g" in leases


def test_without_a_lease_nothing_has_expired() -> None:
    leases = Leases()
    assert leases.look(1000.0, hearing=True) == ()
    leases.begin("g", 2.0, 2000.0)
    [(_, when)] = look_until(leases, 2000.25, 2010.0)
    assert when < 2002.01


def test_an_idle_time_without_leases_is_no_pause() -> None:
    leases = Leases()
    leases.begin("g", 2.0, 1000.0)
    [(_, when)] = look_until(leases, 1000.25, 1010.0)
    assert when < 1002.01


def test_a_lease_runs_out_at_its_very_end_and_tells_the_whole_silence() -> None:
    leases = Leases()
    leases.begin("g", 1.0, 100.0)
    leases.begin("h", 3.0, 100.5)
    assert leases.look(100.75, hearing=True) == ()
    assert leases.look(100.999, hearing=True) == ()
    assert leases.look(101.0, hearing=True) == (Expired("g", 1.0),)
    assert leases.keys == ("h",)


def test_a_look_is_due_when_the_first_lease_ends_and_never_later_than_pauses_have_to_show() -> None:
    leases = Leases()
    leases.begin("g", 1.0, 100.0)
    leases.begin("h", 9.0, 100.0)
    assert leases.next_look(100.0) == LOOK_PERIOD
    assert leases.next_look(100.9) == pytest.approx(0.1)
    assert 0.0 < (leases.next_look(102.0) or 0.0) < 0.01


def test_a_second_between_two_looks_is_no_pause_yet() -> None:
    leases = Leases()
    leases.begin("g", 0.5, 100.0)
    assert leases.look(100.0 + LONGEST_PAUSE, hearing=True) == (Expired("g", LONGEST_PAUSE),)


def test_a_lease_that_was_given_back_does_not_run_out() -> None:
    leases = Leases()
    leases.begin("g", 1.0, 0.0)
    leases.begin("h", 1.0, 0.0)
    for _ in range(2):
        leases.end("g")
    assert leases.keys == ("h",)
    assert "g" not in leases
    assert [key for key, _ in look_until(leases, 0.0, 5.0)] == ["h"]


# --- on the bus ------------------------------------------------------------------------------------------------------


def test_a_lease_runs_out_although_the_robots_clock_stands_still(monkeypatch: pytest.MonkeyPatch) -> None:
    right = InProcessBus.after

    def after(self: InProcessBus, delay: float, action: Callable[[], None], *, wall: bool = False) -> object:
        return right(self, delay, action) if wall else None

    monkeypatch.setattr(InProcessBus, "after", after)
    network, expired = InProcessNetwork(), list[Expired]()
    LeaseWatch(network.bus("watch"), expired.append).begin("g", 2.0)
    network.run_for(10.0)
    assert [each.key for each in expired] == ["g"]


@pytest.mark.parametrize("from_outside", [True, False])
def test_who_is_heard_through_the_router_is_not_blamed_while_there_is_none(
    monkeypatch: pytest.MonkeyPatch, from_outside: bool
) -> None:
    monkeypatch.setattr(InProcessBus, "routed", False)
    network, expired = InProcessNetwork(), list[Expired]()
    LeaseWatch(network.bus("watch"), expired.append, from_outside=from_outside).begin("g", 2.0)
    network.run_for(10.0)
    assert [each.key for each in expired] == ([] if from_outside else ["g"])


def test_who_was_here_and_went_is_missed_again_when_he_is_expected() -> None:
    network, gone = InProcessNetwork(), list[str]()
    presence = LivelinessMonitor(network.bus("watch"), KEYS, "**", gone.append)
    token = network.bus("skill/watch").declare_alive(KEYS.alive("skill/watch"))
    network.run_for(0.5)
    presence.expect("skill/watch")
    network.run_for(3.0)
    assert gone == [], "who is here is not missed"
    token.cancel()
    network.run_for(LOSS_DEBOUNCE + 0.1)
    assert gone == ["skill/watch"]
    presence.expect("skill/watch")
    network.run_for(LOSS_DEBOUNCE + 0.1)
    assert gone == ["skill/watch"] * 2


def test_the_grace_of_a_goal_counts_that_comes_after_its_owner_has_vanished() -> None:
    network, gone, grace = InProcessNetwork(), list[str](), 0.0
    presence = LivelinessMonitor(network.bus("watch"), KEYS, "**", gone.append, grace=lambda process: grace)
    token = network.bus("mission").declare_alive(KEYS.alive("client/m"))
    network.run_for(0.5)
    token.cancel()
    network.run_for(0.5)
    grace = 3.0
    presence.expect("client/m")
    network.run_for(LOSS_DEBOUNCE + 2.0)
    assert gone == []
    network.run_for(1.0)
    assert gone == ["client/m"]


# --- losses that cannot be written down at first ---------------------------------------------------------------------


class Holder:
    """A manager that is granted a goal and renews nothing, beside a resource manager."""

    def __init__(self, dispatch_timeout: float) -> None:
        skillset = replace(RIG, skills=tuple(replace(each, dispatch_timeout=dispatch_timeout) for each in RIG.skills))
        self.network = InProcessNetwork()
        self.network.attach(ResourceManagerNode(skillset))
        self.lost: list[Lost] = []
        bus = self.network.bus("skill/watch")
        bus.subscribe(KEYS.verdict("watch"), message_reader(Lost, self.lost.append), events=True)
        self.token: Handle = bus.declare_alive(KEYS.alive("skill/watch"))
        begin = BeginGoal(
            goal_id="g", skill="watch", inputs={}, manager="skill/watch", owner="test", schema=skillset.schema_hash
        )
        bus.ask(KEYS.resource_goal, encode(begin), lambda answer: None)
        self.network.run_for(0.1)

    def run_with_a_full_disk(self, monkeypatch: pytest.MonkeyPatch, seconds: float) -> None:
        def fail(*arguments: object) -> None:
            raise JournalWriteError(Path("journal.sqlite"), "The disk is full.")

        with monkeypatch.context() as disk:
            disk.setattr(Journal, "write", fail)
            self.network.run_for(seconds)
        assert self.lost == []


def test_a_silence_that_could_not_be_written_down_is_written_as_soon_as_it_can_be(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    holder = Holder(dispatch_timeout=0.5)
    holder.run_with_a_full_disk(monkeypatch, GRANT_LEASE + 0.5 * WRITE_AGAIN)
    holder.network.run_for(WRITE_AGAIN)
    [lost] = holder.lost
    assert lost.goal_id == "g"
    assert "silent" in lost.reason


def test_a_manager_whose_loss_could_not_be_written_down_is_lost_as_soon_as_it_can_be(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    holder = Holder(dispatch_timeout=60.0)
    holder.token.cancel()
    holder.run_with_a_full_disk(monkeypatch, 1.5 * LOSS_DEBOUNCE)
    holder.network.run_for(LOSS_DEBOUNCE)
    [lost] = holder.lost
    assert lost.goal_id == "g"
    assert "alive token" in lost.reason
