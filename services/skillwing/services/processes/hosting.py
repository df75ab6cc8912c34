"""The life of nodes in this process: a bus for each, and an end in good order for all.

A node alone lives on the main thread. Several live on a thread of their own each, so that none of them notices the
others; they end together, because whoever supervises the process can only start all of them again.
"""

from __future__ import annotations

import logging
import os
import sys
import threading
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from queue import Empty, SimpleQueue

from skillwing.services.bus import Bus, Node, Topology
from skillwing.services.bus.clock import Clock
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.bus.zenoh_session import RouterUnreachableError
from skillwing.services.errors import PassingError, WrongSkillsetError
from skillwing.services.processes.lifetime import (
    EXIT_CONFIGURATION,
    EXIT_CRASHED,
    EXIT_OK,
    EXIT_PASSING,
    EXIT_REPLACED,
    EXIT_UNREACHABLE,
    Lifetime,
)

HEARTBEAT_PERIOD = 1.0
ENDING_GRACE = 3.0
"""Seconds that the nodes of a process have for their end when one of them has come to its own; a launcher's patience
with the process is longer."""

logger = logging.getLogger("skillwing.node_host")


@dataclass(frozen=True, slots=True)
class Place:
    """Where nodes live: the robot whose namespace it is, its router, and how processes meet there."""

    robot: str
    endpoint: str
    topology: Topology = "router"


@dataclass(frozen=True, slots=True)
class Tenant:
    """A node with its clock. alive: the key of the liveliness token that it holds while it runs, None for none."""

    name: str
    node: Node
    clock: Clock
    alive: str | None


class Heartbeat:
    """Touches a file once a second while every node runs: an old one tells a crash and a hang of any of them alike."""

    def __init__(self, file: Path, nodes: Iterable[str]) -> None:
        self._file = file
        self._nodes = frozenset(nodes)
        self._awaited = set(self._nodes)
        self._lock = threading.Lock()

    def keep(self, bus: Bus) -> None:
        """Beat on a node's own thread from now on."""
        with self._lock:
            self._awaited.discard(bus.name)
            if not self._awaited:
                self._file.touch()
                self._awaited.update(self._nodes)
        bus.after(HEARTBEAT_PERIOD, lambda: self.keep(bus), wall=True)


def live(tenant: Tenant, place: Place, lifetime: Lifetime, heartbeat: Heartbeat | None = None) -> int:
    """Run a node on this thread until the process has to end; returns the exit code that this gives it.

    One that is told to end while it still looks for the router has ended well.
    """
    try:
        bus = ZenohBus(tenant.name, place.robot, place.endpoint, tenant.clock, topology=place.topology)
    except RouterUnreachableError as error:
        return EXIT_OK if lifetime.over else give_up(error, EXIT_UNREACHABLE, who=tenant.name)
    except Exception:
        logger.exception("%s could not join the others", tenant.name)
        return EXIT_CRASHED
    lifetime.on_end(lambda: bus.post(lambda: None))
    try:
        tenant.node.attach(bus)
        if tenant.alive is not None:
            appear(tenant.node, bus, tenant.alive)
        if heartbeat is not None:
            heartbeat.keep(bus)
        logger.info("%s runs", bus.name)
        bus.run_until(lambda: lifetime.over)
        if bus.closed:
            return EXIT_REPLACED
        tenant.node.detach()
    except (WrongSkillsetError, PassingError) as error:
        code = EXIT_PASSING if isinstance(error, PassingError) else EXIT_CONFIGURATION
        return give_up(error, code, who=tenant.name)
    except Exception:
        logger.exception("%s crashed", bus.name)
        return EXIT_CRASHED
    finally:
        bus.close()
    logger.info("%s ended", bus.name)
    return EXIT_OK


def live_together(
    tenants: Sequence[Tenant], place: Place, lifetime: Lifetime, heartbeat: Heartbeat | None = None
) -> int:
    """Run each node on a thread of its own until the process has to end, or one of them has come to its end.

    Returns the exit code of the first that did not end well. To be called on the main thread. Where a node keeps its
    thread from ending, which no thread can be made to do, the process ends without it, at once and for all.
    """
    ends: SimpleQueue[tuple[str, int]] = SimpleQueue()

    def run(tenant: Tenant) -> None:
        code = EXIT_CRASHED
        try:
            code = live(tenant, place, lifetime, heartbeat)
        finally:
            ends.put((tenant.name, code))
            lifetime.end()

    for tenant in tenants:
        threading.Thread(target=run, args=(tenant,), name=tenant.name, daemon=True).start()
    lifetime.wait()
    deadline = time.monotonic() + ENDING_GRACE
    codes: dict[str, int] = {}
    while len(codes) < len(tenants):
        try:
            name, code = ends.get(timeout=max(0.0, deadline - time.monotonic()))
        except Empty:
            break
        codes[name] = code
    result = next((code for code in codes.values() if code != EXIT_OK), EXIT_OK)
    hanging = [tenant.name for tenant in tenants if tenant.name not in codes]
    if hanging:
        logger.error("%s did not end in time, and the process ends without that", ", ".join(hanging))
        logging.shutdown()
        os._exit(result or EXIT_CRASHED)
    return result


def appear(node: Node, bus: Bus, alive: str) -> None:
    """Declare the liveliness token of a node that has been attached, unless it is one that `tells_when_ready`."""
    if not getattr(node, "tells_when_ready", False):
        bus.declare_alive(alive)


def give_up(error: Exception, code: int, who: str = "") -> int:
    """Say why there is no going on, for one node of several with its name, and return the exit code."""
    sys.stderr.write(f"{who}: {error}\n" if who else f"{error}\n")
    return code
