"""Robots at a router, found by the alive tokens of their resource managers."""

from __future__ import annotations

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
) -> dict[str, str]:
    """The robots at a router, each with the name of its skillset.

    robot: looks for this one only, and needs no permission to see others. timeout: of the connection, in seconds.
    identity: for a router with keys.
    Raises RouterUnreachableError.
    """
    pattern = Keys("*").alive(RESOURCE_MANAGER)
    with open_client(endpoint, robot, timeout, identity) as session:
        replies = session.liveliness().get(pattern if robot else f"robot/*/{pattern}", timeout=ANSWER_TIMEOUT)
        keys = [str(reply.ok.key_expr) for reply in replies if reply.ok is not None]
    if robot is not None:
        return dict.fromkeys([robot], keys[0].partition("/")[0]) if keys else {}
    parts = [key.split("/") for key in sorted(keys)]
    return {name: skillset for _, name, skillset, *_ in parts}
