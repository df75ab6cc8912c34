"""A site for tests: keys of a robot and of people, and a router with them or, for comparison, without."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import msgspec
import zenoh
from command_line import run_command

from skillwing.services.access.identity_files import process_identity, read_identity
from skillwing.services.access.key_store import KeyStore
from skillwing.services.access.policy import RobotAccess
from skillwing.services.bus.identity import WHO, SessionIdentity
from skillwing.services.bus.zenoh_session import open_client
from skillwing.services.processes.router import LOOPBACK, LOOPBACK_WITH_KEYS, start_router
from skillwing.services.terminal.exit_codes import OK
from skillwing.services.wire.channel import Role

PEOPLE = {"vic": Role.VIEWER, "alice": Role.CLIENT, "bob": Role.CLIENT, "olga": Role.OPERATOR}


def make_store(folder: Path, *robots: RobotAccess) -> KeyStore:
    """Keys of robots, and of a person of each role."""
    store = KeyStore.init(folder, ["127.0.0.1"])
    for robot in robots:
        store.add_robot(robot)
    for name, role in PEOPLE.items():
        store.add_person(name, role)
    return store


@dataclass
class Site:
    """A router, and sessions around it. store: None for a router without keys."""

    robot: str
    endpoint: str
    router: zenoh.Session
    store: KeyStore | None
    _stack: ExitStack = field(default_factory=ExitStack)

    def identity(self, name: str, home: str | None = None) -> SessionIdentity | None:
        """The identity of a person, or of a process of the robot `home`; None without keys."""
        if self.store is None:
            return None
        if name in PEOPLE:
            return read_identity(self.store.folder / "people" / name)
        return process_identity(self.store.folder, home or self.robot, name)

    def session(self, name: str, robot: str | None = None, home: str | None = None) -> zenoh.Session:
        """A plain session that shows the certificate of a person or process, closed at the end."""
        session = open_client(self.endpoint, robot or self.robot, 5.0, self.identity(name, home))
        return self._stack.enter_context(session)

    def close(self) -> None:
        """Close all sessions, and the router."""
        self._stack.close()
        self.router.close()


@contextmanager
def opened_site(robot: str, store: KeyStore | None) -> Iterator[Site]:
    """A router on loopback, with the keys of a store or without any."""
    if store is None:
        session, endpoint = start_router(LOOPBACK)
    else:
        session, endpoint = start_router(LOOPBACK_WITH_KEYS, store.folder)
    site = Site(robot, endpoint, session, store)
    try:
        yield site
    finally:
        site.close()


def free_port() -> int:
    """A port on loopback that nobody listens at."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def _confirm(query: zenoh.Query) -> None:
    query.reply(query.key_expr, b"")


@contextmanager
def opened_by_file(robot: str, store: KeyStore, endpoint: str, *, confirms: bool = True) -> Iterator[Site]:
    """A router of Zenoh's own, with the file of `skillwing access-control` and the settings that docs/keys.md names.

    confirms: it answers who asks for its role, as no `zenohd` does.

    `zenohd` reads its file in the same way: by `Config.from_file`, for a session in the mode `router`.
    """
    file = store.folder / "router.json5"
    said = run_command("access-control", str(file), "--keys", str(store.folder))
    assert said.code == OK, said.error
    config = zenoh.Config.from_file(str(file))
    config.insert_json5("mode", '"router"')
    config.insert_json5("listen/endpoints", f'["{endpoint}"]')
    config.insert_json5("scouting/multicast/enabled", "false")
    folder = store.router_folder
    tls = {
        "enable_mtls": True,
        "root_ca_certificate": str(folder / "authority.pem"),
        "listen_certificate": str(folder / "certificate.pem"),
        "listen_private_key": str(folder / "key.pem"),
        "close_link_on_expiration": True,
    }
    config.insert_json5("transport/link/tls", msgspec.json.encode(tls).decode())
    session = zenoh.open(config)
    # For the tests, which ask here whether the router has handled all that a session sent before.
    if confirms:
        session.declare_queryable(f"robot/*/{WHO}/*", zenoh.handlers.Callback(_confirm, indirect=False))
    site = Site(robot, endpoint, session, store)
    try:
        yield site
    finally:
        site.close()
