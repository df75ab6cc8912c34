"""Zenoh sessions: one router and the sessions around it, on loopback by default, without multicast.

In the topology `router` every process is a client of the router, and a message takes two hops. In a `mesh` the
processes are peers. They find each other through the router and then connect directly over loopback: one hop.
"""

from __future__ import annotations

import errno
import json
import os
import re
from collections.abc import Mapping
from typing import Any

import zenoh

from skillwing.services.bus import Topology
from skillwing.services.bus.identity import WHO, SessionIdentity
from skillwing.services.errors import SkillwingError

LEASE = 2.0
"""Seconds after which a frozen process, or one with a broken link, counts as gone."""
CONNECT_TIMEOUT = 10.0
"""Seconds that a process waits for the router before it gives up."""
KNOWN_TIMEOUT = 2.0
"""Seconds in which a router confirms that it knows a name."""
RETRY = {"period_init_ms": 100, "period_max_ms": 1000, "period_increase_factor": 2}
"""Pauses between attempts to reach a router."""
ANY_PORT = "tcp/127.0.0.1:0"
"""Endpoint of a peer: a port that the system chooses, closed to other machines."""
RUNTIME = "ZENOH_RUNTIME"
THREADS = "(rx: (worker_threads: 1), tx: (handover: app), acc: (handover: net))"
"""Threads of Zenoh: three pools of one thread each for receiving, the network and all else, instead of five pools. A
message changes threads less often. A value of the user in the environment comes first. Not for routers."""
_PLACE_IN_SOURCE = re.compile(r"(?: \(os error \d+\))? at /\S+")


class RouterUnreachableError(SkillwingError):
    """No router answers at `endpoint`. remedy: clause on what starts one."""

    def __init__(self, endpoint: str, remedy: str = "Start the system with `skillwing up`") -> None:
        self.endpoint = endpoint
        super().__init__(f"No router answers at {endpoint}. {remedy}, or check the address and the link.")


class EndpointError(SkillwingError):
    """A router cannot listen at `endpoint`. reason: the system's words. holder: sentence about who listens there."""

    def __init__(self, endpoint: str, reason: str, holder: str = "") -> None:
        self.endpoint = endpoint
        self.reason = reason
        self.is_taken = reason == os.strerror(errno.EADDRINUSE)
        remedy = "Name an address of this machine, or 0.0.0.0 for all of them."
        if self.is_taken or reason == os.strerror(errno.EACCES):
            remedy = "Choose another port, or 0 for any free one."
        super().__init__(f"The router cannot listen at {endpoint}: {reason}. {remedy} {holder}".rstrip())


def open_router(
    endpoint: str,
    identity: SessionIdentity | None = None,
    access_control: Mapping[str, Any] | None = None,
    upper: str | None = None,
) -> zenoh.Session:
    """A session that routes between all sessions at `endpoint` (`tcp/HOST:PORT`, or `tls/...` with an identity).

    access_control: Zenoh's setting of that name, None to allow everything. upper: endpoint of a router above this one,
    which may start later. Raises EndpointError.
    """
    own: dict[str, Any] = {"listen": {"endpoints": [endpoint]}, "scouting": _scouting(delay=0)}
    if upper is not None:
        # Routers do not look for others: each has a link to the one above it.
        own["scouting"] |= {"gossip": {"enabled": False}}
        own["connect"] = {"endpoints": [upper], "timeout_ms": -1, "exit_on_failure": False, "retry": RETRY}
    if access_control is not None:
        own["access_control"] = dict(access_control)
    try:
        return _open("router", own, None if identity is None else identity.listening())
    except zenoh.ZError as error:
        raise EndpointError(endpoint, _reason(str(error))) from error


def _reason(report: str) -> str:
    """The operating system's message, without the source locations that Zenoh adds to it."""
    return _PLACE_IN_SOURCE.split(report.splitlines()[0])[0].rpartition(": ")[2]


