"""Sessions of people at a router, with the keys in SKILLWING_KEYS where it asks for them."""

from __future__ import annotations

import os
from itertools import count

from skillwing.services.access.handshake import explained, unknown_name
from skillwing.services.access.identity_files import person_identity
from skillwing.services.bus.clock import Clock
from skillwing.services.bus.identity import SessionIdentity, owned_chunk
from skillwing.services.bus.router_robots import robots_at
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.bus.zenoh_session import RouterUnreachableError, open_client, role_at_router
from skillwing.services.errors import KeysError, NoSystemError, SkillwingError
from skillwing.services.names import MISSION

CONNECT_TIMEOUT = 2.0
"""Seconds that a router has to answer, as long as the lease after which a silent link counts as broken."""
_numbers = count(1)


def join(
    robot: str, endpoint: str, client: str, clock: Clock | None = None, beside: ZenohBus | None = None
) -> ZenohBus:
    """A bus of a person's command or script. client: its role, part of the node's name. beside: as `sibling`.

    Raises NoSystemError without a router, KeysError and NotKnownError where it asks for a key. InvalidOptionError for
    `tls/` at a router without keys, or the reverse.
    """
    name = f"{client}-{os.getpid()}-{next(_numbers)}"
    identity = person_identity(endpoint)
    if identity is not None:
        name = owned_chunk(identity.name, name)
    try:
        bus = ZenohBus(name, robot, endpoint, clock, CONNECT_TIMEOUT, identity=identity, sibling=beside)
    except RouterUnreachableError as error:
        raise _reason(error, identity) from error
    if not bus.is_known():
        bus.close()
        raise unknown_name(endpoint)
    return bus


def find_robots(endpoint: str, robot: str | None = None) -> dict[str, str]:
    """The robots at a router, each with the name of its skillset: this one, or all if it is not there.

    Raises as `join` does.
    """
    identity = person_identity(endpoint)
    try:
        present = robots_at(endpoint, robot, CONNECT_TIMEOUT, identity)
        if robot is not None and not present:
            present = robots_at(endpoint, timeout=CONNECT_TIMEOUT, identity=identity)
        if not present and identity is not None:
            with open_client(endpoint, robot or "any", CONNECT_TIMEOUT, identity) as session:
                if role_at_router(session, identity) is None:
                    raise unknown_name(endpoint)
    except RouterUnreachableError as error:
        raise _reason(error, identity) from error
    return present


def robots_with_missions(endpoint: str) -> list[str]:
    """Names of the robots at a router that show a mission which runs; none for a router that cannot be asked."""
    try:
        identity = person_identity(endpoint)
        present = robots_at(endpoint, timeout=CONNECT_TIMEOUT, identity=identity)
        # With keys, a session sees processes in the namespace of one robot only.
        return [each for each in present if robots_at(endpoint, each, CONNECT_TIMEOUT, identity, process=MISSION)]
    except (RouterUnreachableError, KeysError):
        return []


def _reason(error: RouterUnreachableError, identity: SessionIdentity | None) -> SkillwingError:
    reason = explained(error, identity)
    return NoSystemError(str(error), error.endpoint) if reason is error else reason
