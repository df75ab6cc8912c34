"""A resource core whose grants have leases."""

from __future__ import annotations

from collections.abc import Callable

from skillwing.services.bus import Bus
from skillwing.services.core.events import Event
from skillwing.services.core.leases import Expired
from skillwing.services.core.resource_core import Step
from skillwing.services.managers.journaled_core import JournaledCore
from skillwing.services.managers.lease_watch import LeaseWatch
from skillwing.services.protocol import RenewGoal

GRANT_LEASE = 2.0
"""Wall time in seconds within which a manager has to renew a grant, which it does four times as often."""
DISPATCH_GRACE = 1.0
"""Seconds past its `dispatch_timeout` that a skill may take for `on_dispatch` until its manager counts as hung."""


class LeasedCore:
    """Wrapper round a journaled core: every grant has a lease, and nothing else has one.

    on_silent is called for each grant whose lease has run out; it has to take a step that ends the goal, or to call
    `extend`.
    """

    def __init__(self, journaled: JournaledCore, bus: Bus, on_silent: Callable[[Expired], None]) -> None:
        self._journaled = journaled
        self._watch = LeaseWatch(bus, on_silent)

    def step(self, event: Event, now: float) -> Step:
        """Take a step, then begin and end leases."""
        step = self._journaled.step(event, now)
        if isinstance(event, RenewGoal):
            self._watch.renew(event.goal_id, GRANT_LEASE)
        self._follow_grants()
        return step

    def extend(self, goal_id: str, length: float) -> None:
        """Begin the lease of a goal again."""
        self._watch.begin(goal_id, length)

    def _follow_grants(self) -> None:
        held = {grant.goal_id: grant for grant in self._journaled.core.grants}
        for goal_id in self._watch.keys:
            if goal_id not in held:
                self._watch.end(goal_id)
        for goal_id, grant in held.items():
            if goal_id not in self._watch:
                # Its manager renews nothing before `on_dispatch` has returned.
                self._watch.begin(goal_id, max(GRANT_LEASE, grant.skill.dispatch_timeout + DISPATCH_GRACE))
