"""The model that a test is about."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from skillwing.dsl import load
from skillwing.dsl.model import Skillset


def model_of(skillset: Skillset | str | Path) -> Skillset:
    """A model as it is, or that of a file. Raises OSError and SkillsetError as `load` does.

    Models are immutable, so the many tests of one file share the one that was read, as long as the file is the same.
    """
    if isinstance(skillset, Skillset):
        return skillset
    path = Path(skillset).resolve()
    return _read(path, path.stat().st_mtime_ns)


@lru_cache(maxsize=32)
def _read(path: Path, modified: int) -> Skillset:
    del modified
    return load(path)
