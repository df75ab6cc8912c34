"""The M600's own commands."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import typer

from skillwing.dsl.suggest import closest
from skillwing.m600.command import sentences
from skillwing.services.bus.reading import message_reader
from skillwing.services.commands.completion import one_of
from skillwing.services.commands.connection import JsonOption, RobotOption, System, connect
from skillwing.services.commands.output import make_console, print_json, print_table
from skillwing.services.errors import InvalidOptionError, RefusedError, SkillwingError, UnansweredError
from skillwing.services.protocol import ErrorCode, M, Message
from skillwing.sim_mujoco.topics import (
    FASTEST_LINK,
    FAULT,
    FAULTS,
    LARGEST_COMPONENT,
    LINK_FAULT,
    LINK_STATUS,
    PILOT,
    Done,
    Empty,
    Faults,
    FaultState,
    LinkStatus,
    SetFault,
    SetLinkFault,
    SetPilot,
)

LINK = "link"
FALLIBLE = ("zed", "lidar", "imu", "range", "gnss", "camera", LINK, *(f"rotor/{number}" for number in range(1, 7)))
LINK_KINDS = ("narrow", "cut")
KINDS = ("blackout", "freeze", "noise", "bias", "dropout", "slow", "stopped", "weak", *LINK_KINDS)
"""What the simulator's own lists hold, for who asks while it does not run."""
LINK_PATIENCE = 3.0
"""Wall time in seconds for the radio link, which tells of itself once a second."""
_USUAL_KIND = {"rotor": "stopped", LINK: "cut"}
"""What fails in another way than by a blackout, unless somebody says how."""


class Handover(StrEnum):
    """What the safety pilot does with the authority over the drone."""

    TAKE = "take"
    GIVE = "give"


def fault(
    sensor: Annotated[
        str | None,
        typer.Argument(
            metavar="NAME",
            help="One of zed, lidar, imu, range, gnss, camera, link, and the rotors: rotor/1 to rotor/6.",
            autocompletion=one_of(lambda: FALLIBLE),
        ),
    ] = None,
    kind: Annotated[
        str | None,
        typer.Option(
            "--kind",
            metavar="KIND",
            help="A blackout, freeze, noise, bias, dropout, slow. Rotors: stopped, weak. Link: cut, narrow.",
            autocompletion=one_of(lambda: KINDS),
        ),
    ] = None,
    off: Annotated[bool, typer.Option("--off", help="End the fault instead.")] = False,
    magnitude: Annotated[
        float | None,
        typer.Option("--magnitude", metavar="X", help="How badly, in the fault's own unit; it has a default."),
    ] = None,
    tell: Annotated[bool, typer.Option("--list", help="Show what can fail, and what does.")] = False,
    robot: RobotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Make a sensor, a rotor or the radio link of the simulated drone fail, or work again; show what fails."""
    if tell:
        _tell_faults(robot, as_json)
        return
    if sensor is None:
        raise InvalidOptionError("name", "Name what is to fail, or give --list to see what can.")
    least, most = (0.0, FASTEST_LINK) if sensor == LINK else (-LARGEST_COMPONENT, LARGEST_COMPONENT)
    if magnitude is not None and not least <= magnitude <= most:
        bounds = f"from {least:,.0f} to {most:,.0f}"
        raise InvalidOptionError("magnitude", f"A magnitude is a number {bounds}, not {magnitude:,.12g}.")
    kind = kind or _USUAL_KIND.get(sensor.partition("/")[0], "blackout")
    key, switch = FAULT, SetFault(sensor=sensor, kind=kind, on=not off, magnitude=magnitude)
    if sensor == LINK:
        key, switch = LINK_FAULT, SetLinkFault(kind=kind, on=not off, magnitude=magnitude)
    with connect(robot) as system:
        try:
            done = _ask_simulator(system, "fault", key, switch, Done)
        except RefusedError as error:
            if error.code is ErrorCode.UNKNOWN_NAME:
                guess = closest(kind, error.known) if sensor in FALLIBLE else closest(sensor, FALLIBLE)
                hint = f" Did you mean `{guess}`?" if guess else ""
                raise InvalidOptionError("fault", f"{sentences(error.message)}{hint}") from error
            raise
    if as_json:
        print_json({"sensor": sensor, "kind": kind, "on": not off, "text": done.text})
    else:
        typer.echo(sentences(done.text))


def _tell_faults(robot: str | None, as_json: bool) -> None:
    with connect(robot) as system:
        told = [*_ask_simulator(system, "fault", FAULTS, Empty(), Faults).of, *_link_faults(system)]
    if as_json:
        print_json(told)
        return
    rows = [
        (each.name, "" if each.status is None else each.status.value, ", ".join(each.active), ", ".join(each.kinds))
        for each in told
    ]
    print_table(make_console(), ("NAME", "SAYS OF ITSELF", "FAILS NOW BY", "CAN FAIL BY"), rows)


def _link_faults(system: System) -> list[FaultState]:
    """What the radio link says of itself, if there is one."""
    heard: list[LinkStatus] = []
    listening = system.bus.subscribe(LINK_STATUS, message_reader(LinkStatus, heard.append), latest_only=True)
    system.bus.run_until(lambda: bool(heard), LINK_PATIENCE)
    listening.cancel()
    return [FaultState(name=LINK, kinds=LINK_KINDS, active=status.faults) for status in heard[-1:]]


def pilot(
    handover: Annotated[
        Handover, typer.Argument(help="Take the authority from the computer, or give it back.", metavar="take|give")
    ],
    robot: RobotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Be the simulated drone's safety pilot: take the authority over it, or give it to the computer."""
    authority = handover is Handover.GIVE
    with connect(robot) as system:
        done = _ask_simulator(system, "pilot", PILOT, SetPilot(authority=authority), Done)
    if as_json:
        print_json({"authority": authority, "text": done.text})
    else:
        typer.echo(sentences(done.text))


def _ask_simulator(system: System, command: str, key: str, message: Message, reply: type[M]) -> M:
    """Ask the simulated drone; raises SkillwingError where the system has none, as that of another robot."""
    try:
        return system.ask(key, message, reply)
    except UnansweredError as error:
        what = f"`{command}` is for the simulated drone, and none answers in `{system.target.robot}`."
        raise SkillwingError(f"{what} See with `skillwing status` what runs.") from error
