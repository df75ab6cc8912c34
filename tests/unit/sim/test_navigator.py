"""Navigation: how good it is, what it believes, and that it knows when it is lost."""

from __future__ import annotations

import math

import numpy as np
import pytest
from flight_rig import Rig

from skillwing.onboard.frames.vectors import heading_of, wrap
from skillwing.onboard.topics.guidance import FlyTo, MotionState, YawMode
from skillwing.sim_mujoco.navigation.error_filter import POSITION, VELOCITY
from skillwing.sim_mujoco.navigation.navigator import EPOCH, FixSteps, Navigator, Solution
from skillwing.sim_mujoco.sensors.health import SensorCondition
from skillwing.sim_mujoco.sensors.receivers import RECEIVERS

RTK = RECEIVERS["rtk"]


class Watch:
    """A flight whose navigation is compared with the truth at each moment."""

    def __init__(self) -> None:
        self.rig = Rig(wind=(3.0, 2.0, 0.0))
        self.rig.take_off()
        self.rows: list[tuple[Solution, float]] = []

    def fly(self, seconds: float) -> None:
        def note() -> bool:
            solution, motion = self.solution, self.rig.sim.motion
            self.rows.append((solution, math.dist(solution.position, motion.position)))
            return False

        self.rig.fly(seconds, note)

    @property
    def solution(self) -> Solution:
        solution = self.rig.sim._navigator.solution(self.rig.sim.t)
        assert solution is not None
        return solution

    @property
    def condition(self) -> SensorCondition | None:
        return self.rig.sim.condition("gnss")


def test_navigation_is_within_centimetres_and_says_so() -> None:
    watch = Watch()
    watch.rig.command("leg", FlyTo(target=(6.0, 0.0, 4.0), speed=2.0, nose=YawMode.ALONG_TRACK))
    watch.fly(8.0)
    assert watch.rig.status.body.state is MotionState.DONE
    assert max(error for _, error in watch.rows) < 0.15
    assert all(s.valid and s.sigma < 0.05 for s, _ in watch.rows)
    off = wrap(heading_of(watch.solution.quaternion) - heading_of(watch.rig.sim.motion.quaternion))
    assert abs(off) < math.radians(0.5)


def test_without_fixes_it_grows_uncertain_says_so_in_time_and_recovers() -> None:
    watch = Watch()
    watch.fly(1.0)
    watch.rig.sim.set_fault("gnss", "blackout", on=True)
    watch.fly(3.0)
    assert watch.condition is SensorCondition.FAILED
    assert watch.solution.valid
    assert 0.05 < watch.solution.sigma < 1.0
    watch.rig.sim.set_fault("gnss", "blackout", on=False)
    watch.fly(3.0)
    assert watch.condition is SensorCondition.OK
    assert watch.solution.sigma < 0.05
    assert watch.rows[-1][1] < 0.15
    assert all(error < 4.0 * solution.sigma + 0.1 for solution, error in watch.rows)


@pytest.mark.parametrize(("kind", "magnitude"), [("bias", 1.0), ("bias", 6.0), ("noise", 2.0)])
def test_fixes_that_jump_are_not_followed_and_the_receiver_is_accused(kind: str, magnitude: float) -> None:
    watch = Watch()
    watch.rig.sim.set_fault("gnss", kind, on=True, magnitude=magnitude)
    watch.fly(4.0)
    assert watch.condition is SensorCondition.FAILED
    assert max(error for _, error in watch.rows) < 0.5
    watch.rig.sim.set_fault("gnss", kind, on=False)
    watch.fly(3.0)
    assert watch.condition is SensorCondition.OK
    assert watch.rows[-1][1] < 0.15


def test_lost_for_long_it_says_that_it_is_lost() -> None:
    watch = Watch()
    watch.rig.sim.set_fault("gnss", "blackout", on=True)
    watch.fly(12.0)
    lost = [solution.t for solution, _ in watch.rows if not solution.valid]
    assert lost
    assert all(error < 2.0 for solution, error in watch.rows if solution.valid)


def test_steps_that_follow_the_speed_are_no_jumps_and_jumps_add_up() -> None:
    steps, position, velocity = FixSteps(RTK), np.zeros(3), np.array([3.0, 0.0, 0.0])

    def fix(t: float, offset: float = 0.0) -> None:
        here = position + t * velocity + np.array([offset, 0.0, 0.0])
        steps.take(t, np.array([*here, *velocity, 0.0], dtype=np.float32))

    for k in range(10):
        fix(0.1 * k)
    assert not steps.jumped
    fix(1.0, offset=0.8)
    fix(1.1, offset=0.8)
    assert steps.jumped
    fix(1.2)
    assert not steps.jumped
    fix(1.3, offset=5.0)
    fix(4.0, offset=5.0)
    assert not steps.jumped, "over a silence no jump can be seen"
    same = np.array([1.0] * 7, dtype=np.float32)
    assert steps.take(5.0, same)
    assert not steps.take(5.1, same), "nothing new was measured"


@pytest.mark.parametrize("part", range(7))
def test_a_fix_that_is_no_number_is_refused_and_leaves_no_trace(part: int) -> None:
    navigator, good = Navigator(RTK), np.zeros(7, dtype=np.float32)
    bad = good.copy()
    bad[part] = math.nan
    for _ in range(50):
        navigator.inertial((0.0, 0.0, 9.81), (0.0, 0.0, 0.0))
    assert "no finite" in (navigator.fix(0.2, 0.1, bad, usable=True) or "")
    assert not navigator.aligned
    assert navigator.fix(0.3, 0.2, good, usable=True) is None
    navigator.epoch(0.4, 0.0, standing=True)
    solution = navigator.solution(0.4)
    assert solution is not None
    assert np.allclose(solution.position, 0.0, atol=0.01)


@pytest.mark.parametrize("axis", range(2))
def test_an_uncertainty_that_cannot_be_computed_is_not_vouched_for(axis: int) -> None:
    for errors in (POSITION, VELOCITY):
        navigator = Navigator(RTK)
        navigator.place((0.0, 0.0, 0.0), 0.0)
        broken = navigator._filter.covariance.copy()
        which = errors.start + axis
        broken[which, which] = -1.0  # as rounding may leave it; its root is not a number
        with np.errstate(invalid="ignore"):
            navigator._filter._set(broken)
            navigator.epoch(EPOCH, 0.0, standing=False)
        solution = navigator.solution(EPOCH)
        assert solution is not None
        assert not (solution.valid if errors is POSITION else solution.velocity_valid)
