"""Recordings of flights: a folder each, which gets the flight's name when the flight has ended."""

from __future__ import annotations

import shutil
from io import BytesIO
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile

from skillwing.evaluation.flights.plan import FlightPlan

UNFINISHED = ".part"
"""Ends the name of the folder until then."""


def begin_recording(folder: Path, plan: FlightPlan) -> Path:
    """An empty folder for the recording of a flight of the campaign in `folder`.

    What a flight left that was killed is removed: it would be taken for a part of this one.
    """
    unfinished = _unfinished(folder, plan)
    for left in (folder / plan.name, unfinished):
        shutil.rmtree(left, ignore_errors=True)
    unfinished.mkdir(parents=True)
    return unfinished.absolute()


def keep_recording(folder: Path, plan: FlightPlan) -> None:
    """Give the recording of a flight that has ended its name, if it was recorded."""
    unfinished = _unfinished(folder, plan)
    if unfinished.is_dir():
        unfinished.rename(folder / plan.name)


def is_recorded(folder: Path, plan: FlightPlan) -> bool:
    """True if a recording of the whole flight exists."""
    return (folder / plan.name).is_dir()


def pack_recording(run_dir: Path) -> bytes:
    """All files of a recording, as one zip archive."""
    packed = BytesIO()
    with ZipFile(packed, "w", ZIP_DEFLATED, compresslevel=1) as archive:
        for path in sorted(run_dir.rglob("*")):
            archive.write(path, path.relative_to(run_dir))
    return packed.getvalue()


def unpack_recording(packed: bytes, run_dir: Path) -> None:
    """Write the files of a packed recording into a directory."""
    with ZipFile(BytesIO(packed)) as archive:
        archive.extractall(run_dir)


def _unfinished(folder: Path, plan: FlightPlan) -> Path:
    return folder / f"{plan.name}{UNFINISHED}"
