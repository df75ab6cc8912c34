"""Leaves for the moment when one branch of a tree takes over from another."""

from __future__ import annotations

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from skillwing.bt_missions.leaves.context import MissionContext


class NoteSwitch(Behaviour):
    """First leaf of a branch that takes over: records the branch before it, and the reason. SUCCESS at once."""

    def __init__(self, name: str, context: MissionContext, subject: str, before: str, after: str) -> None:
        super().__init__(name)
        self._context = context
        self.step = subject, before, after

    def update(self) -> Status:
        self._context.note_switch(*self.step)
        self.feedback_message = self._context.switches[-1].reason
        return Status.SUCCESS


class NeverSwitched(Behaviour):
    """FAILURE, with the reason, if the mission has switched to another branch of `subject`; SUCCESS otherwise.

    It distinguishes a mission that ended as planned from one that ended in a fallback.
    """

    def __init__(self, name: str, context: MissionContext, subject: str) -> None:
        super().__init__(name)
        self._context = context
        self.subject = subject

    def update(self) -> Status:
        switch = next((each for each in self._context.switches if each.subject == self.subject), None)
        if switch is None:
            return Status.SUCCESS
        self.feedback_message = f"{switch.before} -> {switch.after}, for {switch.reason}"
        self._context.observe(self.feedback_message, switch.record, failed=True)
        return Status.FAILURE


class WaitForSettled(Behaviour):
    """RUNNING while cancelled goals are stopping; then SUCCESS.

    After `patience` seconds of robot time it is SUCCESS in any case: the next step may be urgent.
    """

    def __init__(self, name: str, context: MissionContext, patience: float) -> None:
        super().__init__(name)
        self._context = context
        self.patience = patience
        self._waits_since = 0.0

    def initialise(self) -> None:
        self._waits_since = self._context.now()

    def update(self) -> Status:
        stopping = self._context.unfinished
        if stopping:
            names = ", ".join(sorted({goal.skill for goal in stopping}))
            self.feedback_message = f"waiting until {names} has stopped"
            waited = self._context.now() - self._waits_since
            return Status.SUCCESS if waited > self.patience else Status.RUNNING
        self.feedback_message = "everything has stopped"
        return Status.SUCCESS
