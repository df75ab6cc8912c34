"""So many requests wait for a busy node, and no more; each that was let in makes room when it is taken up."""

from __future__ import annotations

from collections import deque

from hypothesis import given
from hypothesis import strategies as st

from skillwing.services.bus.backlog import Backlog


@given(
    most_requests=st.integers(1, 5),
    most_bytes=st.integers(0, 20),
    steps=st.lists(st.none() | st.integers(0, 30), max_size=60),
)
def test_what_waits_is_bounded_and_whoever_comes_to_an_idle_node_is_let_in(
    most_requests: int, most_bytes: int, steps: list[int | None]
) -> None:
    """A number stands for a request of so many bytes, None for the node taking one up."""
    backlog, waiting = Backlog(most_requests, most_bytes), deque[int]()
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