def open_client(
    endpoint: str, robot: str | None, timeout: float = CONNECT_TIMEOUT, identity: SessionIdentity | None = None
) -> zenoh.Session:
    """A session in the robot's namespace by the router at `endpoint`; raises RouterUnreachableError.

    robot: None for a session that sees all robots, with keys `robot/NAME/...`. identity: for a router with keys.
    """
    tls = None if identity is None else identity.connecting()
    return _open_beside("client", endpoint, robot, timeout, listen=[], scouting=_scouting(delay=500), tls=tls)


def open_peer(endpoint: str, robot: str, timeout: float = CONNECT_TIMEOUT) -> zenoh.Session:
    """The same, for a process that others on this machine reach directly; raises RouterUnreachableError.

    Peers find each other through the router, and the router forwards the messages of clients. Connected peers no longer
    need it. Opening takes at most half a second, until all present peers are connected.
    """
    # One of two peers connects. Two links between them would both have to be kept alive.
    strategy = {"peer": {"to_router": "always", "to_peer": "greater-zid"}}
    scouting = {**_scouting(delay=500), "gossip": {"enabled": True, "autoconnect_strategy": strategy}}
    return _open_beside("peer", endpoint, robot, timeout, listen=[ANY_PORT], scouting=scouting)


def open_session(
    topology: Topology,
    endpoint: str,
    robot: str,
    timeout: float = CONNECT_TIMEOUT,
    identity: SessionIdentity | None = None,
) -> zenoh.Session:
    """A session for a process of that topology; raises RouterUnreachableError. Peers have no identity."""
    if topology == "mesh":
        return open_peer(endpoint, robot, timeout)
    return open_client(endpoint, robot, timeout, identity)


def role_at_router(session: zenoh.Session, identity: SessionIdentity) -> str | None:
    """The role that the router knows a session's certificate by; None for a name that it has no rules for.

    A router that is not Skillwing's has no such answer. There, any token of the robot proves that the name is known,
    and the role is empty.
    """
    for reply in session.get(f"{WHO}/{identity.name}", timeout=KNOWN_TIMEOUT):
        if reply.ok is not None:
            return reply.ok.payload.to_string()
    tokens = session.liveliness().get("**", timeout=KNOWN_TIMEOUT)
    return "" if any(reply.ok is not None for reply in tokens) else None


def _open_beside(
    mode: str,
    endpoint: str,
    robot: str | None,
    timeout: float,
    *,
    listen: list[str],
    scouting: dict[str, Any],
    tls: dict[str, Any] | None = None,
) -> zenoh.Session:
    connect = {
        "endpoints": [endpoint],
        "timeout_ms": round(timeout * 1000),
        "exit_on_failure": True,
        "retry": RETRY,
    }
    own: dict[str, Any] = {"listen": {"endpoints": listen}, "connect": connect, "scouting": scouting}
    own |= {} if robot is None else {"namespace": f"robot/{robot}"}
    try:
        return _open(mode, own, tls)
    except zenoh.ZError as error:
        raise RouterUnreachableError(endpoint) from error


def _open(mode: str, own: dict[str, Any], tls: dict[str, Any] | None = None) -> zenoh.Session:
    queue = {"size": {"data": 16}, "congestion_control": {"block": {"wait_before_close": 1_000_000}}}
    link: dict[str, Any] = {"tx": {"lease": round(LEASE * 1000), "keep_alive": 4, "queue": queue}}
    if tls is not None:
        link["tls"] = tls
    shared = {
        "mode": mode,
        "queries_default_timeout": 2000,
        "timestamping": {"enabled": True},
        "transport": {"shared_memory": {"enabled": False}, "link": link},
    }
    _choose_threads(mode)
    return zenoh.open(zenoh.Config.from_json5(json.dumps({**shared, **own})))


def _choose_threads(mode: str) -> None:
    """Choose the threads of this process and of those that it starts, before its first session.

    A router waits for a process that does not read its messages. With one thread for receiving, every other process
    would wait as well, so routers have the threads that Zenoh chooses.
    """
    if mode != "router":
        os.environ.setdefault(RUNTIME, THREADS)
    elif os.environ.get(RUNTIME) == THREADS:  # inherited from the process that started it
        del os.environ[RUNTIME]


def _scouting(delay: int) -> dict[str, Any]:
    return {"multicast": {"enabled": False}, "delay": delay}
