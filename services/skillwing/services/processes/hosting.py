"""Nodes in this process: a bus for each, and an orderly end for all.

A single node runs on the main thread. Several nodes run on a thread each, independent of each other. They end together,
because their supervisor can only restart the whole process.
"""

from __future__ import annotations

import logging
import os
import sys
import threading
import time
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from queue import Empty, Queue

from skillwing.services.bus import Bus, Node, Topology
from skillwing.services.bus.clock import Clock
from skillwing.services.bus.identity import SessionIdentity, needs_identity
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.bus.zenoh_session import RouterUnreachableError
from skillwing.services.errors import InvalidOptionError, KeysError, NotKnownError, PassingError, WrongSkillsetError
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
"""Seconds that the other nodes have to end after the first one has ended. The launcher waits longer for a process."""

logger = logging.getLogger("skillwing.node_host")


@dataclass(frozen=True, slots=True)
class NetworkAddress:
    """Address of a robot's network: namespace, router and topology. keys: folder with the processes' certificates."""

    robot: str
    endpoint: str
    topology: Topology = "router"
    keys: Path | None = None

    def identity(self, process: str) -> SessionIdentity | None:
        """The identity of a process; None for a router without keys. Raises KeysError."""
        if not needs_identity(self.endpoint):
            return None
        if self.keys is None:
            raise KeysError(f"The router at {self.endpoint} asks for a key. Name a folder: --keys or SKILLWING_KEYS.")
        # A process without keys does not load the code for certificates.
        from skillwing.services.access.identity_files import process_identity  # noqa: PLC0415

        return process_identity(self.keys, self.robot, process)


@dataclass(frozen=True, slots=True)
class HostedNode:
    """A node with its clock. alive: key of its liveliness token, None for none."""

    name: str
    node: Node
    clock: Clock
    alive: str | None


class Heartbeat:
    """Touches a file once a second while every node runs. An old file means that one of them has crashed or hangs."""

    def __init__(self, file: Path, nodes: Iterable[str]) -> None:
        self._file = file
        self._nodes = frozenset(nodes)
        self._awaited = set(self._nodes)
        self._lock = threading.Lock()

    def keep(self, bus: Bus) -> None:
        """Take part on a node's own thread from now on."""
        with self._lock:
            self._awaited.discard(bus.name)
            if not self._awaited:
                with suppress(OSError):  # a full disk: the file is older than the next look at it
                    self._file.touch()
                self._awaited.update(self._nodes)
        bus.after(HEARTBEAT_PERIOD, lambda: self.keep(bus), wall=True)


def _join(hosted: HostedNode, address: NetworkAddress, lifetime: Lifetime) -> ZenohBus | int:
    """The bus of a node, or the exit code of a process that cannot have one."""
    identity = None
    try:
        identity = address.identity(hosted.name)
        return ZenohBus(
            hosted.name, address.robot, address.endpoint, hosted.clock, topology=address.topology, identity=identity
        )
    except KeysError as error:
        return give_up(error, EXIT_CONFIGURATION, who=hosted.name)
    except RouterUnreachableError as error:
        from skillwing.services.access.handshake import explained  # noqa: PLC0415 - as in `NetworkAddress.identity`

        reason = explained(error, identity)
        # What else is there may give way to the router.
        code = EXIT_CONFIGURATION if isinstance(reason, NotKnownError) else EXIT_UNREACHABLE
        return EXIT_OK if lifetime.over else give_up(reason, code, who=hosted.name)
    except Exception:
        logger.exception("%s could not join the others", hosted.name)
        return EXIT_CRASHED


def live(hosted: HostedNode, address: NetworkAddress, lifetime: Lifetime, heartbeat: Heartbeat | None = None) -> int:
    """Run a node on this thread until the process has to end; returns the exit code.

    A request to end during the search for the router is a good end.
    """
    bus = _join(hosted, address, lifetime)
    if isinstance(bus, int):
        return bus
    lifetime.on_end(lambda: bus.post(lambda: None))
    try:
        hosted.node.attach(bus)
        if hosted.alive is not None:
            appear(hosted.node, bus, hosted.alive)
        if heartbeat is not None:
            heartbeat.keep(bus)
        logger.info("%s runs", bus.name)
        bus.run_until(lambda: lifetime.over)
        if bus.closed:
            return EXIT_OK if getattr(hosted.node, "over", False) else EXIT_REPLACED
        hosted.node.detach()
    except (WrongSkillsetError, InvalidOptionError, PassingError) as error:
        # Wrong files or options may be found later than at the start, such as by an answer of another robot.
        code = EXIT_PASSING if isinstance(error, PassingError) else EXIT_CONFIGURATION
        return give_up(error, code, who=hosted.name)
    except Exception:
        logger.exception("%s crashed", bus.name)
        return EXIT_CRASHED
    finally:
        bus.close()
    logger.info("%s ended", bus.name)
    return EXIT_OK


def live_together(
    nodes: Sequence[HostedNode], address: NetworkAddress, lifetime: Lifetime, heartbeat: Heartbeat | None = None
) -> int:
    """Run each node on a thread of its own until the process has to end, or one of the nodes ends.

    Returns the exit code of the first node that did not end well. Call it on the main thread. No thread can be made to
    end: if a node blocks its thread, the process exits without it.
    """
    ends: Queue[tuple[str, int]] = Queue()

    def run(node: HostedNode) -> None:
        code = EXIT_CRASHED
        try:
            code = live(node, address, lifetime, heartbeat)
        finally:
            ends.put((node.name, code))
            lifetime.end()

    for node in nodes:
        threading.Thread(target=run, args=(node,), name=node.name, daemon=True).start()
    lifetime.wait()
    deadline = time.monotonic() + ENDING_GRACE
    codes: dict[str, int] = {}
    while len(codes) < len(nodes):
        try:
            name, code = ends.get(timeout=max(0.0, deadline - time.monotonic()))
        except Empty:
            break
        codes[name] = code
    result = next((code for code in codes.values() if code != EXIT_OK), EXIT_OK)
    hanging = [node.name for node in nodes if node.name not in codes]
    if hanging:
        logger.error("%s did not end in time, and the process ends without that", ", ".join(hanging))
        logging.shutdown()
        os._exit(result or EXIT_CRASHED)
    return result


def appear(node: Node, bus: Bus, alive: str) -> None:
    """Declare the liveliness token of an attached node, except for a node with `tells_when_ready`."""
    if not getattr(node, "tells_when_ready", False):
        bus.declare_alive(alive)


def give_up(error: Exception, code: int, who: str = "") -> int:
    """Print why the process cannot go on, with the node's name if it is one of several; returns the exit code."""
    with suppress(OSError):  # the log may be on a full disk
        sys.stderr.write(f"{who}: {error}\n" if who else f"{error}\n")
    return code
