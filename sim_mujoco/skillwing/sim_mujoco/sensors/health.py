"""Self-diagnosis of a sensor: detection of its failure and of its recovery.

It uses only delivered data. Signs of a failure are: no data for too long, too few, repeated or impossible values,
failed self-tests (`self_tests.py`), and residuals against other instruments (`cross_checks.py`). A recovered sensor has
to deliver good data for a while before it is trusted again.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from skillwing.sim_mujoco.sensors.corruptors import Data
from skillwing.sim_mujoco.sensors.self_tests import SelfTest

FROZEN_AFTER = 4
"""Number of identical measurements in a row that make a frozen sensor."""
SILENT_PERIODS = 5
LEAST_SHARE = 0.5
"""Share of the nominal rate below which there are too few measurements."""
LARGEST_BAD_SHARE = 0.05
TRUST_AFTER = 2.0
FIRST_TRUST_AFTER = 0.5
_WINDOW_PERIODS = 15
"""Periods over which the rate is measured, but at least half a second and at most two."""


class SensorCondition(StrEnum):
    UNKNOWN = "UNKNOWN"
    OK = "OK"
    FAILED = "FAILED"


@dataclass(frozen=True, slots=True)
class Limits:
    """Smallest and largest value that the sensor can produce. With `zero_is_none` a 0 means "nothing there"."""

    low: float
    high: float
    zero_is_none: bool = True


@dataclass(frozen=True, slots=True)
class ConditionChange:
    """The condition changed at `t`; `reason` is a sentence."""

    t: float
    condition: SensorCondition
    reason: str


class HealthMonitor:
    """Monitor of one sensor with a nominal measurement every `period` seconds."""

    def __init__(self, period: float, limits: Limits, tests: Sequence[SelfTest] = ()) -> None:
        """`tests` are the additional self-tests of this kind of sensor."""
        self._period, self._limits, self._tests = period, limits, tests
        self._window = min(2.0, max(0.5, _WINDOW_PERIODS * period))
        self._silence_limit = max(SILENT_PERIODS * period, 0.2)
        self._expected = round(self._window / period)
        self._started: float | None = None
        self._counting_since = 0.0
        self._last_seen: float | None = None
        self._good_since: float | None = None
        self._arrivals: deque[float] = deque()
        self._previous: Data | None = None
        self._repeats = 0
        self.condition = SensorCondition.UNKNOWN

    def observe(self, t: float, data: Data, residual: str | None = None) -> ConditionChange | None:
        """Take a measurement that was delivered at `t`; `residual` is the residual from other instruments."""
        self._last_seen = t
        self._arrivals.append(t)
        return self._conclude(t, self._frozen(data) or self._impossible(data) or self._tested(t, data) or residual)

    def check(self, t: float) -> ConditionChange | None:
        """Take the time. Call it at least once a period."""
        if self._started is None:
            self._started = self._counting_since = t
        problem = self._silent(t) or self._sparse(t)
        return None if problem is None else self._conclude(t, problem)

    def _conclude(self, t: float, problem: str | None) -> ConditionChange | None:
        if problem is not None:
            self._good_since = None
            return self._become(t, SensorCondition.FAILED, problem)
        if self._good_since is None:
            self._good_since = t
        needed = TRUST_AFTER if self.condition is SensorCondition.FAILED else FIRST_TRUST_AFTER
        if t - self._good_since < needed:
            return None
        return self._become(t, SensorCondition.OK, f"good data for {needed:g} s")

    def _become(self, t: float, condition: SensorCondition, reason: str) -> ConditionChange | None:
        if condition is self.condition:
            return None
        self.condition = condition
        return ConditionChange(t, condition, reason)

    def _silent(self, t: float) -> str | None:
        since = self._last_seen if self._last_seen is not None else self._started
        silence = 0.0 if since is None else t - since
        if silence <= self._silence_limit:
            return None
        self._counting_since = t
        return f"no data for {silence:.2f} s"

    def _sparse(self, t: float) -> str | None:
        while self._arrivals and self._arrivals[0] <= t - self._window:
            self._arrivals.popleft()
        if len(self._arrivals) >= LEAST_SHARE * self._expected:
            return None
        if t - self._counting_since < self._window + self._period:
            return None
        return f"only {len(self._arrivals)} of {self._expected} measurements in {self._window:g} s"

    def _frozen(self, data: Data) -> str | None:
        same = self._previous is not None and np.array_equal(self._previous, data)
        self._previous = data
        # Repeated measurements of nothing in sight are no evidence.
        self._repeats = self._repeats + 1 if same and data.any() else 0
        return f"the same measurement {self._repeats + 1} times" if self._repeats + 1 >= FROZEN_AFTER else None

    def _tested(self, t: float, data: Data) -> str | None:
        """The first problem that a self-test finds. Every test has to see every measurement."""
        problems = [test.problem(t, data) for test in self._tests]
        return next((problem for problem in problems if problem is not None), None)

    def _impossible(self, data: Data) -> str | None:
        wrong = ~((data >= self._limits.low) & (data <= self._limits.high))
        if self._limits.zero_is_none:
            wrong &= data != 0
        share = np.count_nonzero(wrong) / data.size
        return f"{100 * share:.0f} % impossible values" if share > LARGEST_BAD_SHARE else None
