"""Robots at a router, found by the alive tokens of their processes."""

from __future__ import annotations

import zenoh

from skillwing.services.bus.identity import SessionIdentity
from skillwing.services.bus.zenoh_session import CONNECT_TIMEOUT, open_client
from skillwing.services.names import RESOURCE_MANAGER
from skillwing.services.protocol import Keys

ANSWER_TIMEOUT = 2.0
"""Seconds that a router has to list its tokens."""


def robots_at(
    endpoint: str,
    robot: str | None = None,
    timeout: float = CONNECT_TIMEOUT,
    identity: SessionIdentity | None = None,
    process: str = RESOURCE_MANAGER,
) -> dict[str, str]:
    """The robots at a router, each with the name of its skillset.

    robot: looks for this one only, and needs no permission to see others. timeout: of the connection, in seconds.
    identity: for a router with keys. process: that the robot has to have; by default the one that all have.
    Raises RouterUnreachableError.
    """
    with open_client(endpoint, robot, timeout, identity) as session:
        if robot is None:
            return robots_seen(session)
        keys = _tokens(session, Keys("*").alive(process))
    return {robot: keys[0].partition("/")[0]} if keys else {}


def robots_seen(session: zenoh.Session) -> dict[str, str]:
    """The robots that a session without a namespace sees, each with the name of its skillset."""
    parts = [key.split("/") for key in sorted(_tokens(session, f"robot/*/{Keys('*').alive(RESOURCE_MANAGER)}"))]
    return {name: skillset for _, name, skillset, *_ in parts}


def _tokens(session: zenoh.Session, expression: str) -> list[str]:
    replies = session.liveliness().get(expression, timeout=ANSWER_TIMEOUT)
    return [str(reply.ok.key_expr) for reply in replies if reply.ok is not None]
