"""The mailbox of a node: nothing is lost, and no wait is longer than it may be."""

from __future__ import annotations

import threading

from skillwing.services.bus.mailbox import Mailbox

PATIENCE = 30.0
WRITERS, EACH = 4, 2000


def test_actions_of_several_threads_arrive_once_and_in_the_order_of_their_thread() -> None:
    mailbox, seen = Mailbox(), []

    def write(writer: int) -> None:
        for number in range(EACH):
            mailbox.put(lambda number=number: seen.append((writer, number)))

    threads = [threading.Thread(target=write, args=(writer,)) for writer in range(WRITERS)]
    for thread in threads:
        thread.start()
    while len(seen) < WRITERS * EACH:
        # One that arrives while the mailbox is looked at ends the wait, too.
        assert mailbox.wait(PATIENCE) or mailbox.wait(PATIENCE)
        while len(mailbox):
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


def test_a_signal_handler_may_put_something_in_while_its_thread_does_the_same() -> None:
    mailbox = Mailbox()
    mailbox.put(lambda: mailbox.put(lambda: None))
    mailbox.take()()
    assert mailbox.wait(0.0)
    assert len(mailbox) == 1


def test_without_a_limit_it_waits_for_the_first_action() -> None:
    mailbox = Mailbox()
    writer = threading.Timer(0.01, lambda: mailbox.put(lambda: None))
    writer.start()
    assert mailbox.wait(None)
    writer.join()
