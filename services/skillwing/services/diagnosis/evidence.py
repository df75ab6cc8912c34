"""Evidence about a system and its machine, as input of the rules in findings.py."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path

from skillwing.services.diagnosis.unattended import Unattended
from skillwing.services.processes.proc_files import Listener
from skillwing.services.processes.process_monitor import ProcessStatus
from skillwing.services.protocol import DataReading, ErrorReply, GoalStatus
from skillwing.services.robot import ClockKind


@dataclass(frozen=True)
class ProbeReply:
    """Reply of one process. version: of its protocol, None if that cannot be read. refusal: the typed error, if any."""

    replier: str
    version: int | None
    payload: bytes
    refusal: ErrorReply | None = None


@dataclass(frozen=True)
class Probe:
    """A question to one process that changes nothing. replies: one for each process that answered."""

    process: str
    replies: tuple[ProbeReply, ...]


@dataclass(frozen=True)
class ClockSeen:
    """Robot time during a measurement.

    watched: wall seconds. ticks: their number. elapsed: robot seconds between the first and the last tick. between:
    wall seconds between them. factor: robot seconds per wall second that the clock's owner promises.
    """

    watched: float
    ticks: int = 0
    elapsed: float = 0.0
    between: float = 0.0
    factor: float = 1.0


@dataclass(frozen=True)
class Disk:
    """Directory of a run. free: bytes. writable: a test file could be written."""

    path: Path
    free: int
    writable: bool


@dataclass(frozen=True)
class SystemSeen:
    """A system that was found.

    local: it runs on this machine, and has a run state. router: a router answers. listener: process at its port, None
    if unknown. Without a router the rest is empty.
    states: of the resources, None if unknown. resources: their names in the skillset file. clients: owners of goals.
    lost: goals that were lost, each the latest of its skill by the run's recording. published_by: skills without which
    a datum is not published, by datum. unattended: set if the robot is away from its rescue goal, and nobody commands
    it. exposed: address of a router without keys that strangers can reach. objection: sentences with the reason for
    which the router rejects this user's keys. keys: end of validity of each certificate that is known here, by name.
    """

    robot: str
    endpoint: str
    skillset: Path
    clock: ClockKind
    local: bool
    router: bool
    listener: Listener | None = None
    processes: tuple[ProcessStatus, ...] = ()
    probes: tuple[Probe, ...] = ()
    clock_seen: ClockSeen | None = None
    data: tuple[DataReading, ...] = ()
    states: Mapping[str, str] | None = None
    resources: frozenset[str] = frozenset()
    goals: tuple[GoalStatus, ...] = ()
    lost: tuple[GoalStatus, ...] = ()
    clients: frozenset[str] = frozenset()
    disk: Disk | None = None
    published_by: Mapping[str, tuple[str, ...]] = field(default_factory=dict[str, tuple[str, ...]])
    unattended: Unattended | None = None
    exposed: str | None = None
    objection: str | None = None
    keys: Mapping[str, datetime] = field(default_factory=dict[str, datetime])


@dataclass(frozen=True)
class Examination:
    """All evidence.

    robot: the one that was asked for, None for any. malformed: sentences on the address that was given, if it is none.
    stale: robots with a run-state file of a process that is gone. missing: packages that are not installed, by pip
    extra. load: runnable processes, as the kernel's average over a minute. now: the time of the examination.
    """

    robot: str | None = None
    system: SystemSeen | None = None
    malformed: str | None = None
    stale: tuple[str, ...] = ()
    missing: Mapping[str, tuple[str, ...]] = field(default_factory=dict[str, tuple[str, ...]])
    load: float = 0.0
    cores: int = 1
    now: datetime | None = None
