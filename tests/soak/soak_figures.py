"""Figures of a soak: memory and disk over robot time. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from skillwing.services.sizes import size_text

HOUR = 3600.0
GROWTH_ALLOWED = 5.0
"""Megabytes by which the least memory may grow from the first half to the second one: noise of the allocator."""
SHARE_ALLOWED = 0.03
"""The same, as a share of the process's memory."""


@dataclass(frozen=True, slots=True)
class Sample:
    """Memory of each process in bytes, and bytes of the run's files, at robot time `t`."""

    t: float
    memory: dict[str, int]
    disk: int


@dataclass(frozen=True, slots=True)
class Growth:
    """Memory of one process in megabytes after the settling time: the least in each half, and the most.

    Memory of a process goes up and down, as that of the recorder with each part. A leak raises the least.
    """

    process: str
    first: float
    second: float
    most: float

    @property
    def flat(self) -> bool:
        return self.second - self.first <= max(GROWTH_ALLOWED, SHARE_ALLOWED * self.first)


def growths(samples: Sequence[Sample], settle: float, present: Sequence[str]) -> list[Growth]:
    """Growth of each process that lived from the settling time to the end. settle: robot seconds from the begin."""
    late = [sample for sample in samples if sample.t >= samples[0].t + settle]
    found: list[Growth] = []
    for process in present:
        used = [sample.memory[process] / 1e6 for sample in late if process in sample.memory]
        if len(used) > 1:
            half = len(used) // 2
            found.append(Growth(process, min(used[:half]), min(used[half:]), max(used)))
    return found


@dataclass(frozen=True, kw_only=True)
class Soak:
    """A soak. rate: starts in a robot second that were asked for. keep: bytes that the run's files may have.

    written: bytes that were written to each file, with its deleted parts.
    """

    hours: float
    rate: float
    keep: int
    settle: float
    wall: float
    started: int
    ended: int
    succeeded: int
    missions: int
    samples: list[Sample]
    growths: list[Growth]
    written: dict[str, int]
    lost_processes: tuple[str, ...] = ()

    @property
    def disk(self) -> int:
        """Most bytes that the files of the run had after the settling time."""
        return max((sample.disk for sample in self.samples), default=0)

    def problems(self) -> list[str]:
        """A sentence for each broken promise."""
        found = [
            f"{each.process} grows by {each.second - each.first:.1f} MB." for each in self.growths if not each.flat
        ]
        found += [f"{name} was restarted or ended." for name in self.lost_processes]
        if self.ended != self.succeeded:
            found.append(f"{self.ended - self.succeeded} goals did not succeed.")
        if self.ended < self.started - 100:
            found.append(f"{self.started - self.ended} goals did not end.")
        if self.disk > 1.1 * self.keep:
            found.append(f"The run has {size_text(self.disk)}, more than {size_text(self.keep)}.")
        return found


def table(soaks: Sequence[Soak], machine: str) -> str:
    """The page's part: a paragraph and a table for each soak."""
    return "\n\n".join([*(_one(soak) for soak in soaks), f"{machine}."])


def rates_table(soak: Soak, machine: str) -> str:
    """The size of each file in a robot hour, for the page on recordings."""
    achieved = soak.started / (soak.hours * HOUR)
    rows = [f"| `{name}` | {size / soak.hours / 1e6:.0f} |" for name, size in sorted(soak.written.items())]
    total = sum(soak.written.values()) / soak.hours / 1e6
    first = f"Mocks, {achieved:.1f} starts a second over {soak.hours:.1f} robot hours. {machine}."
    return "\n".join([first, "", "| file | MB in a robot hour |", "|---|---|", *rows, f"| all | {total:.0f} |"])


def _one(soak: Soak) -> str:
    achieved = soak.started / (soak.hours * HOUR)
    sentences = [
        f"{soak.hours:.1f} robot hours at {achieved:.1f} starts a second: {soak.started:,} goals and {soak.missions} "
        f"missions in {soak.wall / 60:.0f} minutes.",
        f"{soak.succeeded:,} of {soak.ended:,} ended goals succeeded.",
        f"The files had {size_text(soak.disk)} at most, with `--keep {size_text(soak.keep).replace(' ', '')}`.",
        *(soak.problems() or ["No process grew."]),
        f"The table begins {soak.settle / HOUR:.1f} hours after the start.",
    ]
    rows = [
        f"| {each.process} | {each.first:.1f} | {each.second:.1f} | {each.most:.1f} | {each.second - each.first:+.1f} |"
        for each in soak.growths
    ]
    heads = ["| process | least MB, first half | second half | most MB | difference |", "|---|---|---|---|---|"]
    return "\n".join([" ".join(sentences), "", *heads, *rows])
