"""Missions that are flown besides the library's, to compare these with: files of the repository."""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).parents[4]
BESIDES = ("benchmarks/paper/mapping_otherwise.py", "benchmarks/paper/inspection_otherwise.py")
"""From the root of the repository."""


def name_in_repository(file: str) -> str:
    """How such a file is called wherever the repository lies; any other file as it is given."""
    return next((name for name in BESIDES if file.endswith(f"/{name}")), file)
