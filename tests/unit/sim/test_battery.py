"""The battery: voltage falls with charge and load, and charge with current."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from skillwing.sim_mujoco.physics.battery import CAPACITY, CELLS, PACKS, BatteryModel, open_circuit_voltage

HOVER = 137.3
charges = st.floats(0.0, 100.0)


@given(charges, charges)
def test_a_fuller_battery_has_the_higher_voltage_and_no_cell_leaves_its_range(one: float, other: float) -> None:
    low, high = (open_circuit_voltage(percent / 100.0) for percent in sorted((one, other)))
    assert 2.6 * CELLS < low <= high < 4.2 * CELLS


@given(st.floats(5.0, 100.0), st.floats(0.0, 300.0), st.floats(0.0, 300.0))
def test_more_thrust_takes_more_current_and_sags_more(percent: float, one: float, other: float) -> None:
    gentle, strong = BatteryModel(percent), BatteryModel(percent)
    gentle.drain(min(one, other), 0.01)
    strong.drain(max(one, other), 0.01)
    assert gentle.current <= strong.current
    assert open_circuit_voltage(percent / 100.0) > gentle.voltage >= strong.voltage > 0.0


@given(st.floats(20.0, 100.0), st.floats(0.0, 200.0))
def test_the_percentage_counts_the_charge_that_has_flowed(percent: float, thrust: float) -> None:
    battery = BatteryModel(percent)
    flowed = 0.0
    for _ in range(20):
        battery.drain(thrust, 0.5)
        flowed += battery.current * 0.5
    assert battery.percent == pytest.approx(percent - 100.0 * flowed / CAPACITY)


def test_a_full_battery_hovers_for_about_twenty_minutes_and_then_is_empty() -> None:
    battery, t = BatteryModel(), 0.0
    while not battery.is_empty:
        battery.drain(HOVER, 1.0)
        t += 1.0
    assert 18 * 60 < t < 24 * 60
    assert battery.percent == 0.0
    battery.drain(HOVER, 1.0)
    assert battery.percent == 0.0


@given(st.floats(20.0, 100.0), st.integers(1, PACKS - 1), st.floats(50.0, 150.0))
def test_packs_that_fail_take_their_charge_along_and_the_others_carry_the_load(
    percent: float, packs: int, thrust: float
) -> None:
    whole, broken = BatteryModel(percent), BatteryModel(percent)
    broken.fail(packs)
    assert broken.percent == pytest.approx(percent * (1.0 - packs / PACKS))
    left = broken.percent
    for battery in (whole, broken):
        battery.drain(thrust, 1.0)
    assert broken.voltage < whole.voltage
    assert broken.percent == pytest.approx(left - 100.0 * broken.current / CAPACITY)


@pytest.mark.parametrize("fail", [[0], [PACKS], [3, 3]])
def test_one_pack_at_least_is_left(fail: list[int]) -> None:
    battery = BatteryModel()
    *first, last = fail
    for packs in first:
        battery.fail(packs)
    with pytest.raises(ValueError, match="has to be left"):
        battery.fail(last)


@pytest.mark.parametrize("percent", [-1.0, 100.1, float("nan")])
def test_no_battery_holds_less_than_nothing_or_more_than_all(percent: float) -> None:
    with pytest.raises(ValueError, match="give 0 to 100"):
        BatteryModel(percent)
