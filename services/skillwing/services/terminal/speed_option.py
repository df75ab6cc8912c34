"""The option of how fast robot time runs in a simulation."""

from __future__ import annotations

from typing import Annotated, TypeAlias

import typer

from skillwing.services.processes.run_options import MAX_PACE, pace


def read_pace(text: str | float) -> float:
    """Robot seconds per second, 0 for as fast as possible. Raises BadParameter."""
    try:
        return pace(text)
    except ValueError as error:
        raise typer.BadParameter(f"`{text}` is no pace: {error}.") from error


def written_pace(factor: float) -> str:
    """A pace as `read_pace` reads it."""
    return str(factor) if factor > 0.0 else MAX_PACE


PaceOption: TypeAlias = Annotated[
    float,
    typer.Option(
        "--speed",
        metavar="FACTOR|max",
        parser=read_pace,
        help="Robot seconds per second; max is as fast as the robot's processes keep up, none of which falls behind.",
    ),
]
