"""Missions of a run, from the records of their phases: when each ran, and how it ended."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from skillwing.services.history.files import MISSIONS_FILE, TIMELINE_FILE, iterate
from skillwing.services.history.history import PHASES, History
from skillwing.services.history.parts import part_paths
from skillwing.services.protocol import MissionPhase, Record, RecordKind

FOLDERS = "[0-9]*-*"
"""Pattern of the folders of missions in the directory of a run; see `MissionInterval.name`."""


@dataclass(frozen=True, slots=True)
class MissionInterval:
    """One mission from its begin to its end, in robot time.

    number: counts the missions of a run in the order of their begins, from 1 on. end: None for a mission without a
    record of its end, after which no other one began. phase: the last one; None without a record of the end. records:
    ids of its phases.
    """

    number: int
    mission: str
    begin: float
    end: float | None = None
    phase: MissionPhase | None = None
    records: frozenset[str] = field(default=frozenset(), compare=False)

    @property
    def name(self) -> str:
        """Name of its folder, in the form of `FOLDERS`."""
        return f"{self.number}-{self.mission}"


def mission_intervals(records: Iterable[Record]) -> tuple[MissionInterval, ...]:
    """The missions of a run, from its records in order of time.

    A mission that never began, because the robot was not ready, ends when it is given up. One without a record of its
    end is over just before the next one begins. Missions at a shared robot run beside each other: one has not ended
    while its process writes phases.
    """
    missions = _missions(record for record in records if record.kind is RecordKind.MISSION and record.after in PHASES)
    begins = [phases[0].t for phases in missions]
    return tuple(_interval(number, phases, begins[number:]) for number, phases in enumerate(missions, 1))


def _missions(phases: Iterable[Record]) -> list[list[Record]]:
    """The phases of each mission."""
    missions: list[list[Record]] = []
    running: list[list[Record]] = []
    for record in phases:
        mission = None if record.before == MissionPhase.IDLE else _mission_of(record, running)
        if mission is None:
            mission = []
            missions.append(mission)
            running.append(mission)
        mission.append(record)
        if MissionPhase(record.after).over:
            running = [each for each in running if each is not mission]
    return missions


def _mission_of(record: Record, running: list[list[Record]]) -> list[Record] | None:
    """The running mission that a phase belongs to: that of its process, else the last one, if it has that name."""
    own = [each for each in running if each[0].subject == record.subject and writer_of(each[0]) == writer_of(record)]
    return next(iter(own[-1:] or [each for each in running[-1:] if each[0].subject == record.subject]), None)


def writer_of(record: Record) -> str:
    """The node that wrote a record, another one after each start of its process."""
    return record.id.rpartition("#")[0]


def _interval(number: int, phases: list[Record], later: Iterable[float]) -> MissionInterval:
    """later: begins of the missions after this one."""
    first, last = phases[0], phases[-1]
    ids = frozenset(record.id for record in phases)
    if MissionPhase(last.after).over:
        return MissionInterval(number, first.subject, first.t, last.t, MissionPhase(last.after), ids)
    following = next((begin for begin in later if begin >= last.t), None)
    # Just before: the record at that time belongs to the next mission.
    end = None if following is None else max(first.t, math.nextafter(following, -math.inf))
    return MissionInterval(number, first.subject, first.t, end, None, ids)


def read_phases(run_dir: Path) -> History:
    """The phases of all missions of a run. A run of an earlier version has them in its timeline only."""
    name = MISSIONS_FILE if part_paths(run_dir, MISSIONS_FILE) else TIMELINE_FILE
    records = iterate(run_dir, name, Record)
    return History.of(each for each in records if each.kind is RecordKind.MISSION and each.after in PHASES)
