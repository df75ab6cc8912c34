"""A site for tests: keys of a robot and of people, and a router with them or, for comparison, without."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import zenoh

from skillwing.services.access.identity_files import process_identity, read_identity
from skillwing.services.access.key_store import KeyStore
from skillwing.services.access.policy import RobotAccess
from skillwing.services.bus.identity import SessionIdentity
from skillwing.services.bus.zenoh_session import open_client
from skillwing.services.processes.router import LOOPBACK, LOOPBACK_WITH_KEYS, start_router
from skillwing.services.wire.channel import Role

PEOPLE = {"vic": Role.VIEWER, "alice": Role.CLIENT, "bob": Role.CLIENT, "olga": Role.OPERATOR}


def make_store(folder: Path, robot: RobotAccess) -> KeyStore:
    """Keys of a robot, and of a person of each role."""
    store = KeyStore.init(folder, ["127.0.0.1"])
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

    def identity(self, name: str) -> SessionIdentity | None:
        """The identity of a person or process; None without keys."""
        if self.store is None:
            return None
        if name in PEOPLE:
            return read_identity(self.store.folder / "people" / name)
        return process_identity(self.store.folder, self.robot, name)

    def session(self, name: str, robot: str | None = None) -> zenoh.Session:
        """A plain session that shows the certificate of a person or process, closed at the end."""
        session = open_client(self.endpoint, robot or self.robot, 5.0, self.identity(name))
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
