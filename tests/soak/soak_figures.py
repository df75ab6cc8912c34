"""Figures of a soak: memory and disk over robot time. Pure.

The criterion of memory was set before the runs that it judges. It has two parts, for the time after the first hour. The
floor of a process rises by less than 25 MB in the soak. Its trend, extrapolated to the goals of a week at one start a
second, rises by less than 25 MB, too. For a day at 20 starts a second the first part is the stricter one, for a day at
2 the second. 15 processes with that growth take 375 MB, less than a tenth of the memory of a computer with 4 GB.

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
"""Megabytes by which the floor of a process may rise, both in the soak and in a week."""
WINDOWS = 24
"""Windows after the settling time, each with a floor."""
APART = WINDOWS // 4
"""Windows over which a slope is measured."""
DISK_ALLOWED = 1.1
"""Size of the whole run directory, in sizes of `--keep`."""


class Sample(msgspec.Struct, frozen=True):
    """Memory of each process in bytes, and started goals, at robot time `t`.

    directory: bytes of the whole run directory. parts: bytes of the files that `--keep` limits.
    """

    t: float
    memory: dict[str, int]
    directory: int
    parts: int
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
    def risen(self) -> float:
        """Megabytes by which the floor rose in the soak."""
        return self.last - self.first

    @property
    def flat(self) -> bool:
        return self.week < GROWTH_ALLOWED and self.risen < GROWTH_ALLOWED


def growths(samples: Sequence[Sample], settle: float) -> list[Growth]:
    """Growth of each process that has a sample in every window; none for too few goals.

    settle: robot seconds from the begin.
    """
    late = _late(samples, settle)
    if len(late) < WINDOWS or late[-1].started - late[0].started < LEAST_GOALS:
        return []
    found: list[Growth] = []
    for process in _processes(late):
        floors = _floors(late, process)
        if len(floors) == WINDOWS:
            most = max(sample.memory[process] / 1e6 for sample in late if process in sample.memory)
            found.append(Growth(process, floors[0][1], floors[-1][1], most, trend(floors) * WEEK_GOALS))
    return found


def not_judged(samples: Sequence[Sample], settle: float) -> list[str]:
    """Processes that were there after the settling time, and have no growth."""
    judged = {each.process for each in growths(samples, settle)}
    return [process for process in _processes(_late(samples, settle)) if process not in judged]


def _late(samples: Sequence[Sample], settle: float) -> list[Sample]:
    return [sample for sample in samples if sample.t >= samples[0].t + settle]


def _processes(samples: Iterable[Sample]) -> list[str]:
    return list(dict.fromkeys(process for sample in samples for process in sample.memory))


def _floors(samples: Sequence[Sample], process: str) -> list[tuple[int, float]]:
    """The least memory of each window, with the goals at its end. Windows without the process are left out."""
    floors: list[tuple[int, float]] = []
    for number in range(WINDOWS):
        window = samples[len(samples) * number // WINDOWS : len(samples) * (number + 1) // WINDOWS]
        used = [sample.memory[process] / 1e6 for sample in window if process in sample.memory]
        if used:
            floors.append((window[-1].started, min(used)))
    return floors


def trend(points: Sequence[tuple[float, float]]) -> float:
    """Median of the slopes between points that are `APART` places apart; 0 without two different ones."""
    pairs = zip(points, points[APART:], strict=False)
    slopes = [(y - b) / (x - a) for (a, b), (x, y) in pairs if x != a]
    return median(slopes) if slopes else 0.0


class Soak(msgspec.Struct, frozen=True, kw_only=True):
    """A soak, also one that was interrupted. Times in seconds.

    hours: robot hours that were asked for. rate: starts in a robot second. keep: bytes of `--keep`. written: bytes that
    were written to each file, with its deleted parts. lost_events: dropped by processes that were too busy for them.
    machine: with the date. code: digest of the code that ran. finished: the hours are over.
    """

    hours: float
    rate: float
    keep: int
    settle: float
    machine: str
    code: str = ""
    wall: float = 0.0
    ended: int = 0
    succeeded: int = 0
    missions: int = 0
    samples: list[Sample] = []
    written: dict[str, int] = {}
    lost_processes: list[str] = []
    lost_events: int = 0
    finished: bool = False

    @property
    def directory(self) -> int:
        """Most bytes that the run directory had."""
        return max((sample.directory for sample in self.samples), default=0)

    @property
    def parts(self) -> int:
        """Most bytes that the files under `--keep` had."""
        return max((sample.parts for sample in self.samples), default=0)

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

    @property
    def not_judged(self) -> list[str]:
        return not_judged(self.samples, self.settle) if self.samples else []

    def problems(self) -> list[str]:
        """A sentence for each broken promise."""
        found = [
            f"{each.process} grew by {each.risen:.0f} MB in the soak, and grows by {each.week:.0f} MB in a week."
            for each in self.growths
            if not each.flat
        ]
        found += [f"{name} was restarted or ended." for name in self.lost_processes]
        if self.lost_events:
            found.append(f"Busy processes lost {self.lost_events} events.")
        if self.ended != self.succeeded:
            found.append(f"{self.ended - self.succeeded} goals did not succeed.")
        if self.ended < self.started - 100:
            found.append(f"{self.started - self.ended} goals did not end.")
        if self.directory > DISK_ALLOWED * self.keep:
            allowed = f"{DISK_ALLOWED:g} times the {size_text(self.keep)} of `--keep`"
            found.append(f"The run directory has {size_text(self.directory)}, more than {allowed}.")
        return found


def table(soaks: Sequence[Soak]) -> str:
    """The page's part: a paragraph and a table for each soak."""
    return "\n\n".join(_one(soak) for soak in soaks if soak.begun)


def rates_table(soak: Soak) -> str:
    """The size of each file in a robot hour, for the page on recordings."""
    rows = [f"| `{name}` | {size / soak.passed / 1e6:.0f} |" for name, size in sorted(soak.written.items())]
    total = sum(soak.written.values()) / soak.passed / 1e6
    first = f"Mocks, {_rate(soak):.1f} starts a second over {soak.passed:.1f} robot hours."
    first = f"{first} Code {soak.code}, {soak.machine}."
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
        f"The run directory had {size_text(soak.directory)} at most, and the files that "
        f"`--keep {size_text(soak.keep).replace(' ', '')}` limits {size_text(soak.parts)}.",
        *(soak.problems() or [_memory_sentence(soak)]),
        *_left_out(soak),
        f"The table begins {soak.settle / HOUR:g} hours after the start. Code {soak.code}, {soak.machine}.",
    ]
    rows = [
        f"| {each.process} | {each.first:.1f} | {each.last:.1f} | {each.most:.1f} | {each.risen:+.1f} "
        f"| {each.week:+.1f} |"
        for each in soak.growths
    ]
    heads = ["| process | floor at first, MB | at last | most | in the soak | in a week |", "|---|---|---|---|---|---|"]
    return "\n".join([" ".join(sentences), "", *heads, *rows])


def _memory_sentence(soak: Soak) -> str:
    if not soak.growths:
        return "It was too short for a trend."
    return "Every process was flat." if not soak.not_judged else "Every process that was judged was flat."


def _left_out(soak: Soak) -> list[str]:
    names = ", ".join(soak.not_judged)
    return [f"Not judged, because they were not there all the time: {names}."] if soak.growths and names else []
