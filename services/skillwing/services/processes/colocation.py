"""Which nodes of a system share a process."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from skillwing.services.names import DATA_MANAGER, skill_process
from skillwing.services.processes.restart_policy import Restart
from skillwing.services.robot import ProcessSpec

MANAGERS = "managers"
"""Name of the process that hosts managers which do not have one of their own."""


@dataclass(frozen=True)
class Household:
    """The nodes of one process. name: the process's, which is that of a node that lives alone."""

    name: str
    nodes: tuple[ProcessSpec, ...]

    @property
    def shared(self) -> bool:
        """It goes by a name that is none of its nodes'."""
        return self.nodes[0].host is not None

    @property
    def essential(self) -> bool:
        return any(node.essential for node in self.nodes)

    @property
    def restart(self) -> Restart:
        """All of them begin again, or none."""
        return "never" if any(node.restart == "never" for node in self.nodes) else "always"


def households(specs: Iterable[ProcessSpec]) -> tuple[Household, ...]:
    """The processes of a table, in its order; nodes with the same host share one."""
    found: dict[str, list[ProcessSpec]] = {}
    for spec in specs:
        found.setdefault(spec.host or spec.name, []).append(spec)
    return tuple(Household(name, tuple(nodes)) for name, nodes in found.items())


def colocated(specs: Iterable[ProcessSpec]) -> tuple[ProcessSpec, ...]:
    """The same table with the data manager and all skill managers in one process.

    The resource manager keeps its own. It judges the others: when their process dies it has to be there to call their
    goals lost and to free what they hold, and no hook may keep it from that. Whatever is no manager keeps its own, too.
    A robot can do without one of its skills, but not without the process that hosts them all.
    """
    return tuple(replace(spec, host=MANAGERS, essential=True) if _may_share(spec) else spec for spec in specs)


def _may_share(spec: ProcessSpec) -> bool:
    return spec.name == DATA_MANAGER or spec.name.startswith(skill_process(""))
