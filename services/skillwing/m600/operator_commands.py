"""Commands of the M600's operator: faults of the simulated drone, and its safety pilot."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated, Any

import typer

from skillwing.dsl.model import UnknownNameError
from skillwing.m600.functional_layer_client import sentences
from skillwing.onboard.topics.common import LARGEST_COMPONENT, Done, Empty
from skillwing.onboard.topics.faults import (
    FASTEST_LINK,
    FAULT,
    FAULTS,
    LINK_FAULT,
    Faults,
    FaultState,
    SetFault,
    SetLinkFault,
)
from skillwing.onboard.topics.flight import PILOT, SetPilot
from skillwing.onboard.topics.link import LINK_STATUS, LinkStatus
from skillwing.services.bus.reading import message_reader
from skillwing.services.errors import InvalidOptionError, NoReplyError, RefusedError, SkillwingError
from skillwing.services.protocol import ErrorCode, M, Message
from skillwing.services.terminal.connection import JsonOption, RobotOption, System, connect
from skillwing.services.terminal.output import make_console, print_json, print_table

LINK = "link"
LINK_KINDS = ("cut", "narrow")
LINK_PATIENCE = 3.0
"""Longest wait for the status of the radio link, published once a second, in wall time [s]."""


class Handover(StrEnum):
    """Handover of the authority over the drone by the safety pilot."""

    TAKE = "take"
    GIVE = "give"


def _complete_name(ctx: typer.Context, incomplete: str) -> list[str]:
    return [each.name for each in _completed_states(ctx) if each.name.startswith(incomplete)]


def _complete_kind(ctx: typer.Context, incomplete: str) -> list[str]:
    kinds = dict.fromkeys(kind for state in _completed_states(ctx) for kind in state.kinds)
    return [kind for kind in kinds if kind.startswith(incomplete)]


def _completed_states(ctx: typer.Context) -> list[FaultState]:
    """All that can fail of the running system; nothing without one."""
    try:
        with connect(ctx.params.get("robot")) as system:
            return [*_vehicle_faults(system), FaultState(name=LINK, kinds=LINK_KINDS)]
    except (SkillwingError, OSError):
        return []


def fault(
    sensor: Annotated[
        str | None,
        typer.Argument(
            metavar="NAME",
            help="A sensor, a rotor such as rotor/1, or link. See all with --list.",
            autocompletion=_complete_name,
        ),
    ] = None,
    kind: Annotated[
        str | None,
        typer.Option(
            "--kind",
            metavar="KIND",
            help="A kind of fault that NAME can have; by default the first one in the list.",
            autocompletion=_complete_kind,
        ),
    ] = None,
    off: Annotated[bool, typer.Option("--off", help="End the fault instead; without --kind, all that it has.")] = False,
    magnitude: Annotated[
        float | None,
        typer.Option("--magnitude", metavar="X", help="How badly, in the fault's own unit; it has a default."),
    ] = None,
    list_faults: Annotated[bool, typer.Option("--list", help="Show all that can fail, and the active faults.")] = False,
    robot: RobotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Make a sensor, a rotor or the radio link of the simulated robot fail, or work again; list faults. See
    docs/sensors.md."""
    if list_faults:
        if sensor is not None or kind is not None or off or magnitude is not None:
            raise InvalidOptionError("list", "--list shows all that can fail. Leave out what else you gave.")
        _list_faults(robot, as_json)
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
        state = _link_state(system, ask=off) if sensor == LINK else _vehicle_state(system, sensor)
        if off:
            outcome = _end_faults(system, state, kind)
        else:
            kind = kind or state.kinds[0]
            outcome = {"kind": kind, "text": _switch(system, sensor, kind, on=True, magnitude=magnitude)}
    if as_json:
        print_json({"sensor": sensor, "on": not off, **outcome})
    else:
        typer.echo(outcome["text"])


def _end_faults(system: System, state: FaultState, kind: str | None) -> dict[str, Any]:
    """End a kind of fault, or all without one; return the kinds that ended, and sentences.

    Raises UnknownNameError for a kind that the part cannot have.
    """
    if kind is not None and kind not in state.kinds:
        raise UnknownNameError(f"fault of {state.name}", kind, state.kinds)
    ended = [each for each in state.active if kind in (None, each)]
    texts = [_switch(system, state.name, each, on=False) for each in ended]
    if not ended:
        name = state.name
        texts = [f"No fault of {name} was on." if kind is None else sentences(f"{kind} of {name} was not on")]
    return {"kind": kind, "ended": ended, "text": " ".join(texts)}


def _vehicle_faults(system: System) -> tuple[FaultState, ...]:
    return _ask_simulator(system, "fault", FAULTS, Empty(), Faults).of


def _vehicle_state(system: System, name: str) -> FaultState:
    """Fault state of a sensor or rotor. Raises UnknownNameError with the known names."""
    states = {each.name: each for each in _vehicle_faults(system)}
    if name not in states:
        raise UnknownNameError("sensor, rotor or link", name, (*states, LINK))
    return states[name]


def _switch(system: System, sensor: str, kind: str, *, on: bool, magnitude: float | None = None) -> str:
    """Switch one fault; return sentences about it. Raises InvalidOptionError for a fault that the part cannot have."""
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


def _list_faults(robot: str | None, as_json: bool) -> None:
    with connect(robot) as system:
        states = [*_vehicle_faults(system), *_link_faults(system)]
    if as_json:
        print_json(states)
        return
    rows = [
        (each.name, "" if each.status is None else each.status.value, ", ".join(each.active), ", ".join(each.kinds))
        for each in states
    ]
    print_table(make_console(), ("NAME", "SAYS OF ITSELF", "FAILS NOW BY", "CAN FAIL BY"), rows)


def _link_state(system: System, *, ask: bool) -> FaultState:
    """Fault state of the radio link; a link that is not asked, or does not answer, may have any fault."""
    return next(iter(_link_faults(system) if ask else ()), FaultState(name=LINK, kinds=LINK_KINDS, active=LINK_KINDS))


def _link_faults(system: System) -> list[FaultState]:
    """Fault state that the radio link publishes, if there is one."""
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
    """Act as the safety pilot of the simulated robot: take the authority over it, or give it to the computer."""
    authority = handover is Handover.GIVE
    with connect(robot) as system:
        done = _ask_simulator(system, "pilot", PILOT, SetPilot(authority=authority), Done)
    if as_json:
        print_json({"authority": authority, "text": done.text})
    else:
        typer.echo(sentences(done.text))


def _ask_simulator(system: System, command: str, key: str, message: Message, reply: type[M]) -> M:
    """Ask the simulated drone. Raises SkillwingError if the system has none."""
    try:
        return system.ask(key, message, reply)
    except NoReplyError as error:
        what = f"`{command}` is for the simulated drone, and none answers in `{system.target.robot}`."
        raise SkillwingError(f"{what} See with `skillwing status` what runs.") from error
