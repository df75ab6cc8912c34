"""Ledger of campaigns: a file that grows, so that a long campaign can be interrupted and continued."""

from __future__ import annotations

import hashlib
import platform
import sys
import time
from collections.abc import Iterable
from pathlib import Path

import msgspec

from simulation.campaign import Campaign

OWN = ("skillwing", "simulation")
"""The packages whose code decides what a seed does."""


class Part(msgspec.Struct, frozen=True, kw_only=True):
    """Seeds from `first` to before `end`. seconds: of one processor. failures: the first broken promise by seed.

    code: see `code_version`; machine, date: where and when.
    """

    first: int
    end: int
    messages: int
    seconds: float
    failures: dict[int, str]
    code: str
    machine: str
    date: str


class Ledger:
    """The parts in a file, one a line; without a path in memory only."""

    def __init__(self, path: Path | None) -> None:
        self._path = path
        self.parts: list[Part] = []
        if path is not None and path.exists():
            self.parts = [msgspec.json.decode(line, type=Part) for line in path.read_bytes().splitlines()]

    @property
    def next_seed(self) -> int:
        """The first that nobody has carried out; parts follow each other."""
        return max((part.end for part in self.parts), default=0)

    def add(self, part: Part) -> None:
        """Write down a part that is done; a process that is killed loses the one that it is at."""
        self.parts.append(part)
        if self._path is None:
            return
        self._path.parent.mkdir(parents=True, exist_ok=True)
        with self._path.open("ab") as file:
            file.write(msgspec.json.encode(part) + b"\n")


def code_version() -> str:
    """Twelve digits that change with any of our modules that are loaded; nothing else decides what a seed does."""
    digest = hashlib.sha256()
    for name, module in sorted(sys.modules.items()):
        file = getattr(module, "__file__", None)
        if name.split(".")[0] in OWN and file is not None and name != "simulation.__main__":
            digest.update(name.encode() + Path(file).read_bytes())
    return digest.hexdigest()[:12]


def part_of(first: int, campaign: Campaign, code: str) -> Part:
    """Entry for a campaign that began at `first`."""
    return Part(
        first=first,
        end=first + campaign.runs,
        messages=campaign.messages,
        seconds=campaign.seconds,
        failures=campaign.failures,
        code=code,
        machine=f"{platform.machine()}, Python {platform.python_version()}",
        date=time.strftime("%Y-%m-%d"),
    )


def spans(parts: Iterable[Part]) -> list[tuple[int, int]]:
    """The seeds covered, from first to last, in as few pieces as possible."""
    merged: list[tuple[int, int]] = []
    for first, end in sorted((part.first, part.end) for part in parts):
        if merged and first <= merged[-1][1] + 1:
            merged[-1] = (merged[-1][0], max(merged[-1][1], end - 1))
        else:
            merged.append((first, end - 1))
    return merged
