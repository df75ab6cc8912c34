"""A sensor notices by itself that it fails, why, and that it works again."""

from __future__ import annotations

import numpy as np
import pytest

from skillwing.sim_mujoco.sensors.channel import SensorChannel
from skillwing.sim_mujoco.sensors.corruptors import Corruption
from skillwing.sim_mujoco.sensors.faults import KINDS, UnknownFaultError
from skillwing.sim_mujoco.sensors.health import ConditionChange, HealthMonitor, Limits, SensorCondition

PERIOD = 1 / 15
LIMITS = Limits(0.2, 20.0)


class Bench:
    """A depth-like sensor on a channel, looking at something 5 m away."""

    def __init__(self) -> None:
        rng = np.random.default_rng(7)
        self._rng = rng
        self.channel = SensorChannel("zed", PERIOD, 0.03, LIMITS, Corruption(rng))
        self.t = 0.0
        self.delivered = 0

    def run(self, seconds: float) -> list[ConditionChange]:
        changes: list[ConditionChange] = []
        end = self.t + seconds
        while self.t < end:
            self.t += 0.01
            if self.channel.due(self.t):
                noise = 0.01 * self._rng.standard_normal((18, 32), dtype=np.float32)
                self.channel.deliver(self.t, self.t, np.float32(5.0) + noise)
            arrived, news = self.channel.collect(self.t)
            self.delivered += len(arrived)
            changes += news
        return changes


def test_good_data_is_trusted_after_a_moment() -> None:
    bench = Bench()
    (change,) = bench.run(5.0)
    assert change.condition is SensorCondition.OK
    assert change.t < 1.0
    assert bench.delivered == pytest.approx(5.0 / PERIOD, abs=2)


@pytest.mark.parametrize(
    ("kind", "within", "reason"),
    [
        ("blackout", 0.5, "no data"),
        ("freeze", 0.5, "the same measurement"),
        ("noise", 0.5, "impossible"),
        ("dropout", 3.0, "data|measurements"),
        ("slow", 3.0, "data|measurements"),
    ],
)
def test_each_failure_is_noticed_named_and_survived(kind: str, within: float, reason: str) -> None:
    bench = Bench()
    bench.run(4.0)
    bench.channel.corruption.switch(kind, on=True, magnitude=10.0 if kind == "noise" else None)
    began = bench.t
    changes = bench.run(4.0)
    assert changes[0].condition is SensorCondition.FAILED
    assert changes[0].t - began < within
    assert any(word in changes[0].reason for word in reason.split("|"))
    bench.channel.corruption.switch(kind, on=False)
    ended = bench.t
    (recovery,) = bench.run(6.0)
    assert recovery.condition is SensorCondition.OK
    assert recovery.t - ended >= 2.0 - PERIOD


def test_data_that_never_came_is_a_failure_too() -> None:
    monitor = HealthMonitor(PERIOD, LIMITS)
    changes = [monitor.check(0.01 * k) for k in range(100)]
    (change,) = [c for c in changes if c is not None]
    assert change.condition is SensorCondition.FAILED


def test_seeing_nothing_for_long_is_not_a_frozen_sensor() -> None:
    monitor = HealthMonitor(PERIOD, LIMITS)
    empty = np.zeros((4, 4), dtype=np.float32)
    changes = [monitor.observe(k * PERIOD, empty) for k in range(60)]
    assert [c.condition for c in changes if c is not None] == [SensorCondition.OK]


def test_a_small_bias_cannot_be_noticed() -> None:
    bench = Bench()
    bench.run(4.0)
    bench.channel.corruption.switch("bias", on=True, magnitude=0.5)
    assert bench.run(4.0) == []


def test_corruptors_stack_and_come_off_one_by_one() -> None:
    corruption = Corruption(np.random.default_rng(0))
    data = np.ones(3, dtype=np.float32)
    corruption.switch("bias", on=True, magnitude=2.0)
    corruption.switch("blackout", on=True)
    assert corruption.apply(data) is None
    corruption.switch("blackout", on=False)
    corruption.switch("blackout", on=False)
    delivered = corruption.apply(data)
    assert delivered is not None
    assert delivered.tolist() == [3.0, 3.0, 3.0]
    assert corruption.active == ("bias",)


def test_an_unknown_kind_of_fault_is_refused_with_the_known_ones() -> None:
    with pytest.raises(UnknownFaultError) as caught:
        Corruption(np.random.default_rng(0)).switch("gremlin", on=True)
    assert caught.value.known == tuple(KINDS)
