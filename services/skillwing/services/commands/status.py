"""`skillwing status`: what runs, and what it does."""

from __future__ import annotations

from rich.console import Console
from rich.text import Text

from skillwing.services.client.connection import Target
from skillwing.services.commands.connection import JsonOption, RobotOption, System, connect
from skillwing.services.commands.output import end_text, make_console, print_json, print_table, state_text
from skillwing.services.commands.process_table import process_facts, process_table
from skillwing.services.errors import RefusedError, UnansweredError
from skillwing.services.processes.process_state import Condition, headcount
from skillwing.services.processes.roll_call import Entry
from skillwing.services.protocol import GoalStatus, QueryStates, ResourceStates


def status(robot: RobotOption = None, as_json: JsonOption = False) -> None:
    """Show the system's processes, the goals of its skills and the states of its resources."""
    with connect(robot, wait_for_clock=False) as system:
        processes = system.entries(system.alive())
        goals = [goal for goal in map(system.goal, (skill.name for skill in system.skillset.skills)) if goal]
        states = _states(system)
    if as_json:
        _print_json(system.target, processes, goals, states)
    else:
        _print(system.target, processes, goals, states)


def _states(system: System) -> ResourceStates | None:
    try:
        return system.ask(system.keys.resource_states, QueryStates(), ResourceStates)
    except (UnansweredError, RefusedError):
        return None


def _print_json(target: Target, processes: list[Entry], goals: list[GoalStatus], states: ResourceStates | None) -> None:
    print_json(
        {
            "robot": target.robot,
            "endpoint": target.endpoint,
            "pid": target.pid,
            "run_dir": None if target.run_dir is None else str(target.run_dir),
            "mock": target.mock,
            "t": None if states is None else states.t,
            "processes": {entry.state.name: process_facts(entry) for entry in processes},
            "goals": [
                {"skill": each.skill, "goal_id": each.goal_id, "state": each.state, "terminal": each.terminal}
                for each in goals
            ],
            "resources": {} if states is None else states.states,
        }
    )


def _print(target: Target, processes: list[Entry], goals: list[GoalStatus], states: ResourceStates | None) -> None:
    console = make_console()
    mock = " (mock)" if target.mock else ""
    time = "" if states is None or target.clock == "wall" else f" at {states.t:.1f} s"
    console.print(Text(f"{target.robot}{mock}{time}", style="bold"), f"  {target.endpoint}", end="")
    console.print(f"  logs in {target.run_dir}/logs" if target.run_dir else "")
    console.print(headcount(entry.condition for entry in processes))
    for entry in processes:
        if entry.condition is not Condition.RUNS and entry.state.last_words:
            console.print(Text(entry.state.last_words, style="red"))
    console.print()
    console.print(process_table(processes))
    _print_goals(console, goals)
    console.print()
    rows = [] if states is None else [(name, state_text(state)) for name, state in states.states.items()]
    print_table(console, ("RESOURCE", "STATE"), rows)


def _print_goals(console: Console, goals: list[GoalStatus]) -> None:
    console.print()
    if not goals:
        console.print("No skill has been started yet.")
        return
    rows = [
        (each.skill, end_text(each.terminal) if each.terminal else Text(each.state, style="blue"), each.goal_id)
        for each in goals
    ]
    print_table(console, ("SKILL", "RUNS, OR ENDED LAST", "GOAL"), rows)
