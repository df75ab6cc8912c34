"""`skillwing trigger`: an extern transition by hand."""

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

UNDO_TIME = 1.0
"""Wall seconds in which the functional layer can undo the transition."""
READ_PERIOD = 0.1


def trigger(
    resource: Annotated[
        str, typer.Argument(metavar="RESOURCE", help="Resource.", show_default=False, autocompletion=resources)
    ],
    state: Annotated[
        str, typer.Argument(metavar="STATE", help="Its new state.", show_default=False, autocompletion=states)
    ],
    robot: RobotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Drive an extern transition of a resource, as the functional layer or an operator may.

    Reports of the robot itself have priority: the robot undoes the transition at once, and the exit code is 4.
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
            print_json({"step": answer.step, "t": answer.t, "states": answer.states})
        else:
            typer.echo(f"{resource} is {answer.states[resource]}.")


def _read_back(system: System, resource: str, triggered: ResourceStates) -> ResourceStates:
    """The states after the functional layer has undone the transition, or has had the time to do so."""
    deadline = time.monotonic() + UNDO_TIME
    states = triggered
    while states.states[resource] == triggered.states[resource] and time.monotonic() < deadline:
        system.bus.run_until(lambda: False, READ_PERIOD)
        states = system.ask(system.keys.resource_states, QueryStates(), ResourceStates)
    return states
