"""The M600's own commands."""

from __future__ import annotations

import math
from enum import StrEnum
from typing import Annotated

import typer

from skillwing.m600.command import sentences
from skillwing.services.commands.connection import JsonOption, RobotOption, System, connect
from skillwing.services.commands.output import print_json
from skillwing.services.errors import InvalidOptionError, RefusedError, SkillwingError, UnansweredError
from skillwing.services.protocol import ErrorCode, Message
from skillwing.sim_mujoco.topics import FAULT, PILOT, Done, SetFault, SetPilot


class Handover(StrEnum):
    """What the safety pilot does with the authority over the drone."""

    TAKE = "take"
    GIVE = "give"


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
    as_json: JsonOption = False,
) -> None:
    """Make a sensor of the simulated drone fail, or work again."""
    if magnitude is not None and not math.isfinite(magnitude):
        raise InvalidOptionError("magnitude", f"A magnitude of {magnitude} means nothing. Give a finite number.")
    with connect(robot) as system:
        try:
            done = _ask_simulator(
                system, "fault", FAULT, SetFault(sensor=sensor, kind=kind, on=not off, magnitude=magnitude)
            )
        except RefusedError as error:
            if error.code is ErrorCode.UNKNOWN_NAME:
                raise InvalidOptionError("fault", sentences(error.message)) from error
            raise
    if as_json:
        print_json({"sensor": sensor, "kind": kind, "on": not off, "text": done.text})
    else:
        typer.echo(sentences(done.text))


def pilot(
    handover: Annotated[Handover, typer.Argument(help="Take the authority from the computer, or give it back.")],
    robot: RobotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Be the simulated drone's safety pilot: take the authority over it, or give it to the computer."""
    authority = handover is Handover.GIVE
    with connect(robot) as system:
        done = _ask_simulator(system, "pilot", PILOT, SetPilot(authority=authority))
    if as_json:
        print_json({"authority": authority, "text": done.text})
    else:
        typer.echo(sentences(done.text))


def _ask_simulator(system: System, command: str, key: str, message: Message) -> Done:
    """Ask the simulated drone; raises SkillwingError where the system has none, as that of another robot."""
    try:
        return system.ask(key, message, Done)
    except UnansweredError as error:
        what = f"`{command}` is for the simulated drone, and none answers in `{system.target.robot}`."
        raise SkillwingError(f"{what} See with `skillwing status` what runs.") from error
