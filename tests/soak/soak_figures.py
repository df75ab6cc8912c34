"""Figures of a soak: memory and disk over robot time. Pure.

The criterion of memory was set before the runs that it judges. The growth after the first hour is extrapolated to the
goals of a week at one start a second. A process is flat if its floor rises by less than 25 MB in that week. 15
processes with that growth take 375 MB, less than a tenth of the memory of a computer with 4 GB.

The floor is the least memory in each of 24 windows. Memory above it is work that waits, such as chunks of the recording
that Rerun has not written yet. A leak raises the floor. The trend of the floor is its median slope over a quarter of
the windows. A single step has no influence on it, such as another arena of the allocator.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from statistics import median

import msgspec

from skillwing.services.sizes import size_text

HOUR = 3600.0
WEEK_GOALS = 604_800
"""Goals of a week at one start a second."""
LEAST_GOALS = WEEK_GOALS // 10
"""Goals after the settling time below which a step of a megabyte would look like a leak."""
GROWTH_ALLOWED = 25.0
"""Megabytes by which the floor of a process may rise in a week."""
WINDOWS = 24
"""Windows after the settling time, each with a floor."""
APART = WINDOWS // 4
"""Windows over which a slope is measured."""


class Sample(msgspec.Struct, frozen=True):
    """Memory of each process in bytes, bytes of the run's files, and started goals, at robot time `t`."""

    t: float
    memory: dict[str, int]
    disk: int
    started: int


class Growth(msgspec.Struct, frozen=True):
    """Memory of one process in megabytes after the settling time.

    first, last: floors of the first and the last window. most: of all samples. week: rise of the floor in the goals of
    a week, from its trend.
    """

    process: str
    first: float
    last: float
    most: float
    week: float

    @property
    def flat(self) -> bool:
        return self.week < GROWTH_ALLOWED


def growths(samples: Sequence[Sample], settle: float) -> list[Growth]:
    """Growth of each process that was there from the settling time to the end; none for too few goals.

    settle: robot seconds from the begin.
    """
    late = [sample for sample in samples if sample.t >= samples[0].t + settle]
    if len(late) < WINDOWS or late[-1].started - late[0].started < LEAST_GOALS:
        return []
    found: list[Growth] = []
    for process in late[-1].memory:
        used = [(sample.started, sample.memory[process] / 1e6) for sample in late if process in sample.memory]
        if len(used) == len(late):
            floors = list(_floors(used))
            most = max(memory for _, memory in used)
            found.append(Growth(process, floors[0][1], floors[-1][1], most, trend(floors) * WEEK_GOALS))
    return found


def _floors(used: Sequence[tuple[int, float]]) -> Iterable[tuple[int, float]]:
    """The least memory of each window, with the goals at its end."""
    for number in range(WINDOWS):
        window = used[len(used) * number // WINDOWS : len(used) * (number + 1) // WINDOWS]
        yield window[-1][0], min(memory for _, memory in window)


def trend(points: Sequence[tuple[float, float]]) -> float:
    """Median of the slopes between points that are `APART` places apart; 0 without two different ones."""
    pairs = zip(points, points[APART:], strict=False)
    slopes = [(y - b) / (x - a) for (a, b), (x, y) in pairs if x != a]
    return median(slopes) if slopes else 0.0


class Soak(msgspec.Struct, frozen=True, kw_only=True):
    """A soak, also one that was interrupted. Times in seconds.

    hours: robot hours that were asked for. rate: starts in a robot second. keep: bytes that the run's files may have.
    written: bytes that were written to each file, with its deleted parts. machine: with the date. finished: the hours
    are over.
    """

    hours: float
    rate: float
    keep: int
    settle: float
    machine: str
    wall: float = 0.0
    ended: int = 0
    succeeded: int = 0
    missions: int = 0
    samples: list[Sample] = []
    written: dict[str, int] = {}
    lost_processes: list[str] = []
    finished: bool = False

    @property
    def disk(self) -> int:
        """Most bytes that the files of the run had."""
        return max((sample.disk for sample in self.samples), default=0)

    @property
    def begun(self) -> bool:
        return len(self.samples) > 1

    @property
    def passed(self) -> float:
        """Robot hours from the first sample to the last."""
        return (self.samples[-1].t - self.samples[0].t) / HOUR if self.begun else 0.0

    @property
    def started(self) -> int:
        return self.samples[-1].started if self.samples else 0

    @property
    def growths(self) -> list[Growth]:
        return growths(self.samples, self.settle) if self.samples else []

    def problems(self) -> list[str]:
        """A sentence for each broken promise."""
        found = [f"{each.process} grows by {each.week:.0f} MB in a week." for each in self.growths if not each.flat]
        found += [f"{name} was restarted or ended." for name in self.lost_processes]
        if self.ended != self.succeeded:
            found.append(f"{self.ended - self.succeeded} goals did not succeed.")
        if self.ended < self.started - 100:
            found.append(f"{self.started - self.ended} goals did not end.")
        if self.disk > 1.1 * self.keep:
            found.append(f"The run has {size_text(self.disk)}, more than {size_text(self.keep)}.")
        return found


def table(soaks: Sequence[Soak]) -> str:
    """The page's part: a paragraph and a table for each soak."""
    return "\n\n".join(_one(soak) for soak in soaks if soak.begun)


def rates_table(soak: Soak) -> str:
    """The size of each file in a robot hour, for the page on recordings."""
    rows = [f"| `{name}` | {size / soak.passed / 1e6:.0f} |" for name, size in sorted(soak.written.items())]
    total = sum(soak.written.values()) / soak.passed / 1e6
    first = f"Mocks, {_rate(soak):.1f} starts a second over {soak.passed:.1f} robot hours. {soak.machine}."
    return "\n".join([first, "", "| file | MB in a robot hour |", "|---|---|", *rows, f"| all | {total:.0f} |"])


def _rate(soak: Soak) -> float:
    return soak.started / (soak.passed * HOUR)


def _one(soak: Soak) -> str:
    sentences = [
        f"**{soak.passed:.1f} robot hours at {_rate(soak):.1f} starts a second**, of {soak.hours:g} hours at "
        f"{soak.rate:g}: {soak.started:,} goals and {soak.missions} missions in {soak.wall / 60:.0f} minutes, or "
        f"{soak.started / soak.wall:.0f} starts in a second of wall time.",
        *([] if soak.finished else ["This soak was interrupted."]),
        f"{soak.succeeded:,} of {soak.ended:,} ended goals succeeded.",
        f"The files had {size_text(soak.disk)} at most, with `--keep {size_text(soak.keep).replace(' ', '')}`.",
        *(soak.problems() or ["Every process was flat." if soak.growths else "It was too short for a trend."]),
        f"The table begins {soak.settle / HOUR:g} hours after the start. {soak.machine}.",
    ]
    rows = [
        f"| {each.process} | {each.first:.1f} | {each.last:.1f} | {each.most:.1f} | {each.week:+.1f} |"
        for each in soak.growths
    ]
    heads = ["| process | floor at first, MB | at last | most | in a week |", "|---|---|---|---|---|"]
    return "\n".join([" ".join(sentences), "", *heads, *rows])
