"""Error of a router that cannot listen, in the operating system's words."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from skillwing.services.access.key_store import KeyStore
from skillwing.services.bus.zenoh_session import EndpointError
from skillwing.services.processes.lifetime import EXIT_CONFIGURATION
from skillwing.services.processes.router import start_router

TIMEOUT = 60.0


def test_a_port_that_is_taken_is_one_plain_sentence() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        listen = f"tcp/127.0.0.1:{taken.getsockname()[1]}"
        with pytest.raises(EndpointError) as refused:
            start_router(listen)
    reason = "Address already in use. Choose another port, or 0 for any free one."
    assert str(refused.value) == f"The router cannot listen at {listen}: {reason}"


def test_a_port_that_is_taken_is_one_with_keys_as_well(tmp_path: Path) -> None:
    store = KeyStore.init(tmp_path / "keys", [])
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with pytest.raises(EndpointError, match="Choose another port") as refused:
            start_router(f"tls/127.0.0.1:{taken.getsockname()[1]}", store.folder)
    assert refused.value.is_taken


def test_an_address_of_another_machine_has_another_remedy() -> None:
    """192.0.2.1 is an address for documentation: no machine has it."""
    for listen in ("tcp/192.0.2.1:0", "tcp/192.0.2.1:17450"):
        with pytest.raises(EndpointError, match=r"Name an address of this machine, or 0\.0\.0\.0 for all of them\."):
            start_router(listen)


def test_an_address_that_others_reach_is_refused_without_a_word(tmp_path: Path) -> None:
    """The environment may have the word, or the keys, as in a container."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith("SKILLWING_")}

    def refused(listen: str, **given: str) -> str:
        words = [sys.executable, "-m", "skillwing.services.processes.router", "--listen", listen]
        ended = subprocess.run(
            words, env=environment | given, capture_output=True, text=True, timeout=TIMEOUT, check=False
        )
        assert ended.returncode == EXIT_CONFIGURATION
        return ended.stderr

    assert "--insecure" in refused("tcp/0.0.0.0:0")
    assert f"{tmp_path} holds no keys of a site" in refused("tls/0.0.0.0:0", SKILLWING_KEYS=str(tmp_path))
