"""Results of outages of a disk, and their tables. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field


@dataclass(kw_only=True)
class Outage:
    """An outage on mocks. seconds: its length. goals: that ended in it; unrecorded: of those, not in the files.

    killed: process that was killed in it, empty for none. failed: goals that did not succeed, with those of a killed
    skill. lost: number of lost lines and blocks that `recording.json` names. back: wall seconds from the return of the
    room until everything was written again; None if it never was. problems: a sentence for each broken promise.
    """

    seconds: float
    killed: str
    goals: int = 0
    failed: int = 0
    unrecorded: int = 0
    lost: int = 0
    back: float | None = None
    problems: list[str] = field(default_factory=list[str])


@dataclass(kw_only=True)
class MissionOutage:
    """An outage in a flight. begin: robot time in seconds. code, result: of the mission. missing: sentences of its
    report. same: the steps of the resource manager replay to the same answers."""

    begin: float
    seconds: float
    code: int
    result: str
    missing: list[str]
    same: bool
    problems: list[str] = field(default_factory=list[str])


def table(outages: Sequence[Outage], flight: MissionOutage | None) -> str:
    """The page's part."""
    heads = (
        "killed meanwhile",
        "full, s",
        "goals ended",
        "failed",
        "not recorded",
        "lines said missing",
        "written after",
    )
    lines = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|", *map(_row, outages)]
    if flight is not None:
        lines += ["", _sentence(flight)]
    return "\n".join(lines)


def _row(outage: Outage) -> str:
    back = "**never**" if outage.back is None else f"{outage.back:.1f} s"
    problems = f" **{' '.join(outage.problems)}**" if outage.problems else ""
    return (
        f"| {outage.killed or 'nothing'} | {outage.seconds:.0f} | {outage.goals} | {outage.failed} "
        f"| {outage.unrecorded} | {outage.lost} | {back}{problems} |"
    )


def _sentence(flight: MissionOutage) -> str:
    sentences = [
        f"In a flight of the M600 the disk was full for {flight.seconds:.0f} s from {flight.begin:.0f} s on. The "
        f"mission ended with `{flight.result}` and exit code {flight.code}.",
        f"Its report says: {' '.join(flight.missing) or 'nothing.'}",
        f"The steps of the resource manager {'replay' if flight.same else '**do not replay**'} to the same answers.",
        *(f"**{problem}**" for problem in flight.problems),
    ]
    return " ".join(sentences)
