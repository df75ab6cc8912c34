"""Error of a router that cannot listen, in the operating system's words."""

from __future__ import annotations

import socket

import pytest

from skillwing.services.bus.zenoh_session import EndpointError
from skillwing.services.processes.router import start_router


def test_a_port_that_is_taken_is_one_plain_sentence() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        listen = f"tcp/127.0.0.1:{taken.getsockname()[1]}"
        with pytest.raises(EndpointError) as refused:
            start_router(listen)
    reason = "Address already in use. Choose another port, or 0 for any free one."
    assert str(refused.value) == f"The router cannot listen at {listen}: {reason}"
