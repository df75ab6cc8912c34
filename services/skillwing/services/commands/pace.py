"""The option of how fast robot time runs in a simulation."""

from __future__ import annotations

import math
from typing import Annotated, TypeAlias

import typer

MAX = "max"
AS_FAST_AS_POSSIBLE = 0.0
SLOWEST = 0.05


def read_pace(text: str | float) -> float:
    """Robot seconds per second, 0 for as fast as possible. Raises BadParameter."""
    if str(text).strip().lower() == MAX:
        return AS_FAST_AS_POSSIBLE
    try:
        pace = float(text)
    except ValueError:
        pace = math.nan
    if not SLOWEST <= pace < math.inf:
        raise typer.BadParameter(f"`{text}` is no pace. Give a number of {SLOWEST:g} or more, or `{MAX}`.")
    return pace


def written_pace(pace: float) -> str:
    """A pace as `read_pace` reads it."""
    return str(pace) if pace > 0.0 else MAX


PaceOption: TypeAlias = Annotated[
    float,
    typer.Option(
        "--speed",
        metavar="FACTOR|max",
        parser=read_pace,
        help="Robot seconds per second; max is as fast as the robot's processes keep up, none of which falls behind.",
    ),
]
