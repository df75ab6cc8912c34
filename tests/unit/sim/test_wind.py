"""The wind: eddies as strong as the specification says, gusts that swell and end, the same for the same seed."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from skillwing.onboard.frames.vectors import norm
from skillwing.sim_mujoco.physics.wind import Eddies, Gust, Turbulence, Wind

NO_WIND = (0.0, 0.0, 0.0)


def blow(wind: Wind, seconds: float = 20.0) -> list[tuple[float, float, float]]:
    return [wind.advance(0.01 * k, 0.01, 6.0, NO_WIND) for k in range(round(100 * seconds))]


def test_turbulence_has_the_strengths_of_the_specification() -> None:
    eddies = Eddies.at(6.096, 15.0)
    samples = np.array(
        [
            turbulence.advance(0.05, 6.096, 10.0)
            for seed in range(20)
            for turbulence in [Turbulence(15.0, np.random.default_rng(seed))]
            for _ in range(1500)
        ]
    )
    # At 20 ft the specification has sigma_w = 0.1 W20 and sigma_u = sigma_w / 0.19346^0.4.
    assert eddies.upright == pytest.approx(1.5)
    assert eddies.level == pytest.approx(1.5 / 0.19346**0.4, rel=1e-3)
    assert samples.std(axis=0) == pytest.approx([eddies.level, eddies.level, eddies.upright], rel=0.1)
    assert np.abs(samples.mean(axis=0)).max() < 0.5


@given(st.floats(0.0, 400.0), st.floats(0.0, 30.0))
def test_eddies_grow_with_height_and_become_round(height: float, strength: float) -> None:
    here, above = Eddies.at(height, strength), Eddies.at(height + 10.0, strength)
    assert 0.0 < here.upright_length <= above.upright_length
    assert here.upright_length <= here.level_length * 1.01
    assert here.upright <= here.level * 1.01


def test_eddies_last_as_long_as_they_are_large_and_the_air_is_fast() -> None:
    turbulence = Turbulence(15.0, np.random.default_rng(1))
    along = np.array([turbulence.advance(0.05, 6.0, 10.0)[0] for _ in range(20_000)])
    lag = round(Eddies.at(6.0, 15.0).level_length / 10.0 / 0.05)
    assert np.corrcoef(along[:-lag], along[lag:])[0, 1] == pytest.approx(math.exp(-1.0), abs=0.1)


def test_turbulence_is_the_same_for_the_same_seed_and_another_for_another() -> None:
    one, again, other = (blow(Wind(np.random.default_rng(seed), turbulence=10.0), 1.0) for seed in (1, 1, 2))
    assert one == again != other


@given(
    st.floats(0.0, 100.0),
    st.floats(0.1, 20.0),
    st.tuples(*[st.floats(-10.0, 10.0)] * 3),
    st.floats(-50.0, 150.0),
)
def test_a_gust_swells_to_its_velocity_and_ends(
    at: float, duration: float, velocity: tuple[float, float, float], t: float
) -> None:
    gust = Gust(at, velocity, duration)
    assert norm(gust.velocity_at(t)) <= norm(velocity) + 1e-9
    assert gust.velocity_at(at + duration / 2) == pytest.approx(velocity)
    if not at < t < at + duration:
        assert gust.velocity_at(t) == NO_WIND


def test_gusts_come_on_top_of_the_mean_wind() -> None:
    wind = Wind(np.random.default_rng(1), (3.0, 0.0, 0.0), gusts=[Gust(5.0, (0.0, 4.0, 0.0), 2.0)])
    assert not wind.is_steady
    assert wind.advance(4.0, 0.01, 5.0, NO_WIND) == (3.0, 0.0, 0.0)
    assert wind.advance(6.0, 0.01, 5.0, NO_WIND) == pytest.approx((3.0, 4.0, 0.0))


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(ValueError, match="positive length"):
        Gust(1.0, NO_WIND, 0.0)
    with pytest.raises(ValueError, match="0 or more"):
        Turbulence(-1.0, np.random.default_rng(1))
