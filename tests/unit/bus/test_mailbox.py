"""The mailbox of a node: nothing is lost, and no wait is longer than it may be."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

from skillwing.services.bus.mailbox import Mailbox

PATIENCE = 30.0
WRITERS, EACH = 4, 2000


class SlowLock:
    """A lock whose writers are delayed between two steps. meanwhile: done in the delay, once."""

    def __init__(self, meanwhile: Callable[[], None]) -> None:
        self._lock = threading.Lock()
        self._meanwhile: Callable[[], None] | None = meanwhile
        self.acquire, self.release = self._lock.acquire, self._lock.release

    def locked(self) -> bool:
        found = self._lock.locked()
        if (meanwhile := self._meanwhile) is not None:
            self._meanwhile = None
            meanwhile()
        return found


def put_while(mailbox: Mailbox, meanwhile: Callable[[], None]) -> None:
    """Put an action in, and do something else at the moment before the reader is woken."""
    lock = SlowLock(meanwhile)
    lock.acquire()
    mailbox._silent = lock  # pyright: ignore[reportPrivateUsage, reportAttributeAccessIssue]
    mailbox.put(lambda: None)


def test_a_reader_sees_an_action_before_it_is_woken() -> None:
    """The reader sleeps only without actions, and is woken for each that it has not seen."""
    mailbox, seen = Mailbox(), []
    put_while(mailbox, lambda: seen.append(len(mailbox)))
    assert seen == [1]
    assert mailbox.wait(0.0)


def test_two_writers_may_wake_the_reader_at_one_moment() -> None:
    """The second one may also be a signal handler that interrupts the first one."""
    mailbox = Mailbox()
    put_while(mailbox, lambda: mailbox.put(lambda: None))
    assert len(mailbox) == 2
    assert mailbox.wait(0.0)


def test_actions_of_several_threads_arrive_once_and_in_the_order_of_their_thread() -> None:
    mailbox, seen = Mailbox(), []

    def write(writer: int) -> None:
        for number in range(EACH):
            mailbox.put(lambda number=number: seen.append((writer, number)))

    threads = [threading.Thread(target=write, args=(writer,)) for writer in range(WRITERS)]
    for thread in threads:
        thread.start()
    deadline = time.monotonic() + PATIENCE
    while len(seen) < WRITERS * EACH and time.monotonic() < deadline:
        if mailbox.wait(1.0):
            mailbox.take()()
    for thread in threads:
        thread.join()
    for writer in range(WRITERS):
        assert [number for who, number in seen if who == writer] == list(range(EACH))


def test_a_wait_that_is_almost_over_when_it_begins_ends() -> None:
    """`queue.SimpleQueue` waits for ever in one of some thousand such rounds, on a busy machine."""
    mailbox = Mailbox()
    for _ in range(5_000):
        mailbox.put(lambda: None)
        mailbox.take()
        assert not mailbox.wait(1e-6)


def test_without_a_limit_it_waits_for_the_first_action() -> None:
    mailbox = Mailbox()
    writer = threading.Timer(0.01, lambda: mailbox.put(lambda: None))
    writer.start()
    assert mailbox.wait(None)
    writer.join()
