"""Reasons for which a router does not let a certificate in."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from skillwing.services.access.handshake import explained
from skillwing.services.access.identity_files import read_identity
from skillwing.services.access.key_store import KeyStore
from skillwing.services.bus.identity import SessionIdentity
from skillwing.services.bus.zenoh_session import RouterUnreachableError
from skillwing.services.errors import InvalidOptionError, NotKnownError
from skillwing.services.processes.router import LOOPBACK, LOOPBACK_WITH_KEYS, start_router
from skillwing.services.wire.channel import Role

TIMEOUT = 30.0


@pytest.fixture
def alice(tmp_path: Path) -> SessionIdentity:
    store = KeyStore.init(tmp_path / "keys", [])
    return read_identity(store.add_person("alice", Role.CLIENT))


@contextmanager
def answering(answer: bytes) -> Iterator[RouterUnreachableError]:
    """The error for an address at which one connection is accepted, answered and closed."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve() -> None:
            connection, _ = server.accept()
            with connection:
                connection.recv(65536)
                connection.sendall(answer)

        thread = threading.Thread(target=serve)
        thread.start()
        yield RouterUnreachableError(f"tls/127.0.0.1:{server.getsockname()[1]}")
        thread.join(TIMEOUT)
        assert not thread.is_alive()


def test_a_tunnel_without_a_router_behind_it_is_no_objection(alice: SessionIdentity) -> None:
    """`ssh -L` and the proxy of containers accept the connection, and close it."""
    with answering(b"") as error:
        assert explained(error, alice) is error


def test_another_server_is_told_apart(alice: SessionIdentity) -> None:
    with answering(b"HTTP/1.1 400 Bad Request\r\n\r\n") as error:
        reason = explained(error, alice)
    assert isinstance(reason, NotKnownError)
    assert "no TLS is spoken there" in str(reason)


def test_a_router_without_keys_is_told_apart(alice: SessionIdentity) -> None:
    session, endpoint = start_router(LOOPBACK)
    with session:
        asked = endpoint.replace("tcp/", "tls/")
        reason = explained(RouterUnreachableError(asked), alice)
    assert isinstance(reason, InvalidOptionError)
    assert str(reason).startswith(f"The router at {asked} has no keys")
    assert str(reason).endswith(f"or write {endpoint} if you mean that one.")


def test_a_router_with_keys_is_told_apart(alice: SessionIdentity) -> None:
    session, endpoint = start_router(LOOPBACK_WITH_KEYS, alice.folder.parents[1])
    with session:
        asked = endpoint.replace("tls/", "tcp/")
        reason = explained(RouterUnreachableError(asked), None)
    assert isinstance(reason, InvalidOptionError)
    assert str(reason).endswith(f"as a router with keys does. Write {endpoint}, with the folder of your keys.")


def test_an_address_at_which_something_else_listens_is_as_it_was() -> None:
    with answering(b"HTTP/1.1 400 Bad Request\r\n\r\n") as error:
        plain = RouterUnreachableError(error.endpoint.replace("tls/", "tcp/"))
        assert explained(plain, None) is plain
