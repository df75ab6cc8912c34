"""Loss of the view of the way ahead: the end of the depth map during a motion."""

from __future__ import annotations

from skillwing.m600.keys import KEYS
from skillwing.services.bus import Bus, Handle
from skillwing.services.bus.reading import message_reader
from skillwing.services.protocol import ResourceStep

SOURCE = "depthmap_source"
NO_SOURCE = "NONE"


class ViewLoss:
    """Observer of the depth map's source while a goal flies.

    record: the change that ended the depth map since `follow`; None while there is a depth map, or if none has ended.
    It follows the steps only during a goal, and without those from before.
    """

    def __init__(self, bus: Bus) -> None:
        self.record: str | None = None
        self._bus = bus
        self._subscription: Handle | None = None

    def follow(self) -> None:
        """Begin to observe, or begin again."""
        self.record = None
        if self._subscription is None:
            read = message_reader(ResourceStep, self._note)
            self._subscription = self._bus.subscribe(KEYS.resource_steps, read)

    def rest(self) -> None:
        """Observe no longer. Idempotent."""
        if self._subscription is not None:
            self._subscription.cancel()
        self._subscription = self.record = None

    def _note(self, step: ResourceStep) -> None:
        for change in step.changes:
            if change.subject == SOURCE:
                self.record = change.id if change.after == NO_SOURCE else None
