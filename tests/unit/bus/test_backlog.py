"""Backlogs of a busy node: bounded in number and in bytes, with the newest kept, and each sample taken once."""

from __future__ import annotations

import logging
import sys
from collections import deque
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from skillwing.services.bus import Sample
from skillwing.services.bus.backlog import (
    EVENTS,
    SAMPLE_OVERHEAD,
    STREAMS,
    Bounds,
    Inbox,
    RequestBacklog,
    SampleBacklog,
)
from skillwing.services.protocol import MAX_MESSAGE_BYTES


@given(
    most_requests=st.integers(1, 5),
    most_bytes=st.integers(0, 20),
    steps=st.lists(st.none() | st.integers(0, 30), max_size=60),
)
def test_the_backlog_is_bounded_and_an_idle_node_takes_any_request(
    most_requests: int, most_bytes: int, steps: list[int | None]
) -> None:
    """A number stands for a request of so many bytes, None for the node taking one up."""
    backlog, waiting = RequestBacklog(most_requests, most_bytes), deque[int]()
    for size in steps:
        if size is None:
            if waiting:
                backlog.leave(waiting.popleft())
            continue
        fits = len(waiting) < most_requests and sum(waiting) + size <= most_bytes
        let_in = backlog.enter(size)
        assert let_in == (fits or not waiting)
        if let_in:
            waiting.append(size)


def sample(size: int, key: str = "x") -> Sample:
    """A sample that counts as `size` bytes."""
    return Sample(key, bytes(size - SAMPLE_OVERHEAD))


def bounds(samples: int, size: int) -> Bounds:
    return Bounds(samples=samples, bytes=size, largest=size, reports_loss=False)


STEPS = st.lists(
    st.tuples(st.integers(0, 2), st.none() | st.tuples(st.integers(0, 3), st.integers(512, 1500))), max_size=60
)
"""Each step names a subscription, and the slot and size of a sample for it; without them its node takes a sample."""


@given(most_samples=st.integers(1, 4) | st.just(sys.maxsize), most_bytes=st.integers(1500, 5000), steps=STEPS)
def test_waiting_samples_are_bounded_the_newest_is_kept_and_none_is_forgotten(
    most_samples: int, most_bytes: int, steps: list[tuple[int, tuple[int, int] | None]]
) -> None:
    backlog = SampleBacklog(bounds(most_samples, most_bytes))
    queues = [backlog.add_queue() for _ in range(3)]
    owed = [0, 0, 0]
    for which, arrival in steps:
        queue = queues[which]
        if arrival is not None:
            slot, size = arrival
            newest = sample(size)
            owed[which] += backlog.put(queue, slot, newest)
            assert queue.samples[slot] is newest
        elif owed[which]:
            oldest = next(iter(queue.samples.values()), None)
            owed[which] -= 1
            assert backlog.take(queue)[0] is oldest
        waiting = [len(each.payload) + SAMPLE_OVERHEAD for queue in queues for each in queue.samples.values()]
        assert backlog.bytes == sum(waiting) <= most_bytes
        assert all(len(queue.samples) <= most_samples for queue in queues)
        assert all(len(queue.samples) <= deliveries for queue, deliveries in zip(queues, owed, strict=True))
    for queue, deliveries in zip(queues, owed, strict=True):
        for _ in range(deliveries):
            backlog.take(queue)
        assert not queue.samples
    assert backlog.bytes == 0


def test_the_subscription_that_holds_most_loses_its_oldest() -> None:
    backlog = SampleBacklog(bounds(sys.maxsize, 10_000))
    flooded, quiet = backlog.add_queue(), backlog.add_queue()
    backlog.put(quiet, 0, sample(600))
    for number in range(50):
        backlog.put(flooded, number, sample(1000))
    assert list(flooded.samples) == list(range(41, 50))
    assert list(quiet.samples) == [0]
    assert backlog.take(flooded) == (sample(1000), 41)
    assert backlog.take(flooded) == (sample(1000), 0)


def test_a_sample_that_replaces_another_keeps_its_turn() -> None:
    backlog = SampleBacklog(STREAMS)
    queue = backlog.add_queue()
    samples = [Sample("a", b"1"), Sample("b", b"1"), Sample("a", b"2")]
    assert [backlog.put(queue, each.key, each) for each in samples] == [True, True, False]
    assert backlog.take(queue) == (Sample("a", b"2"), 0)
    assert backlog.take(queue) == (Sample("b", b"1"), 0)


def inbox(backlog: SampleBacklog, delivered: list[Sample], tasks: list[Callable[[], None]]) -> Inbox:
    return Inbox(backlog, delivered.append, tasks.append, latest_only=False, label="n on x")


def test_events_wait_in_any_number_and_what_is_no_message_does_not_wait(caplog: pytest.LogCaptureFixture) -> None:
    delivered: list[Sample] = []
    tasks: list[Callable[[], None]] = []
    box = inbox(SampleBacklog(EVENTS), delivered, tasks)
    for _ in range(5000):
        box.receive(Sample("x", b"event"))
    box.receive(Sample("x", bytes(MAX_MESSAGE_BYTES + 1)))
    for task in tasks:
        task()
    assert delivered == [Sample("x", b"event")] * 5000
    assert [record.message for record in caplog.records] == [
        f"n on x: left out a sample of {MAX_MESSAGE_BYTES + 1} bytes; at most {MAX_MESSAGE_BYTES} are accepted"
    ]


def test_lost_events_are_reported_once(caplog: pytest.LogCaptureFixture) -> None:
    delivered: list[Sample] = []
    tasks: list[Callable[[], None]] = []
    box = inbox(SampleBacklog(EVENTS), delivered, tasks)
    large = bytes(MAX_MESSAGE_BYTES)
    for number in range(40):
        box.receive(Sample(str(number), large))
    while tasks:
        tasks.pop(0)()
    assert [each.key for each in delivered] == [str(number) for number in range(9, 40)]
    assert [(record.levelno, record.message) for record in caplog.records] == [
        (logging.ERROR, "n on x: lost 9 events that waited while the node was busy")
    ]
