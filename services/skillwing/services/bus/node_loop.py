"""The loop of a node on Zenoh: one thread, one mailbox, and the timers of each clock in which the node lives."""

from __future__ import annotations

import time
from collections.abc import Callable

from skillwing.services.bus.agenda import Agenda
from skillwing.services.bus.clock import Clock, FollowedClock
from skillwing.services.bus.mailbox import Mailbox


class NodeTime:
    """A clock of robot time, with the timers of a node in this time and in wall time.

    Zenoh's threads may call `wakes_for` and read the clock; everything else runs on the node's thread.
    """

    def __init__(self, clock: Clock) -> None:
        self.clock = clock
        self.robot_agenda = Agenda()
        """Timers, by robot time."""
        self.wall_agenda = Agenda()
        """Timers, by `time.monotonic`."""
        self.acknowledge: Callable[[], None] | None = None
        """Action that is owed to the owner of robot time when no timer is due any more."""
        self._awaited: float | None = None

    def catch_up(self) -> None:
        """Wait until robot time is known. That is at once, except after a long silence of its owner."""
        if isinstance(self.clock, FollowedClock):
            self.clock.catch_up()

    def act(self) -> bool:
        """Run a timer that is due, or the acknowledgement. False if there is nothing to do."""
        action = self._due_timer()
        if action is None:
            action, self.acknowledge = self.acknowledge, None
        if action is None:
            return False
        action()
        return True

    def patience(self) -> float | None:
        """Wall seconds until the next timer is due, None for never. The node then waits for it."""
        wall_due, robot_due = self.wall_agenda.next_due(), self.robot_agenda.next_due()
        # Set before the clock is read, so that a tick in between wakes this node.
        self._awaited = robot_due
        waits = [] if wall_due is None else [wall_due - time.monotonic()]
        if robot_due is not None and (wait := self.clock.seconds_until(robot_due)) is not None:
            waits.append(wait)
        return min(waits) if waits else None

    def wakes_for(self, clock: FollowedClock) -> bool:
        """True if the tick that the clock has received makes a timer due for which the node waits."""
        awaited = self._awaited
        return awaited is not None and clock.reaches(awaited)

    def _due_timer(self) -> Callable[[], None] | None:
        timer = self.wall_agenda.take(time.monotonic())
        if timer is not None:
            return timer
        due = self.robot_agenda.next_due()
        if due is None:
            return None
        wait = self.clock.seconds_until(due)
        if wait is None or wait > 0.0:
            return None
        self.clock.reach(due)
        return self.robot_agenda.take(max(due, self.clock.now()))


class NodeLoop:
    """The mailbox of a node, and the times of its buses: one for each, or one that several share."""

    def __init__(self) -> None:
        self._mailbox = Mailbox()
        self._times: tuple[NodeTime, ...] = ()
        self._running = False
        self._closed = False

    def add(self, node_time: NodeTime) -> None:
        """Run the timers of one more time."""
        self._times = (*self._times, node_time)

    def remove(self, node_time: NodeTime) -> None:
        """Run the timers of a time no more."""
        self._times = tuple(each for each in self._times if each is not node_time)

    def post(self, action: Callable[[], None]) -> None:
        """Run an action soon. Any thread may call this."""
        self._mailbox.put(action)

    def close(self) -> None:
        """Run nothing more, not even what waits."""
        self._closed = True

    def run_until(self, done: Callable[[], bool], timeout: float | None = None) -> bool:
        """See `Loop`. A closed loop runs nothing: this returns False at once unless `done()` holds."""
        if self._running:
            raise RuntimeError("run_until was called from a callback; a node lives in callbacks and must not wait")
        deadline = None if timeout is None else time.monotonic() + timeout
        self._running = True
        try:
            while not done():
                if self._closed or (deadline is not None and time.monotonic() >= deadline):
                    return False
                self._turn(deadline)
            return True
        finally:
            self._running = False

    def _turn(self, deadline: float | None) -> None:
        """Run the waiting messages and a due timer of each time. If there are none, wait for the first one."""
        self._catch_up()
        waiting = len(self._mailbox)
        for _ in range(waiting):
            self._mailbox.take()()
            if self._closed:
                return
        acted = [each.act() for each in self._times if self._runs(each)]
        if not any(acted) and not waiting and self._mailbox.wait(self._patience(deadline)):
            self._catch_up()
            self._mailbox.take()()

    def _runs(self, node_time: NodeTime) -> bool:
        """False for a time that an action of this turn has removed, and for all in a closed loop."""
        return not self._closed and node_time in self._times

    def _catch_up(self) -> None:
        for each in self._times:
            each.catch_up()

    def _patience(self, deadline: float | None) -> float | None:
        """Wall seconds until a timer is due or the deadline is over; None for never."""
        waits = [wait for each in self._times if (wait := each.patience()) is not None]
        if deadline is not None:
            waits.append(deadline - time.monotonic())
        return max(0.0, min(waits)) if waits else None
