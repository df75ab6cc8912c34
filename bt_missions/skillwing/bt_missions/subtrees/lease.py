"""`WithLease`: a part of a mission that needs a place, which another robot or a fleet lends while a goal runs."""

from __future__ import annotations

import re
from collections.abc import Generator, Iterator

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Composite

from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.leaves.source_location import set_caller_location
from skillwing.services.protocol import State

DEFAULT_PATIENCE = 60.0
"""Longest wait for a lease, in seconds."""
AGAIN_AFTER = 1.0
"""Time between two attempts to get a lease, in seconds."""
_GUARD = re.compile(r"`[^`]*` does not hold: ")
"""Begin of a sentence on a guard. The values after it say enough of a wait."""


class WithLease(Composite):
    """Starts `lease`, and runs `body` as soon and as long as its goal is RUNNING. Ends as `body` does.

    A refused lease is asked for again, for at most `patience` seconds; then FAILURE. If the lease ends, or is asked to
    end, while `body` runs, then `body` is halted: FAILURE. It goes on only while `stay` is SUCCESS: the robot is in the
    place, and has to leave it. children: lease, body, and `stay` if there is one.
    """

    def __init__(
        self,
        name: str,
        context: MissionContext,
        lease: SkillAction,
        body: Behaviour,
        stay: Behaviour | None = None,
        *,
        patience: float = DEFAULT_PATIENCE,
    ) -> None:
        super().__init__(name, [lease, body] if stay is None else [lease, body, stay])
        set_caller_location(self)
        self.patience = patience
        self._context = context
        self._lease, self._body, self._stay = lease, body, stay
        self._holds = False
        self._since = 0.0
        self._again_at = 0.0
        self._refusal = self._reason = ""
        """The last refusal as a sentence, and its reason."""

    @property
    def waits(self) -> bool:
        """True while the lease is not granted yet."""
        return self.status is Status.RUNNING and not self._holds

    def tick(self) -> Iterator[Behaviour]:
        if self.status is not Status.RUNNING:
            self._begin()
        yield from self._tick_lease()
        if self._holds and not self._is_held() and not (yield from self._may_stay()):
            yield from self._fail(self._end_of_lease())
            return
        if not self._holds and self._is_held():
            self._holds = True
        if self._holds:
            yield from self._body.tick()
            self._follow()
        elif self._context.now() - self._since > self.patience:
            last = f"; the last {self._refusal}" if self._refusal else ""
            yield from self._fail(f"{self._lease.skill} was not granted within {self.patience:g} s{last}")
            return
        else:
            self.status = Status.RUNNING
            self.feedback_message = self._waiting()
        yield self

    @property
    def robot(self) -> str:
        """Name of the robot that waits, in a mission on several: the first in `body` that is not the lender."""
        robots = [leaf.robot for leaf in self._body.iterate() if isinstance(leaf, SkillAction)]
        return next((robot for robot in robots if robot != self._lease.robot), "")

    def _waiting(self) -> str:
        """One text as long as the reason of the last refusal, its first sentence, stays the same."""
        skill = self._lease.skill
        reason = _GUARD.sub("", self._reason).partition(". ")[0].rstrip(".")
        return f"waiting for {skill}: {reason}" if reason else f"waiting for {skill}"

    def _begin(self) -> None:
        for child in self.children:
            child.stop(Status.INVALID)
        self._holds = False
        self._since = self._again_at = self._context.now()
        self._refusal = self._reason = ""

    def _tick_lease(self) -> Iterator[Behaviour]:
        """Tick the lease while it runs; after its end only before `body`, and not at once."""
        if self._lease.status is not Status.RUNNING:
            if self._holds or self._context.now() < self._again_at:
                return
            self._again_at = self._context.now() + AGAIN_AFTER
        failure = self._context.failure
        yield from self._lease.tick()
        if self._lease.status is Status.FAILURE and not self._holds:
            # Asked again, so it is no failure of the mission: what has failed elsewhere stays its reason.
            goal = self._lease.goal
            terminal = None if goal is None else goal.terminal
            self._refusal = self._lease.feedback_message
            self._reason = self._refusal if terminal is None else terminal.reason
            self._context.failure = failure

    def _end_of_lease(self) -> str:
        ended = self._lease.status is not Status.RUNNING
        return self._lease.feedback_message if ended else f"{self._lease.skill} does not run any more"

    def _is_held(self) -> bool:
        goal = self._lease.goal
        return self._lease.status is Status.RUNNING and goal is not None and goal.state is State.RUNNING

    def _may_stay(self) -> Generator[Behaviour, None, bool]:
        """Tick `stay`. Returns True if `body` goes on without the lease."""
        if self._stay is None:
            return False
        yield from self._stay.tick()
        return self._stay.status is Status.SUCCESS

    def _follow(self) -> None:
        """Take over the status of `body`; at its end the lease is given back."""
        if self._body.status is Status.RUNNING:
            self.status = Status.RUNNING
            self.feedback_message = "" if self._is_held() else f"leaving without {self._lease.skill}"
        else:
            self._lease.stop(Status.INVALID)
            self.feedback_message = ""
            self.stop(self._body.status)

    def _fail(self, reason: str) -> Iterator[Behaviour]:
        self.feedback_message = reason
        goal = self._lease.goal
        self._context.observe(reason, None if goal is None else goal.record, failed=True)
        for child in self.children:
            child.stop(Status.INVALID)
        self.stop(Status.FAILURE)
        yield self
