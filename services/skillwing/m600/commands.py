"""The M600's own commands."""

from __future__ import annotations

from enum import StrEnum
from itertools import chain
from typing import Annotated, Any

import typer

from skillwing.dsl.model import UnknownNameError
from skillwing.m600.command import sentences
from skillwing.onboard.topics import (
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
from skillwing.services.bus.reading import message_reader
from skillwing.services.errors import InvalidOptionError, NoReplyError, RefusedError, SkillwingError
from skillwing.services.options import imported
from skillwing.services.protocol import ErrorCode, M, Message
from skillwing.services.terminal.completion import one_of
from skillwing.services.terminal.connection import JsonOption, RobotOption, System, connect
from skillwing.services.terminal.output import make_console, print_json, print_table

LINK = "link"
LINK_KINDS = ("narrow", "cut")
SIMULATED_FAULTS = "skillwing.sim_mujoco.scenario.fault_checks:simulated_faults"
"""What can fail, and by which kinds, for shells that complete; it may not be installed."""
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
            help="A sensor, a rotor such as rotor/1, or link; --list shows all.",
            autocompletion=one_of(lambda: (*_simulated_faults(), LINK)),
        ),
    ] = None,
    kind: Annotated[
        str | None,
        typer.Option(
            "--kind",
            metavar="KIND",
            help="As blackout, noise, stopped, cut; --list shows those of each.",
            autocompletion=one_of(lambda: {*chain(*_simulated_faults().values()), *LINK_KINDS}),
        ),
    ] = None,
    off: Annotated[bool, typer.Option("--off", help="End the fault instead; without --kind, all that it has.")] = False,
    magnitude: Annotated[
        float | None,
        typer.Option("--magnitude", metavar="X", help="How badly, in the fault's own unit; it has a default."),
    ] = None,
    tell: Annotated[bool, typer.Option("--list", help="Show what can fail, and what does.")] = False,
    robot: RobotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Make a sensor, a rotor or the radio link of the simulated drone fail, or work again; show what fails. See
    docs/sensors.md."""
    if tell:
        if sensor is not None or kind is not None or off or magnitude is not None:
            raise InvalidOptionError("list", "--list shows all that can fail. Leave out what else you gave.")
        _tell_faults(robot, as_json)
        return
    if sensor is None:
        raise InvalidOptionError("name", "Name what is to fail, or give --list to see what can.")
    if off and magnitude is not None:
        raise InvalidOptionError("magnitude", "A fault that ends has no magnitude. Leave out --magnitude, or --off.")
    least, most = (0.0, FASTEST_LINK) if sensor == LINK else (-LARGEST_COMPONENT, LARGEST_COMPONENT)
    if magnitude is not None and not least <= magnitude <= most:
        bounds = f"from {least:,.0f} to {most:,.0f}"
        raise InvalidOptionError("magnitude", f"A magnitude is a number {bounds}, not {magnitude:,.12g}.")
    with connect(robot) as system:
        if sensor != LINK:
            _require_known(sensor, _ask_simulator(system, "fault", FAULTS, Empty(), Faults))
        if off:
            outcome = _end_faults(system, sensor, kind)
        else:
            kind = kind or _USUAL_KIND.get(sensor.partition("/")[0], "blackout")
            outcome = {"kind": kind, "text": _switch(system, sensor, kind, on=True, magnitude=magnitude)}
    if as_json:
        print_json({"sensor": sensor, "on": not off, **outcome})
    else:
        typer.echo(outcome["text"])


def _simulated_faults() -> dict[str, tuple[str, ...]]:
    """Kinds of fault by name; empty where the simulator is not installed."""
    try:
        return imported({"faults": SIMULATED_FAULTS}, "faults")()
    except InvalidOptionError:
        return {}


def _require_known(sensor: str, told: Faults) -> None:
    names = sorted(each.name for each in told.of)
    if sensor not in names:
        raise UnknownNameError("sensor, rotor or link", sensor, (*names, LINK))


def _end_faults(system: System, sensor: str, kind: str | None) -> dict[str, Any]:
    """End a kind of fault, or without one all that `sensor` has: which they were, and sentences about it.

    Raises UnknownNameError for a kind that it cannot have.
    """
    state = _state_of(system, sensor)
    if kind is not None and kind not in state.kinds:
        raise UnknownNameError(f"fault of {sensor}", kind, state.kinds)
    ended = [each for each in state.active if kind in (None, each)]
    told = [_switch(system, sensor, each, on=False) for each in ended]
    if not ended:
        told = [f"No fault of {sensor} was on." if kind is None else sentences(f"{kind} of {sensor} was not on")]
    return {"kind": kind, "ended": ended, "text": " ".join(told)}


def _state_of(system: System, name: str) -> FaultState:
    """Possible and active faults of a sensor, a rotor or the link. A link without a status may have any fault."""
    if name == LINK:
        return next(iter(_link_faults(system)), FaultState(name=LINK, kinds=LINK_KINDS, active=LINK_KINDS))
    told = _ask_simulator(system, "fault", FAULTS, Empty(), Faults).of
    return next((each for each in told if each.name == name), FaultState(name=name, kinds=()))


def _switch(system: System, sensor: str, kind: str, *, on: bool, magnitude: float | None = None) -> str:
    """Switch one fault; sentences that tell of it. Raises InvalidOptionError for what the drone cannot have."""
    key, switch = FAULT, SetFault(sensor=sensor, kind=kind, on=on, magnitude=magnitude)
    if sensor == LINK:
        key, switch = LINK_FAULT, SetLinkFault(kind=kind, on=on, magnitude=magnitude)
    try:
        return sentences(_ask_simulator(system, "fault", key, switch, Done).text)
    except RefusedError as error:
        match error.code:
            case ErrorCode.UNKNOWN_NAME:
                raise InvalidOptionError("fault", sentences(error.message)) from error
            case ErrorCode.BAD_REQUEST:
                raise InvalidOptionError("magnitude", sentences(error.message, error.help)) from error
            case _:
                raise


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
    except NoReplyError as error:
        what = f"`{command}` is for the simulated drone, and none answers in `{system.target.robot}`."
        raise SkillwingError(f"{what} See with `skillwing status` what runs.") from error
