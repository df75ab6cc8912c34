"""The mixer gives what is wanted if the rotors can, and what matters most if they cannot."""

from __future__ import annotations

import numpy as np
import pytest
from flight_rig import WORLD
from hypothesis import given
from hypothesis import strategies as st

from skillwing.sim_mujoco.autopilot.mixer import Mixer
from skillwing.sim_mujoco.physics.hexacopter import MAX_THRUST, MIN_THRUST, ROTORS
from skillwing.sim_mujoco.physics.physics import Physics

AIRFRAME = Physics(WORLD).airframe
WEIGHT = AIRFRAME.mass * 9.81
rotors = st.integers(0, ROTORS - 1)
tilts = st.tuples(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))


def effect(thrusts: list[float]) -> list[float]:
    """Total thrust and torques (4) of rotor thrusts."""
    return (AIRFRAME.allocation @ np.array(thrusts)).tolist()


@given(st.floats(0.8 * WEIGHT, 1.3 * WEIGHT), tilts, st.floats(-0.3, 0.3))
def test_six_rotors_give_thrust_and_torque_as_wanted(total: float, tilt: tuple[float, float], yaw: float) -> None:
    assert effect(Mixer(AIRFRAME).thrusts(total, (*tilt, yaw))) == pytest.approx([total, *tilt, yaw], abs=1e-6)


@given(rotors, st.floats(0.8 * WEIGHT, 1.2 * WEIGHT), tilts, st.floats(-0.5, 0.5))
def test_without_a_rotor_yaw_is_given_up_and_nothing_else(
    rotor: int, total: float, tilt: tuple[float, float], yaw: float
) -> None:
    mixer = Mixer(AIRFRAME)
    mixer.drop(rotor)
    thrusts = mixer.thrusts(total, (*tilt, yaw))
    assert thrusts[rotor] == 0.0
    assert effect(thrusts)[:3] == pytest.approx([total, *tilt], abs=1e-6)


@given(rotors)
def test_without_a_rotor_hovering_turns_the_drone_neither_way(rotor: int) -> None:
    mixer = Mixer(AIRFRAME)
    mixer.drop(rotor)
    assert effect(mixer.thrusts(WEIGHT, (0.0, 0.0, 0.0)))[3] == pytest.approx(0.0, abs=1e-6)


@given(st.none() | rotors, st.floats(0.0, 400.0), st.tuples(*[st.floats(-60.0, 60.0)] * 3))
def test_no_rotor_is_asked_for_what_it_cannot_give(
    rotor: int | None, total: float, torque: tuple[float, float, float]
) -> None:
    mixer = Mixer(AIRFRAME)
    if rotor is not None:
        mixer.drop(rotor)
    thrusts = mixer.thrusts(total, torque)
    assert all(0.0 <= thrust <= MAX_THRUST for thrust in thrusts)
    assert sum(thrust < MIN_THRUST for thrust in thrusts) <= (0 if rotor is None else 2)


@given(tilts)
def test_attitude_comes_before_lift(tilt: tuple[float, float]) -> None:
    wanted = (3.0 * tilt[0], 3.0 * tilt[1], 0.0)
    given_effect = effect(Mixer(AIRFRAME).thrusts(6 * MAX_THRUST, wanted))
    assert given_effect[1:3] == pytest.approx(wanted[:2], abs=1e-6)
