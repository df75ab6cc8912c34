"""Bounds of what waits for a busy node: requests, streams and events, in bytes and in number.

Both buses use these classes, so that a node in a test loses what it would lose in a process.
"""

from __future__ import annotations

import logging
import sys
import threading
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from itertools import count
from weakref import WeakSet

from skillwing.services.bus import Sample
from skillwing.services.protocol import MAX_MESSAGE_BYTES

MIB = 2**20
MOST_REQUESTS = 1000
MOST_BYTES = 32 * MIB
"""Bytes of one kind that wait for one node: of requests, of streams, of events."""
STREAM_BACKLOG = 256
"""Samples of one stream subscription that wait for a busy node."""
SAMPLE_OVERHEAD = 512
"""Bytes that the objects around a waiting sample take; without them a flood of empty samples would have no bound."""

logger = logging.getLogger(__name__)


class RequestBacklog:
    """The requests that a node has received and not yet taken up. For any thread.

    A request that finds no room is refused, and its sender asks again. Answers always find room: the node asked for
    them, and nobody would send them again.
    """

    def __init__(self, most_requests: int = MOST_REQUESTS, most_bytes: int = MOST_BYTES) -> None:
        self._most_requests = most_requests
        self._most_bytes = most_bytes
        self._requests = 0
        self._bytes = 0
        self._lock = threading.Lock()

    def enter(self, size: int) -> bool:
        """Let a request of `size` bytes wait. False if there is no room; one always has room where none waits."""
        with self._lock:
            full = self._requests >= self._most_requests or self._bytes + size > self._most_bytes
            if full and self._requests:
                return False
            self._requests += 1
            self._bytes += size
            return True

    def leave(self, size: int) -> None:
        """The node takes up a request that was let in."""
        with self._lock:
            self._requests -= 1
            self._bytes -= size


@dataclass(frozen=True, slots=True)
class Bounds:
    """Limits of waiting samples.

    samples: of one subscription. bytes: of all subscriptions of a node. largest: bytes of one sample. reports_loss: the
    log reports dropped samples as an error.
    """

    samples: int
    bytes: int
    largest: int
    reports_loss: bool


STREAMS = Bounds(samples=STREAM_BACKLOG, bytes=MOST_BYTES, largest=MOST_BYTES, reports_loss=False)
EVENTS = Bounds(samples=sys.maxsize, bytes=MOST_BYTES, largest=MAX_MESSAGE_BYTES, reports_loss=True)
"""An event is one message: every reader refuses a longer payload, so that it need not wait."""


@dataclass(eq=False, slots=True, weakref_slot=True)
class SampleQueue:
    """Waiting samples of one subscription, oldest first. deliveries: calls of `take` that the node still owes, at
    least one for each sample; dropped: samples lost since the last of these calls."""

    samples: dict[Hashable, Sample] = field(default_factory=dict)
    bytes: int = 0
    deliveries: int = 0
    dropped: int = 0


class SampleBacklog:
    """The samples that wait for a node, over all its subscriptions of one kind. For any thread.

    When they become too many, the subscription with the most waiting bytes loses its oldest sample: "longest queue
    drop" (B. Suter et al., INFOCOM 1998). A flood on one key costs the subscriptions to other keys nothing.
    """

    def __init__(self, bounds: Bounds) -> None:
        self.bounds = bounds
        self.bytes = 0
        self._queues: WeakSet[SampleQueue] = WeakSet()
        self._lock = threading.Lock()

    def add_queue(self) -> SampleQueue:
        """A queue for one more subscription. It counts as long as it is referenced."""
        queue = SampleQueue()
        with self._lock:
            self._queues.add(queue)
        return queue

    def put(self, queue: SampleQueue, slot: Hashable, sample: Sample) -> bool:
        """Let a sample wait, in place of the one in the same slot. True if the node has to call `take` once more."""
        size = _size(sample)
        with self._lock:
            replaced = queue.samples.get(slot)
            queue.samples[slot] = sample  # a replaced sample keeps its turn
            growth = size if replaced is None else size - _size(replaced)
            queue.bytes += growth
            self.bytes += growth
            if self.bytes > self.bounds.bytes or len(queue.samples) > self.bounds.samples:
                self._make_room(queue, slot, size)
            if queue.deliveries >= len(queue.samples):
                return False
            queue.deliveries += 1
            return True

    def take(self, queue: SampleQueue) -> tuple[Sample | None, int]:
        """Take the oldest sample, None if it was dropped, and the number of samples lost since the last call."""
        with self._lock:
            queue.deliveries -= 1
            dropped, queue.dropped = queue.dropped, 0
            if not queue.samples:
                return None, dropped
            return self._remove(queue, next(iter(queue.samples))), dropped

    def _make_room(self, queue: SampleQueue, newest: Hashable, size: int) -> None:
        """Drop samples until the bounds hold, but not the newest one, which has `size` bytes in `queue`."""
        if len(queue.samples) > self.bounds.samples:
            self._drop_oldest(queue, newest)
        while self.bytes > max(self.bounds.bytes, size):
            older = {each: each.bytes - (size if each is queue else 0) for each in self._queues}
            largest = max(older, key=older.__getitem__)
            self._drop_oldest(largest, newest if largest is queue else None)

    def _drop_oldest(self, queue: SampleQueue, keep: Hashable | None) -> None:
        self._remove(queue, next(slot for slot in queue.samples if slot != keep))
        queue.dropped += 1

    def _remove(self, queue: SampleQueue, slot: Hashable) -> Sample:
        sample = queue.samples.pop(slot)
        size = _size(sample)
        queue.bytes -= size
        self.bytes -= size
        return sample


class Inbox:
    """The way of one subscription's samples to its node.

    backlog: of the node; deliver: gets each sample, on the node's thread; wake: makes the node run an action soon;
    latest_only: a sample replaces one of the same key; label: node and key expression, for the log.
    """

    def __init__(
        self,
        backlog: SampleBacklog,
        deliver: Callable[[Sample], None],
        wake: Callable[[Callable[[], None]], None],
        *,
        latest_only: bool,
        label: str,
    ) -> None:
        self._backlog = backlog
        self._deliver = deliver
        self._wake = wake
        self._latest_only = latest_only
        self._label = label
        self._queue = backlog.add_queue()
        self._numbers = count()

    def receive(self, sample: Sample) -> None:
        """Let a sample wait until the node has time for it. On any thread."""
        size, most = len(sample.payload) + len(sample.attachment), self._backlog.bounds.largest
        if size > most:
            logger.warning("%s: left out a sample of %d bytes; at most %d are accepted", self._label, size, most)
        elif self._backlog.put(self._queue, sample.key if self._latest_only else next(self._numbers), sample):
            self._wake(self._deliver_oldest)

    def _deliver_oldest(self) -> None:
        sample, dropped = self._backlog.take(self._queue)
        if dropped and self._backlog.bounds.reports_loss:
            logger.error("%s: lost %d events that waited while the node was busy", self._label, dropped)
        if sample is not None:
            self._deliver(sample)


def _size(sample: Sample) -> int:
    return len(sample.payload) + len(sample.attachment) + SAMPLE_OVERHEAD
