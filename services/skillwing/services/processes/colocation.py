"""Groups of nodes that share a process."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from skillwing.services.names import DATA_MANAGER, skill_process
from skillwing.services.robot import ProcessSpec, Restart

MANAGERS = "managers"
"""Name of the process that hosts managers without a process of their own."""


@dataclass(frozen=True)
class ProcessGroup:
    """The nodes of one process. name: of the process; a single node gives it its name."""

    name: str
    nodes: tuple[ProcessSpec, ...]

    @property
    def shared(self) -> bool:
        """True for a process with a name of its own."""
        return self.nodes[0].host is not None

    @property
    def essential(self) -> bool:
        return any(node.essential for node in self.nodes)

    @property
    def restart(self) -> Restart:
        """The policy of all nodes together: one `never` holds for all."""
        return "never" if any(node.restart == "never" for node in self.nodes) else "always"


def process_groups(specs: Iterable[ProcessSpec]) -> tuple[ProcessGroup, ...]:
    """The processes of a table, in its order; nodes with the same host share a process."""
    found: dict[str, list[ProcessSpec]] = {}
    for spec in specs:
        found.setdefault(spec.host or spec.name, []).append(spec)
    return tuple(ProcessGroup(name, tuple(nodes)) for name, nodes in found.items())


def colocated(specs: Iterable[ProcessSpec]) -> tuple[ProcessSpec, ...]:
    """The same table with the data manager and all skill managers in one process.

    The resource manager keeps its own: when the shared process dies, it ends their goals as lost and frees their
    resources, and no hook may block that. All other nodes keep their processes, too. The robot can go on without one
    skill, but not without the process that hosts them all.
    """
    return tuple(replace(spec, host=MANAGERS, essential=True) if _may_share(spec) else spec for spec in specs)


def _may_share(spec: ProcessSpec) -> bool:
    return spec.name == DATA_MANAGER or spec.name.startswith(skill_process(""))
