"""`skillwing status`: what runs, and what it does."""

from __future__ import annotations

from rich.console import Console
from rich.text import Text

from skillwing.services.bus.reading import message_reader
from skillwing.services.client.connection import Target
from skillwing.services.commands.connection import JsonOption, RobotOption, System, connect
from skillwing.services.commands.output import (
    DOES_NOT_ANSWER,
    end_text,
    make_console,
    print_json,
    print_table,
    state_text,
)
from skillwing.services.commands.process_table import process_facts, process_table
from skillwing.services.errors import RefusedError, UnansweredError
from skillwing.services.names import skill_process
from skillwing.services.processes.launcher import ROUTER
from skillwing.services.processes.process_state import Condition, headcount
from skillwing.services.processes.roll_call import Entry
from skillwing.services.protocol import GoalStatus, QueryStates, Record, ResourceStates
from skillwing.services.telemetry.present import Present


def status(robot: RobotOption = None, as_json: JsonOption = False) -> None:
    """Show the system's processes, the goals of its skills and the states of its resources."""
    with connect(robot, wait_for_clock=False) as system:
        present = Present()
        reader = message_reader(Record, present.add_record)
        system.bus.subscribe(system.keys.timeline, reader, events=True)
        alive = system.alive()
        processes = system.entries(alive)
        goals: list[GoalStatus] = []
        troubles: dict[str, str] = {}
        for skill in (skill.name for skill in system.skillset.skills):
            try:
                goal = system.ask_for_goal(skill)
            except UnansweredError:
                if skill_process(skill) in alive:
                    troubles[skill] = DOES_NOT_ANSWER
                continue
            if goal is not None:
                present.add_status(goal)
                goals.append(goal)
        states = _states(system)
        # What managers have reported of their hooks has come with the history of the timeline, before their answers.
        reports = {skill.name: present.skill(skill.name).blocked for skill in system.skillset.skills}
        troubles = {skill: text for skill, text in reports.items() if text} | troubles
    if as_json:
        _print_json(system.target, processes, goals, troubles, states)
    else:
        _print(system.target, processes, goals, troubles, states)


def _states(system: System) -> ResourceStates | None:
    try:
        return system.ask(system.keys.resource_states, QueryStates(), ResourceStates)
    except (UnansweredError, RefusedError):
        return None


def _print_json(
    target: Target,
    processes: list[Entry],
    goals: list[GoalStatus],
    troubles: dict[str, str],
    states: ResourceStates | None,
) -> None:
    print_json(
        {
            "robot": target.robot,
            "endpoint": target.endpoint,
            "pid": target.pid,
            "run_dir": None if target.run_dir is None else str(target.run_dir),
            "mock": target.mock,
            "topology": target.topology,
            "t": None if states is None else states.t,
            "processes": {entry.state.name: process_facts(entry) for entry in processes},
            "goals": [
                {"skill": each.skill, "goal_id": each.goal_id, "state": each.state, "terminal": each.terminal}
                for each in goals
            ],
            "troubles": troubles,
            "resources": {} if states is None else states.states,
        }
    )


def _print(
    target: Target,
    processes: list[Entry],
    goals: list[GoalStatus],
    troubles: dict[str, str],
    states: ResourceStates | None,
) -> None:
    console = make_console()
    traits = [*(["mock"] if target.mock else []), *(["mesh"] if target.topology == "mesh" else [])]
    told = f" ({', '.join(traits)})" if traits else ""
    time = "" if states is None or target.clock == "wall" else f" at {states.t:.1f} s"
    console.print(Text(f"{target.robot}{told}{time}", style="bold"), f"  {target.endpoint}", end="")
    console.print(f"  logs in {target.run_dir}/logs" if target.run_dir else "")
    console.print(headcount(entry.condition for entry in processes if entry.state.name != ROUTER))
    for entry in processes:
        if entry.condition is not Condition.RUNS and entry.state.last_words:
            console.print(Text(entry.state.last_words, style="red"))
    console.print()
    console.print(process_table(processes))
    if goals or not troubles:
        _print_goals(console, goals)
    console.print()
    for skill, text in troubles.items():
        console.print(Text(f"{skill}: {text}", style="red"))
    if troubles:
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
