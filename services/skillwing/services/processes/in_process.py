"""All nodes of a robot's table in this process: on one in-process network, in virtual time."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from types import TracebackType
from typing import Self

from skillwing.dsl.model import UnknownNameError
from skillwing.services.bus import Bus, Node
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.names import RESOURCE_MANAGER
from skillwing.services.processes.hosting import appear
from skillwing.services.processes.node_host import make_node
from skillwing.services.protocol import Keys
from skillwing.services.robot import ProcessSpec, Robot


class RobotInProcess:
    """The counterpart of `Launcher` without real processes: starts the nodes of a table one by one, and ends them.

    robot: owner of the table. network: network of the nodes. The default is a new one without jitter, on which the same
    table gives the same run, bit by bit.
    """

    def __init__(self, robot: Robot, network: InProcessNetwork | None = None) -> None:
        self.network = network or InProcessNetwork()
        self._robot = robot
        self._keys = Keys(robot.skillset.stem)
        self._running: dict[str, tuple[Node, Bus]] = {}

    def start(self, specs: Iterable[ProcessSpec]) -> None:
        """Make each node and attach it. Raises as `make_node` does, and ValueError for a name that runs already."""
        for spec in specs:
            self.attach(make_node(_uncontended(spec)))

    def attach(self, node: Node) -> Bus:
        """Attach a node to the network; it gets the liveliness token of a process as soon as it is ready."""
        bus = self.network.bus(node.name, self._robot.name)
        node.attach(bus)
        appear(node, bus, self._keys.alive(node.name))
        self._running[node.name] = node, bus
        return bus

    def kill(self, process: str) -> None:
        """End a process at once, as kill -9 does. Raises UnknownNameError for a process that does not run."""
        if process not in self._running:
            raise UnknownNameError("process", process, self._running)
        self._running.pop(process)[1].close()

    def close(self) -> None:
        """End all processes in order, the last one first. Idempotent."""
        while self._running:
            node, bus = self._running.popitem()[1]
            node.detach()
            bus.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None):
        self.close()


def _uncontended(spec: ProcessSpec) -> ProcessSpec:
    """The resource manager without its leader election: names on this network are unique."""
    if spec.name != RESOURCE_MANAGER:
        return spec
    return replace(spec, options={**spec.options, "contended": False})
