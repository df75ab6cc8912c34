"""Mapping flights whose measurements are kept in files, so that several methods work on the very same ones.

    python benchmarks/recorded_flight.py FOLDER [--seeds 21:24]

Flies each seed's route with the nose along the track and across it, and keeps what was measured in FOLDER.
"""

from __future__ import annotations

import argparse
import pickle
import sys
from collections.abc import Iterable
from pathlib import Path

from mapping_flight import MappingFlight, Moment


def flights(seeds: str) -> list[tuple[int, bool]]:
    """Seed, and whether the nose points across the track, of the flights that `FIRST:AFTER_THE_LAST` stands for."""
    first, last = map(int, seeds.split(":"))
    return [(seed, across) for seed in range(first, last) for across in (False, True)]


def moments(seed: int, *, across: bool, folder: Path | None) -> Iterable[Moment]:
    """One flight: from its file in `folder` if there is one, else it is flown, and kept there."""
    if folder is None:
        return MappingFlight(seed, across=across)
    file = folder / f"{seed}-{'across' if across else 'along'}.pickle"
    if file.exists():
        # Written by this function, into a folder that the caller chose.
        return pickle.loads(file.read_bytes())
    flown = list(MappingFlight(seed, across=across))
    folder.mkdir(parents=True, exist_ok=True)
    unfinished = file.with_suffix(".part")
    unfinished.write_bytes(pickle.dumps(flown))
    unfinished.rename(file)
    return flown


def main() -> None:
    options = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    options.add_argument("folder", type=Path)
    options.add_argument("--seeds", default="21:24", help="first seed and the one after the last")
    wanted = options.parse_args()
    for seed, across in flights(wanted.seeds):
        count = len(list(moments(seed, across=across, folder=wanted.folder)))
        sys.stdout.write(f"seed {seed}, across: {across}, {count} moments\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
