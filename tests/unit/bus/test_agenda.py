from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from skillwing.services.bus.agenda import Agenda

times = st.floats(0.0, 100.0)


def nothing() -> None:
    pass


@given(st.lists(times))
def test_entries_come_by_time_and_then_by_order_of_adding(dues: list[float]) -> None:
    agenda, order = Agenda(), list[tuple[float, int]]()
    for number, due in enumerate(dues):
        agenda.add(due, lambda due=due, number=number: order.append((due, number)))
    while (action := agenda.take(1000.0)) is not None:
        action()
    assert order == sorted((due, number) for number, due in enumerate(dues))


@given(st.lists(times), times)
def test_only_what_is_due_is_taken(dues: list[float], now: float) -> None:
    agenda = Agenda()
    for due in dues:
        agenda.add(due, nothing)
    taken = 0
    while agenda.take(now) is not None:
        taken += 1
    assert taken == sum(due <= now for due in dues)
    assert agenda.next_due() == min((due for due in dues if due > now), default=None)


def test_a_cancelled_entry_is_never_taken() -> None:
    agenda = Agenda()
    agenda.add(1.0, nothing).cancel()
    assert agenda.next_due() is None
    assert agenda.take(2.0) is None


def test_periods_do_not_drift() -> None:
    agenda = Agenda()
    agenda.add_periodic(0.0, 0.1, nothing)
    dues: list[float] = []
    for _ in range(1000):
        due = agenda.next_due()
        assert due is not None
        dues.append(due)
        agenda.take(due)
    assert dues == [number * 0.1 for number in range(1, 1001)]


def test_missed_periods_are_left_out() -> None:
    agenda = Agenda()
    agenda.add_periodic(0.0, 1.0, nothing)
    assert agenda.take(3.5) is nothing
    assert agenda.take(3.5) is None
    assert agenda.next_due() == 4.0


def test_a_periodic_entry_can_be_cancelled_by_its_own_action() -> None:
    agenda = Agenda()

    def stop() -> None:
        entry.cancel()

    entry = agenda.add_periodic(0.0, 1.0, stop)
    action = agenda.take(1.0)
    assert action is not None
    action()
    assert agenda.take(10.0) is None


@pytest.mark.parametrize("period", [0.0, -1.0])
def test_a_period_has_to_be_longer_than_zero(period: float) -> None:
    with pytest.raises(ValueError, match="longer than zero"):
        Agenda().add_periodic(0.0, period, nothing)


def test_setting_the_clock_puts_everything_off() -> None:
    agenda = Agenda()
    agenda.add(2.0, nothing)
    agenda.add_periodic(0.0, 3.0, nothing)
    agenda.shift(100.0)
    assert agenda.take(101.9) is None
    assert agenda.take(102.0) is nothing
    assert agenda.next_due() == 103.0
