"""What was seen of a system and of the machine that it runs on; no judgement yet."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from skillwing.services.diagnosis.unattended import Unattended
from skillwing.services.processes.proc_files import Listener
from skillwing.services.processes.process_monitor import Entry
from skillwing.services.protocol import DataReading, ErrorReply, GoalStatus
from skillwing.services.robot import ClockKind


@dataclass(frozen=True)
class Reply:
    """What one process said to a question. version: of the protocol that it speaks, None if that cannot be read.

    refusal: the typed error, if it was one.
    """

    replier: str
    version: int | None
    payload: bytes
    refusal: ErrorReply | None = None


@dataclass(frozen=True)
class Probe:
    """One process was asked something that changes nothing. replies: one for each process that answered."""

    process: str
    replies: tuple[Reply, ...]


@dataclass(frozen=True)
class ClockSeen:
    """Robot time while it was looked at.

    watched: wall seconds; ticks: how many came; elapsed: robot seconds between the first and the last of them, which
    were `between` wall seconds apart; factor: robot seconds per wall second that its owner promises.
    """

    watched: float
    ticks: int = 0
    elapsed: float = 0.0
    between: float = 0.0
    factor: float = 1.0


@dataclass(frozen=True)
class Disk:
    """Where a run writes. free: bytes; writable: somebody could write there."""

    path: Path
    free: int
    writable: bool


@dataclass(frozen=True)
class SystemSeen:
    """A system that was found.

    local: it runs on this machine, and is known by its run state. router: somebody answered there as a router does;
    listener: who has its port, None if nobody or unknown. The rest is empty where there is no router.
    states: of the resources, None if nobody told; resources: their names in the skillset file. clients: who owns goals.
    published_by: of data that are published only while one of some skills runs, those skills. left_alone: where
    nobody should leave the robot, and it is, and nobody commands it.
    """

    robot: str
    endpoint: str
    skillset: Path
    clock: ClockKind
    local: bool
    router: bool
    listener: Listener | None = None
    entries: tuple[Entry, ...] = ()
    probes: tuple[Probe, ...] = ()
    clock_seen: ClockSeen | None = None
    data: tuple[DataReading, ...] = ()
    states: Mapping[str, str] | None = None
    resources: frozenset[str] = frozenset()
    goals: tuple[GoalStatus, ...] = ()
    clients: frozenset[str] = frozenset()
    disk: Disk | None = None
    published_by: Mapping[str, tuple[str, ...]] = field(default_factory=dict[str, tuple[str, ...]])
    left_alone: tuple[Unattended, ...] = ()


@dataclass(frozen=True)
class Evidence:
    """Everything that was seen.

    stale: robots with a run-state file of a process that is gone. missing: for each pip extra, the packages of it that
    are not installed. load: runnable processes, as the kernel averages them over a minute.
    """

    system: SystemSeen | None = None
    stale: tuple[str, ...] = ()
    missing: Mapping[str, tuple[str, ...]] = field(default_factory=dict[str, tuple[str, ...]])
    load: float = 0.0
    cores: int = 1
