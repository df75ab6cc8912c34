"""The M600's own commands."""

from __future__ import annotations

from typing import Annotated

import typer

from skillwing.m600.command import sentences
from skillwing.services.commands.connection import RobotOption, connect
from skillwing.services.errors import InvalidOptionError, RefusedError
from skillwing.services.protocol import ErrorCode
from skillwing.sim_mujoco.topics import FAULT, Done, SetFault


def fault(
    sensor: Annotated[str, typer.Argument(metavar="NAME", help="The sensor: zed, lidar, imu or range.")],
    kind: Annotated[
        str, typer.Option("--kind", help="How it fails: blackout, freeze, noise, bias, dropout or slow.")
    ] = "blackout",
    off: Annotated[bool, typer.Option("--off", help="End the fault instead.")] = False,
    magnitude: Annotated[
        float | None, typer.Option("--magnitude", help="How badly, in the fault's own unit; it has a default.")
    ] = None,
    robot: RobotOption = None,
) -> None:
    """Make a sensor of the simulated drone fail, or work again."""
    with connect(robot) as system:
        try:
            done = system.ask(FAULT, SetFault(sensor=sensor, kind=kind, on=not off, magnitude=magnitude), Done)
        except RefusedError as error:
            if error.code is ErrorCode.UNKNOWN_NAME:
                raise InvalidOptionError("fault", sentences(error.message)) from error
            raise
    typer.echo(sentences(done.text))
