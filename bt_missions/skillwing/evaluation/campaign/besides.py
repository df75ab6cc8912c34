"""Missions that are flown besides the library's, to compare these with: files of the repository."""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).parents[4]
BESIDES = ("benchmarks/paper/mapping_otherwise.py", "benchmarks/paper/inspection_otherwise.py")
"""From the root of the repository."""


def name_in_repository(file: str) -> str:
    """How such a file is called wherever the repository lies; any other file by its whole path, also one of another
    checkout that has the same name there. A name in the repository, and none at all, stay as they are."""
    if file in ("", *BESIDES):
        return file
    path = Path(file).resolve()
    return next((name for name in BESIDES if path == (ROOT / name).resolve()), str(Path(file).absolute()))
