"""Robot time on a wall-clock machine: who lives in it, who follows it, who makes it.

Times are robot seconds; what a clock is asked to wait for it answers in wall seconds, as `wall` counts them.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

LONGEST_EXTRAPOLATION = 0.1
"""Robot seconds that a follower runs on by itself after a tick."""
TICK_PERIOD = 0.075
"""Robot seconds after which the owner of the time tells it anew: before the followers' extrapolation ends."""
LARGEST_ERROR = 0.04
"""Robot seconds by which followers may be wrong before the owner tells them."""
PATIENCE = 2.0
"""Wall seconds that time stands still for a follower; as long as a hung process takes to lose its leases."""
ROUNDING = 1e-6
"""Robot seconds by which a sum of steps may miss what it stands for."""
LARGEST_LAG = 0.05
"""Wall seconds that a paced clock may lag behind its pace and still catch up."""


@dataclass(frozen=True, slots=True)
class _Tick:
    t: float
    factor: float
    received: float

    def reckoned(self, wall: float) -> float:
        """Robot time at a later wall time, as everybody reckons it who has heard only this tick."""
        return self.t + min((wall - self.received) * self.factor, LONGEST_EXTRAPOLATION)

    def reaches(self, due: float) -> bool:
        """Tell whether it comes to `due` for whoever has heard only this tick."""
        return due <= self.t + (LONGEST_EXTRAPOLATION if self.factor > 0.0 else 0.0)


class Clock(Protocol):
    def now(self) -> float:
        """Robot time."""
        ...

    def seconds_until(self, due: float) -> float | None:
        """Wall seconds until robot time reaches `due`, 0 or less once it has; None if only a tick will tell."""
        ...

    def reach(self, due: float) -> None:
        """A timer due at `due` is about to run."""
        ...


def unix_offset(wall: Callable[[], float] = time.monotonic) -> float:
    """Seconds by which Unix time is ahead of the monotonic clock now."""
    return time.time() - wall()


class WallClock:
    """Robot time is Unix time, made steady: it does not jump when somebody sets the machine's clock.

    offset: what to add to the monotonic clock of this machine, for a process to have the same time as those of its
    system that were started before somebody set the clock; by default that of now.
    """

    def __init__(self, wall: Callable[[], float] = time.monotonic, offset: float | None = None) -> None:
        self._wall = wall
        self._offset = unix_offset(wall) if offset is None else offset

    def now(self) -> float:
        return self._wall() + self._offset

    def seconds_until(self, due: float) -> float:
        return due - self.now()

    def reach(self, due: float) -> None:
        pass


class FollowedClock:
    """Robot time as another process publishes it.

    lag: where time runs as fast as its followers keep up, its owner waits for this one, which is never behind by more
    than so many robot seconds. None: the owner does not wait, as for whoever only looks on.

    It stands at 0 until the first tick. Between ticks it runs on at the owner's factor, at most 0.1 s, so that it
    stands still when the owner does; it never runs backwards. `tick` and `reaches` may be called on any thread, the
    rest on the node's.
    """

    def __init__(self, wall: Callable[[], float] = time.monotonic, *, lag: float | None = None) -> None:
        self.lag = lag
        self._wall = wall
        self._tick: _Tick | None = None
        self._latest = 0.0

    def has_started(self) -> bool:
        """A tick has been heard."""
        return self._tick is not None

    def tick(self, t: float, factor: float, received: float) -> None:
        """Take the owner's time `t`, which arrived when the wall clock stood at `received`."""
        self._tick = _Tick(t, factor, received)

    def reaches(self, due: float) -> bool:
        """Tell whether robot time comes to `due` without another tick."""
        tick = self._tick
        return tick is not None and tick.reaches(due)

    def now(self) -> float:
        return self._reckoned(self._tick)

    def seconds_until(self, due: float) -> float | None:
        # One tick for the whole answer: another may come on Zenoh's thread before it is given.
        tick = self._tick
        if tick is None:
            return None
        missing = due - self._reckoned(tick)
        if missing <= 0.0:
            return 0.0
        return missing / tick.factor if tick.reaches(due) else None

    def reach(self, due: float) -> None:
        pass

    def _reckoned(self, tick: _Tick | None) -> float:
        if tick is not None:
            self._latest = max(self._latest, tick.reckoned(self._wall()))
        return self._latest


