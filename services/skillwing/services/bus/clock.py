"""Clocks of robot time on a machine with wall time: for processes that share it, follow it or own it.

Times are robot seconds. Waiting times are wall seconds, as `wall` counts them.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from threading import Event
from typing import Protocol

LONGEST_EXTRAPOLATION = 0.19
"""Robot seconds for which a follower extrapolates after a tick. When the owner of time pauses, data with a period of
0.1 s, which turn stale after 0.3 s, must not turn stale."""
TICK_PERIOD = 0.15
"""Robot seconds between two ticks of the owner of time: less than the followers' extrapolation."""
LONGEST_SILENCE = 1.0
"""Wall seconds without a tick after which a follower may have been stopped or cut off, so that time is unknown. More
where robot time is so slow that two ticks are farther apart."""
LARGEST_JUMP = 0.1
"""Largest difference in seconds, from one tick to the next, between the progress of robot time and of wall time. Ticks
that have waited in a buffer come in a burst, and differ by more."""
TICK_PATIENCE = 1.0
"""Wall seconds for which a follower waits, after a silence, until ticks are up to date."""
LARGEST_ERROR = 0.04
"""Largest error of the followers in robot seconds before the owner publishes a tick."""
PATIENCE = 2.0
"""Wall seconds for which time waits for a follower: as long as a hung process takes to lose its leases."""
ROUNDING = 1e-6
"""Rounding error of a sum of steps, in robot seconds."""
LAG = 0.1
"""Robot seconds by which a process may lag when time runs as fast as possible: one period of the fastest data."""
LARGEST_LAG = 0.05
"""Wall seconds that a paced clock may lag behind its pace and still catch up."""


@dataclass(frozen=True, slots=True)
class _Tick:
    t: float
    factor: float
    received: float

    def reckoned(self, wall: float) -> float:
        """Robot time at a later wall time, as a follower extrapolates it from this tick alone."""
        return self.t + min((wall - self.received) * self.factor, LONGEST_EXTRAPOLATION)

    def silent_at(self, wall: float) -> bool:
        """True if the owner has been silent for too long at that wall time.

        Where time runs as fast as the followers keep up, the owner is silent while it waits for one of them.
        """
        return self.factor > 0.0 and wall - self.received > max(LONGEST_SILENCE, 2.0 * TICK_PERIOD / self.factor)

    def reaches(self, due: float) -> bool:
        """True if a follower reaches `due` by extrapolation from this tick alone."""
        return due <= self.t + (LONGEST_EXTRAPOLATION if self.factor > 0.0 else 0.0)


class Clock(Protocol):
    def now(self) -> float:
        """Robot time."""
        ...

    def seconds_until(self, due: float) -> float | None:
        """Wall seconds until robot time reaches `due`, 0 or less once it has. None if that depends on a tick."""
        ...

    def reach(self, due: float) -> None:
        """A timer due at `due` is about to run."""
        ...


def unix_offset(wall: Callable[[], float] = time.monotonic) -> float:
    """Seconds by which Unix time is ahead of the monotonic clock now."""
    return time.time() - wall()


