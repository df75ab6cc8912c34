"""`skillwing trigger`: drive an extern transition by hand."""

from __future__ import annotations

import time
from typing import Annotated

import typer

from skillwing.dsl import UnknownNameError
from skillwing.services.errors import RefusedError
from skillwing.services.protocol import ErrorCode, FireExtern, QueryStates, ResourceStates
from skillwing.services.terminal.completion import resources, states
from skillwing.services.terminal.connection import JsonOption, RobotOption, System, connect
from skillwing.services.terminal.output import print_json

SECOND_THOUGHTS = 1.0
"""Wall time in seconds that the functional layer gets to contradict."""
READ_PERIOD = 0.1


def trigger(
    resource: Annotated[
        str, typer.Argument(metavar="RESOURCE", help="Resource.", show_default=False, autocompletion=resources)
    ],
    state: Annotated[
        str, typer.Argument(metavar="STATE", help="State to bring it to.", show_default=False, autocompletion=states)
    ],
    robot: RobotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Bring a resource to a state, as the functional layer or an operator may.

    What the robot itself reports counts for more: it puts such a resource back at once, and the exit code is 4.
    """
    with connect(robot, wait_for_clock=False) as system:
        model = system.skillset.resource(resource)
        if state not in model.states:
            raise UnknownNameError(f"state of {resource}", state, model.states)
        request = FireExtern(resource=resource, target=state, source="cli")
        answer = system.ask(system.keys.resource_extern, request, ResourceStates)
        if not system.target.mock:  # nobody else drives the resources of a mock
            answer = _read_back(system, resource, answer)
        if answer.states[resource] != state:
            raise RefusedError(
                ErrorCode.NOT_ALLOWED,
                f"{resource} was {state} for a moment: the robot reports {answer.states[resource]}.",
                help="Change what it reports, at the robot itself.",
            )
        if as_json:
            print_json({"revision": answer.revision, "t": answer.t, "states": answer.states})
        else:
            typer.echo(f"{resource} is {answer.states[resource]}.")


def _read_back(system: System, resource: str, triggered: ResourceStates) -> ResourceStates:
    """The states once the functional layer has put the resource back, or has had the time to."""
    deadline = time.monotonic() + SECOND_THOUGHTS
    states = triggered
    while states.states[resource] == triggered.states[resource] and time.monotonic() < deadline:
        system.bus.run_until(lambda: False, READ_PERIOD)
        states = system.ask(system.keys.resource_states, QueryStates(), ResourceStates)
    return states