class TickRule:
    """Tells the owner of robot time when to publish it: dead reckoning, as distributed simulations (IEEE 1278) have it.

    Each tick costs every process of a robot some wakefulness. So the owner reckons what its followers make of the last
    one, and tells them anew after `TICK_PERIOD`, or as soon as they are wrong by more than `LARGEST_ERROR`: when its
    pace changes or it cannot keep it. As fast as possible (factor 0) nothing can be reckoned, and each step is told.
    """

    def __init__(self, factor: float) -> None:
        self._factor = factor
        self._told: _Tick | None = None

    def due(self, t: float, wall: float) -> bool:
        """Tell whether robot time `t`, reached at that wall time, is to be published; if so it counts as published."""
        told = self._told
        if told is not None and self._factor > 0.0 and t - told.t < TICK_PERIOD:
            wrong_by = abs(told.reckoned(wall) - t)
            if wrong_by <= LARGEST_ERROR:
                return False
        self._told = _Tick(t, self._factor, wall)
        return True


class PacedClock:
    """Robot time of the process that owns it: it moves only with that process's timers, from one due time to the next.

    factor: robot seconds per wall second; 0 for as fast as the timers' work allows. A process that cannot keep the
    pace falls behind for good once it lags by more than 50 ms: the factor drops, and never do steps come in bursts.
    """

    def __init__(self, factor: float = 1.0, wall: Callable[[], float] = time.monotonic) -> None:
        self._wall = wall
        self.factor = factor
        self._now = 0.0
        self._started: float | None = None

    def now(self) -> float:
        return self._now

    def seconds_until(self, due: float) -> float:
        if self.factor <= 0.0:
            return 0.0
        if self._started is None:
            self._started = self._wall() - self._now / self.factor
        return self._started + due / self.factor - self._wall()

    def reach(self, due: float) -> None:
        lag = -self.seconds_until(due)
        if self._started is not None and lag > LARGEST_LAG:
            self._started += lag
        self._now = max(self._now, due)


@dataclass(slots=True)
class _Follower:
    done: float
    lag: float
    left_behind: bool = False


class LockstepClock:
    """Robot time of the process that owns it, as fast as its followers keep up: it waits until they are done.

    Time stands after each step until every follower has done what that step brought, or lags by no more than it may.
    So a loop that is closed over other processes stays closed, whatever they cost. This is the conservative
    synchronisation of distributed simulations (K. M. Chandy and J. Misra, "Distributed simulation", IEEE Transactions
    on Software Engineering SE-5(5), 1979), with the owner of the time as the only one who advances it.

    A follower that is not done within `PATIENCE` wall seconds is left behind until it is heard of again: a process that
    hangs must not stop the world, for others have to notice that it hangs.
    """

    factor = 0.0

    def __init__(self, wall: Callable[[], float] = time.monotonic) -> None:
        self._wall = wall
        self._now = 0.0
        self._reached = wall()
        self._followers: dict[str, _Follower] = {}

    def now(self) -> float:
        return self._now

    def done(self, follower: str, t: float, lag: float) -> None:
        """A follower has done everything up to `t`, and may lag by `lag` seconds. The first time it joins."""
        self._followers[follower] = _Follower(t, lag)

    def gone(self, follower: str) -> None:
        """Nobody waits for this follower any more."""
        self._followers.pop(follower, None)

    def seconds_until(self, due: float) -> float:
        """0 once all are done; else the rest of the patience with those that are not."""
        del due
        late = [each for each in self._followers.values() if not each.left_behind and self._is_late(each)]
        patience = self._reached + PATIENCE - self._wall()
        if not late or patience > 0.0:
            return max(0.0, patience) if late else 0.0
        for follower in late:
            follower.left_behind = True
        return 0.0

    def reach(self, due: float) -> None:
        if due > self._now:
            self._now, self._reached = due, self._wall()

    def _is_late(self, follower: _Follower) -> bool:
        return follower.done + follower.lag < self._now - ROUNDING
