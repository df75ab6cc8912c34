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
    It follows the steps only during a goal, and as a stream: a subscription to events begins with all earlier steps.
    A step may get lost in a stream: `recall` gets it back.
    """

    def __init__(self, bus: Bus) -> None:
        self.record: str | None = None
        self._bus = bus
        self._since = 0.0
        self._subscription: Handle | None = None
        self._recalled = False

    def follow(self) -> None:
        """Begin to observe, or begin again."""
        self.record = None
        self._since = self._bus.now()
        self._recalled = False
        if self._subscription is None:
            self._subscribe(events=False)

    def recall(self) -> None:
        """Ask once for all steps since `follow`."""
        if self._subscription is not None and not self._recalled:
            self._recalled = True
            self._subscription.cancel()
            self._subscribe(events=True)

    def rest(self) -> None:
        """Observe no longer. Idempotent."""
        if self._subscription is not None:
            self._subscription.cancel()
        self._subscription = self.record = None

    def _subscribe(self, *, events: bool) -> None:
        read = message_reader(ResourceStep, self._note)
        self._subscription = self._bus.subscribe(KEYS.resource_steps, read, events=events)

    def _note(self, step: ResourceStep) -> None:
        for change in step.changes if step.t >= self._since else ():
            if change.subject == SOURCE:
                self.record = change.id if change.after == NO_SOURCE else None
