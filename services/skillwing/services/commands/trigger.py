"""`skillwing trigger`: drive an extern transition by hand."""

from __future__ import annotations

from typing import Annotated

import typer

from skillwing.dsl import UnknownNameError
from skillwing.services.commands.connection import JsonOption, RobotOption, connect
from skillwing.services.commands.output import print_json
from skillwing.services.protocol import FireExtern, ResourceStates


def trigger(
    resource: Annotated[str, typer.Argument(metavar="RESOURCE", help="Resource.", show_default=False)],
    state: Annotated[str, typer.Argument(metavar="STATE", help="State to bring it to.", show_default=False)],
    robot: RobotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Bring a resource to a state, as the functional layer or an operator may."""
    with connect(robot, wait_for_clock=False) as system:
        model = system.skillset.resource(resource)
        if state not in model.states:
            raise UnknownNameError(f"state of {resource}", state, model.states)
        request = FireExtern(resource=resource, target=state, source="cli")
        answer = system.ask(system.keys.resource_extern, request, ResourceStates)
        if as_json:
            print_json({"revision": answer.revision, "t": answer.t, "states": answer.states})
        else:
            typer.echo(f"{resource} is {answer.states[resource]}.")
