"""Conditions that a run watches: the robot is ready, it is away from its rescue goal, robot time advances."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from skillwing.bt_missions.leaves.interface import RobotInterface
from skillwing.dsl.model import Skillset
from skillwing.services.bus import Handle, Timers
from skillwing.services.rescue_goal import RescueGoal

CLOCK_TIMEOUT = 15.0
"""Longest time for which robot time may stand still during a run, in seconds of wall time."""


class Readiness:
    """Start condition of a mission. needs: for each resource, the states in one of which it has to be."""

    def __init__(self, interface: RobotInterface, needs: Mapping[str, tuple[str, ...]]) -> None:
        self.time_is_known = False
        self._interface = interface
        self._needs = needs

    @property
    def missing(self) -> str:
        """All that the robot still lacks, as a text; empty if it is ready."""
        if not self._interface.ready:
            return "waiting for the resource manager"
        if not self.time_is_known:
            return "waiting for the robot's clock"
        states = self._interface.states
        lacks = [
            f"{resource} is {states.get(resource, 'not known')} instead of {' or '.join(wanted)}"
            for resource, wanted in self._needs.items()
            if states.get(resource) not in wanted
        ]
        return "waiting: " + "; ".join(lacks) if lacks else ""


class RescueCheck:
    """Check for a robot away from its rescue goal, at the start and at the end of a mission.

    goal: None for a robot that nobody has to bring anywhere; it never is away. needs: of the mission.
    """

    def __init__(
        self,
        interface: RobotInterface,
        skillset: Skillset,
        goal: RescueGoal | None,
        needs: Mapping[str, tuple[str, ...]],
    ) -> None:
        self._interface = interface
        self._skillset = skillset
        self._goal = goal
        self._needs = needs
        self._began_away = False

    def begin(self) -> None:
        """Note the start of the mission. A robot that is away now may be left there."""
        self._began_away = self.is_away

    @property
    def is_away(self) -> bool:
        return bool(self.where)

    @property
    def where(self) -> str:
        """Words for the place of a robot that is away, such as `under load`; empty at the goal."""
        if self._goal is None:
            return ""
        return self._goal.away.get(self._interface.state(self._goal.resource) or "", "")

    @property
    def is_reached(self) -> bool:
        """True for a robot that is known to be at its goal."""
        return self._goal is not None and self._interface.state(self._goal.resource) is not None and not self.is_away

    @property
    def reported(self) -> str:
        """Resource by whose state the robot reports its place."""
        return f"`{self._goal.resource}`" if self._goal else ""

    @property
    def is_due(self) -> bool:
        """True if the mission has to bring the robot to its goal: it has brought it away, and may bring it back.

        A person who has taken the robot decides alone.
        """
        return self.is_away and not self._began_away and self._is_possible

    @property
    def refusal(self) -> str | None:
        """Reason why a mission that waits cannot start: the robot is away, and nobody commands it."""
        goal, states = self._goal, self._interface.states
        if goal is None or not self.is_away or self._may_start_away(goal) or not self._is_possible:
            return None
        if goal.is_under_way(self._skillset, states):
            return None
        return f"The robot is {self.where} already, and nobody commands it. Use `skillwing start {goal.skill}`."

    def _may_start_away(self, goal: RescueGoal) -> bool:
        return not goal.away.keys().isdisjoint(self._needs.get(goal.resource, goal.away))

    @property
    def _is_possible(self) -> bool:
        return self._goal is not None and self._goal.is_possible(self._skillset, self._interface.states)


class ClockWatchdog:
    """Calls `on_still` once robot time stands still for `CLOCK_TIMEOUT`: then no deadline in robot time would pass.

    now: robot time. is_excused: robot time cannot be heard now, so that its silence means nothing.
    """

    def __init__(
        self, bus: Timers, now: Callable[[], float], on_still: Callable[[], None], is_excused: Callable[[], bool]
    ) -> None:
        self._bus = bus
        self._now = now
        self._on_still = on_still
        self._is_excused = is_excused
        self._check_later(now())

    def cancel(self) -> None:
        self._handle.cancel()

    def _check_later(self, last: float) -> None:
        self._handle: Handle = self._bus.after(CLOCK_TIMEOUT, lambda: self._check(last), wall=True)

    def _check(self, last: float) -> None:
        now = self._now()
        if now > last or self._is_excused():
            self._check_later(now)
        else:
            self._on_still()
