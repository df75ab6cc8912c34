"""The dialects that are read, by file extension."""

from __future__ import annotations

from functools import cache

from skillwing.dsl.reading.dialect import Dialect


def dialect_of(file: str) -> Dialect:
    """The dialect in which a file of that name is written: `.skillset` unless its extension says another."""
    return _rl() if file.endswith(".rl") else _skillset()


@cache
def _skillset() -> Dialect:
    from skillwing.dsl.reading.skillset.builder import SkillsetBuilder  # noqa: PLC0415 - each dialect when first read
    from skillwing.dsl.reading.skillset.dialect import SKILLSET_WORDS  # noqa: PLC0415

    return Dialect("skillset/skillset.lark", SkillsetBuilder(), SKILLSET_WORDS)


@cache
def _rl() -> Dialect:
    from skillwing.dsl.reading.rl.builder import RlBuilder  # noqa: PLC0415
    from skillwing.dsl.reading.rl.dialect import RL_WORDS  # noqa: PLC0415

    return Dialect("rl/rl.lark", RlBuilder(), RL_WORDS)