class WallClock:
    """Robot time is Unix time without jumps: setting the machine's clock has no effect on it.

    offset: Unix time minus the monotonic clock of this machine, by default that of now. All processes of a system get
    the same offset, also if the clock was set between their starts.
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

    lag: robot seconds by which this follower may be behind, where time runs as fast as its followers keep up. The owner
    of time waits for it. None: the owner does not wait, as for an observer.

    The clock stands at 0 until the first tick. Between ticks it runs at the owner's factor for at most 0.19 s, and so
    stands still when the owner does. It never runs backwards. `tick` and `reaches` may be called on any thread, the
    other methods on the node's.
    """

    def __init__(self, wall: Callable[[], float] = time.monotonic, *, lag: float | None = None) -> None:
        self.lag = lag
        self._wall = wall
        self._tick: _Tick | None = None
        self._up_to_date = Event()
        self._up_to_date.set()
        self._accepted: _Tick | None = None
        """Latest tick when the patience was over."""
        self._latest = 0.0

    def has_started(self) -> bool:
        """True once a tick has been received."""
        return self._tick is not None

    def tick(self, t: float, factor: float, received: float) -> None:
        """Set the clock to the owner's time `t`, which arrived at wall time `received`."""
        before, self._tick = self._tick, _Tick(t, factor, received)
        if before is None:
            return
        if before.silent_at(received):
            self._up_to_date.clear()
        elif abs(t - before.t - factor * (received - before.received)) <= LARGEST_JUMP:
            self._up_to_date.set()

    def catch_up(self) -> None:
        """Wait until time is known, before the node does anything. That is at once but after a long silence.

        A process that was stopped wakes up with the time at which it was stopped. It would take old data for fresh, and
        date its records before their causes. If the owner of time stands, this waits once.
        """
        tick = self._tick
        if tick is None:
            return
        if tick is not self._accepted and tick.silent_at(self._wall()):
            self._up_to_date.clear()
        if not self._up_to_date.is_set() and not self._up_to_date.wait(TICK_PATIENCE):
            self._accepted = self._tick
            self._up_to_date.set()

    def reaches(self, due: float) -> bool:
        """True if robot time reaches `due` without another tick."""
        tick = self._tick
        return tick is not None and tick.reaches(due)

    def now(self) -> float:
        return self._reckoned(self._tick)

    def seconds_until(self, due: float) -> float | None:
        # One tick for the whole calculation: Zenoh's thread may set another one meanwhile.
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
    """Times at which the owner of robot time publishes it: dead reckoning, as in distributed simulation (IEEE 1278).

    Each tick wakes every process of a robot. The owner therefore extrapolates the last tick as its followers do. It
    publishes the next one after `TICK_PERIOD`, or as soon as they are wrong by more than `LARGEST_ERROR`: when the pace
    changes or cannot be kept. As fast as possible (factor 0) extrapolation fails, and each step is published.
    """

    def __init__(self, factor: float) -> None:
        self._factor = factor
        self._published: _Tick | None = None

    def due(self, t: float, wall: float) -> bool:
        """True if robot time `t`, reached at that wall time, is to be published. It then counts as published."""
        published = self._published
        if published is not None and self._factor > 0.0 and t - published.t < TICK_PERIOD:
            wrong_by = abs(published.reckoned(wall) - t)
            if wrong_by <= LARGEST_ERROR:
                return False
        self._published = _Tick(t, self._factor, wall)
        return True


class PacedClock:
    """Robot time of the process that owns it. It moves only with that process's timers, from one due time to the next.

    factor: robot seconds per wall second, 0 for as fast as the timers' work allows. A process that lags by more than
    50 ms does not catch up: the factor drops, and steps never come in bursts.
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
    """Robot time of the process that owns it, as fast as its followers keep up.

    After each step time stands still until every follower has done its work of that step, or lags by no more than it
    may. So a control loop over several processes stays closed, whatever their computing time. This is the conservative
    synchronisation of distributed simulation (K. M. Chandy and J. Misra, "Distributed simulation", IEEE Transactions on
    Software Engineering SE-5(5), 1979), with one owner of time.

    A follower that is not done within `PATIENCE` wall seconds is left behind until a message in which it has advanced.
    A hung process must not stop time, since others have to notice that it hangs.
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
        """Note that a follower has done everything up to `t`, and may lag by `lag` s. The first call registers it.

        A repetition does not count: time would wait again for a follower that sends it, and does not go on.
        """
        known = self._followers.get(follower)
        if known is None or t > known.done:
            self._followers[follower] = _Follower(t, lag)
        else:
            known.lag = lag

    def gone(self, follower: str) -> None:
        """Stop waiting for a follower."""
        self._followers.pop(follower, None)

    def seconds_until(self, due: float) -> float:
        """0 once all followers are done, else the rest of `PATIENCE`."""
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
