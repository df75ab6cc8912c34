"""Report of a mission: its figures, its switches with their causes, and every goal."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from pathlib import Path

import msgspec

from skillwing.services.history.history import PHASES, History
from skillwing.services.protocol import MissionPhase, MissionStatus, Record, RecordKind

REPORT_FILE = "report.json"

RESULTS: dict[str, str] = {
    MissionPhase.SUCCEEDED: "success",
    MissionPhase.FAILED: "failure",
    MissionPhase.ABORTED: "aborted",
}
"""Result of a mission by its last phase; any other phase is `unfinished`."""


class JudgedFigure(msgspec.Struct, frozen=True, kw_only=True):
    """A figure of the robot's judge. key: for programs. name, text: for people; a part of the figure before it begins
    with spaces. value: None if unknown. is_problem: shown in red."""

    key: str
    name: str
    value: float | None
    text: str
    is_problem: bool = False


class SwitchEntry(msgspec.Struct, frozen=True, kw_only=True):
    """A change of branch at `t`. cause: the records from the root cause to the switch itself."""

    t: float
    cause: tuple[Record, ...]


class SkillEntry(msgspec.Struct, frozen=True, kw_only=True):
    """One goal; `t_end` and `terminal` are None for one that never ended."""

    skill: str
    goal_id: str
    t_start: float
    t_end: float | None
    terminal: str | None
    reason: str


class ProcessEntry(msgspec.Struct, frozen=True, kw_only=True):
    """State of a process at the end: `runs`, `stopped` in order, `died` or `not started`. detail: sentences on it."""

    name: str
    state: str
    detail: str = ""


class OperatorFacts(msgspec.Struct, frozen=True, kw_only=True):
    """Facts about the last mission of a system that only the command which ran it has.

    begun: robot time of its first status that was seen; None without one. The wall time counts from there. end: its
    last status, which the recorder may have missed; None if no end was seen.
    """

    begun: float | None = None
    wall_time_s: float | None = None
    processes: tuple[ProcessEntry, ...] = ()
    end: MissionStatus | None = None


class MissionReport(msgspec.Struct, frozen=True, kw_only=True):
    """The report. result: success, failure, aborted or unfinished.

    judged: figures of the robot's judge; none for a robot without one. missing: sentences on what was not recorded, or
    was deleted.
    """

    mission: str
    result: str
    seed: int | None
    sim_time_s: float
    wall_time_s: float | None
    real_time_factor: float | None
    judged: tuple[JudgedFigure, ...]
    switches: tuple[SwitchEntry, ...]
    skills: tuple[SkillEntry, ...]
    processes: tuple[ProcessEntry, ...]
    missing: tuple[str, ...] = ()

    def judged_value(self, key: str) -> float | None:
        """The value of a judged figure; None if it is unknown."""
        return next((figure.value for figure in self.judged if figure.key == key), None)


def make_report(
    history: History,
    *,
    mission: str,
    seed: int | None = None,
    wall_time_s: float | None = None,
    judged: Iterable[JudgedFigure] = (),
    processes: Iterable[ProcessEntry] = (),
    phases: Collection[str] | None = None,
) -> MissionReport:
    """The report of `history`, with facts from outside of it. Times are rounded to milliseconds.

    wall_time_s: until the mission's end, or until the last record of a mission without one; so is robot time. phases:
    ids of the mission's phase records; None for all records with its name.
    """
    end = last_phase(history, mission, phases)
    sim_time = end.t if end is not None and end.after in RESULTS else history.end
    return MissionReport(
        mission=mission,
        result=RESULTS.get(end.after, "unfinished") if end else "unfinished",
        seed=seed,
        sim_time_s=round(sim_time, 3),
        wall_time_s=None if wall_time_s is None else round(wall_time_s, 3),
        real_time_factor=round(sim_time / wall_time_s, 3) if wall_time_s else None,
        judged=tuple(judged),
        switches=tuple(SwitchEntry(t=round(switch.t, 3), cause=switch.chain) for switch in history.switches),
        skills=tuple(
            SkillEntry(
                skill=bar.skill,
                goal_id=bar.goal_id,
                t_start=round(bar.t_start, 3),
                t_end=None if bar.t_end is None else round(bar.t_end, 3),
                terminal=bar.terminal,
                reason=bar.reason,
            )
            for bar in history.bars
        ),
        processes=tuple(processes),
    )


def read_report(run_dir: Path) -> MissionReport:
    return msgspec.json.decode((run_dir / REPORT_FILE).read_bytes(), type=MissionReport)


def last_phase(history: History, mission: str, ids: Collection[str] | None = None) -> Record | None:
    """The mission's latest phase record. ids: of its records; another mission beside it may have its name."""
    phases = (
        record
        for record in reversed(history.records)
        if record.kind is RecordKind.MISSION and record.subject == mission and record.after in PHASES
        if ids is None or record.id in ids
    )
    return next(phases, None)
