"""Missions of a run, from the records of their phases: when each ran, and how it ended."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from skillwing.services.history.files import MISSIONS_FILE, TIMELINE_FILE, iterate
from skillwing.services.history.history import PHASES, History
from skillwing.services.history.parts import part_paths
from skillwing.services.protocol import MissionPhase, Record, RecordKind


@dataclass(frozen=True, slots=True)
class MissionInterval:
    """One mission from its begin to its end, in robot time.

    number: counts the missions of a run, from 1 on. end: None for the last mission without a record of its end.
    phase: the last one; None without a record of the end.
    """

    number: int
    mission: str
    begin: float
    end: float | None = None
    phase: MissionPhase | None = None

    @property
    def name(self) -> str:
        return f"{self.number}-{self.mission}"


def mission_intervals(records: Iterable[Record]) -> tuple[MissionInterval, ...]:
    """The missions of a run, from its records in order of time.

    A mission that never began, because the robot was not ready, ends when it is given up. One without a record of its
    end is over just before the next one begins.
    """
    return tuple(
        _intervals(record for record in records if record.kind is RecordKind.MISSION and record.after in PHASES)
    )


def _intervals(phases: Iterable[Record]) -> Iterator[MissionInterval]:
    number, current = 0, None
    for record in phases:
        if current is not None and (record.subject != current.mission or record.before == "IDLE"):
            # Just before: this record belongs to the next mission, and may hold the end of that one.
            yield replace(current, end=max(current.begin, math.nextafter(record.t, -math.inf)))
            current = None
        if current is None:
            number += 1
            current = MissionInterval(number, record.subject, record.t)
        if MissionPhase(record.after).over:
            yield replace(current, end=record.t, phase=MissionPhase(record.after))
            current = None
    if current is not None:
        yield current


def read_phases(run_dir: Path) -> History:
    """The phases of all missions of a run. A run of an earlier version has them in its timeline only."""
    name = MISSIONS_FILE if part_paths(run_dir, MISSIONS_FILE) else TIMELINE_FILE
    records = iterate(run_dir, name, Record)
    return History.of(each for each in records if each.kind is RecordKind.MISSION and each.after in PHASES)
