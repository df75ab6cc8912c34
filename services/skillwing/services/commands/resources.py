"""`skillwing resources`: the state of each resource."""

from __future__ import annotations

from skillwing.services.protocol import QueryStates, ResourceStates
from skillwing.services.terminal.connection import JsonOption, RobotOption, connect
from skillwing.services.terminal.output import make_console, print_json, print_table, state_text


def resources(robot: RobotOption = None, as_json: JsonOption = False) -> None:
    """Show the state of each resource."""
    with connect(robot, wait_for_clock=False) as system:
        answer = system.ask(system.keys.resource_states, QueryStates(), ResourceStates)
        if as_json:
            print_json({"step": answer.step, "t": answer.t, "states": answer.states})
            return
        reachable = {resource.name: " ".join(resource.states) for resource in system.skillset.resources}
        rows = [(name, state_text(state), reachable.get(name, "")) for name, state in answer.states.items()]
        print_table(make_console(), ("RESOURCE", "STATE", "STATES"), rows)
