"""`skillwing status`: processes, goals and resources of the running system."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import typer
from rich.console import Console
from rich.text import Text

from skillwing.services.bus.address import is_address
from skillwing.services.bus.reading import message_reader
from skillwing.services.client.causal_feed import follow_records
from skillwing.services.client.connection import Target
from skillwing.services.client.target import CONNECT
from skillwing.services.diagnosis.unattended import Unattended, unattended_state
from skillwing.services.errors import (
    InvalidOptionError,
    KeysError,
    NoReplyError,
    NoSystemError,
    NotKnownError,
    RefusedError,
    SeveralSystemsError,
)
from skillwing.services.history.goal_ends import recorded_goals
from skillwing.services.history.recording_state import gap_sentence, read_state
from skillwing.services.names import MISSION, RESOURCE_MANAGER, skill_process
from skillwing.services.processes.launcher import ROUTER
from skillwing.services.processes.process_monitor import ProcessStatus, process_statuses
from skillwing.services.processes.process_state import ProcessCondition, running_count
from skillwing.services.processes.run_state import running_systems
from skillwing.services.protocol import GoalStatus, MissionStatus, QueryStates, ResourceStates, State
from skillwing.services.terminal.connection import JsonOption, RobotOption, System, connect
from skillwing.services.terminal.exit_codes import FAILED, OK
from skillwing.services.terminal.link_monitor import follow_link
from skillwing.services.terminal.live_state import LiveState
from skillwing.services.terminal.output import (
    DOES_NOT_ANSWER,
    NO_MANAGER,
    end_text,
    make_console,
    print_json,
    print_table,
    state_text,
)
from skillwing.services.terminal.process_table import process_facts, process_table

MISSION_WAIT = 2.0
"""Longest wait for the status of a mission that runs, in seconds of wall time."""


@dataclass(frozen=True)
class SystemOverview:
    """Overview of a system.

    goals: of each skill the running one, else the latest. silent: skills whose manager is alive and does not answer.
    unmanaged: skills with an unfinished goal, whose manager holds no alive token. blocked: managers' reports on hooks
    that block them, by skill. states: None if unknown. unattended: set if the robot is away from its rescue goal, and
    nobody commands it. mission: latest status of the running one. recording: a sentence while the run cannot be
    recorded, else empty.
    """

    target: Target
    processes: list[ProcessStatus]
    goals: list[GoalStatus]
    silent: list[str]
    unmanaged: list[str]
    blocked: Mapping[str, str]
    states: ResourceStates | None
    unattended: Unattended | None
    mission: MissionStatus | None = None
    recording: str = ""

    @property
    def is_whole(self) -> bool:
        """True if every process runs and answers."""
        all_run = all(entry.condition is ProcessCondition.RUNS for entry in self.processes)
        return all_run and not self.silent and self.states is not None

    @property
    def troubles(self) -> dict[str, str]:
        """Problems of the managers of skills, by skill."""
        return {
            **self.blocked,
            **dict.fromkeys(self.unmanaged, NO_MANAGER),
            **dict.fromkeys(self.silent, DOES_NOT_ANSWER),
        }


def status(robot: RobotOption = None, as_json: JsonOption = False) -> None:
    """Show the system's processes, its mission, the goals of its skills and the states of its resources. See
    docs/operations.md.

    Exit codes: 0 every process runs and answers, 1 one of them does not, 3 no system is running.
    """
    try:
        with connect(robot, wait_for_clock=False) as system:
            follow_link(system, lambda sentence: typer.echo(sentence, err=True))
            seen = _overview(system)
    except (InvalidOptionError, KeysError, NoSystemError, NotKnownError) as error:
        if not as_json and not isinstance(error, SeveralSystemsError):
            _print_processes_here(make_console(), robot)
        raise
    if as_json:
        print_json(_facts(seen))
    else:
        _print(make_console(), seen, system.addressed)
    raise typer.Exit(OK if seen.is_whole else FAILED)


def _print_processes_here(console: Console, robot: str | None) -> None:
    """Print what is known without the router: processes of a system of this user. Their ids end and restart it.

    An address of another router excludes a system. Text that is no address excludes none.
    """
    asked = os.environ.get(CONNECT, "")
    for state in running_systems():
        if robot in (None, state.robot) and (not is_address(asked) or asked in (state.endpoint, state.listens)):
            console.print(
                f"{state.robot} runs here as process {state.pid}. Its processes, as it last noted them:", markup=False
            )
            console.print(process_table(process_statuses(state.processes, None)))


def _overview(system: System) -> SystemOverview:
    live_state = LiveState()
    missions: list[MissionStatus] = []
    on_mission = message_reader(MissionStatus, missions.append)
    system.bus.subscribe(system.keys.mission_status, on_mission, events=True)
    follow_records(system.bus, system.keys, live_state.add_record)
    alive = system.alive()
    processes = system.process_statuses(alive)
    silent: list[str] = []
    skills = [skill.name for skill in system.skillset.skills]
    for skill in skills:
        try:
            goal = system.ask_for_goal(skill)
        except NoReplyError:
            if skill_process(skill) in alive:
                silent.append(skill)
            continue
        if goal is not None:
            live_state.add_status(goal)
    # The timeline, whose history has arrived before the managers' answers, has goals that were lost with their manager,
    # and reports on hooks. The recording has goals whose managers and resource manager are both gone.
    states = _states(system)
    answering = alive if states is not None else alive - {RESOURCE_MANAGER}
    live_state.add_recorded(recorded_goals(system.target.run_dir), answering)
    goals = [goal for skill in skills if (goal := live_state.goal(skill)) is not None]
    running = [goal.skill for goal in goals if goal.state is not State.TERMINATED]
    if MISSION in alive:
        system.bus.run_until(lambda: bool(missions), MISSION_WAIT)
    return SystemOverview(
        target=system.target,
        processes=processes,
        goals=goals,
        silent=silent,
        unmanaged=[skill for skill in running if skill_process(skill) not in alive],
        blocked={skill: text for skill in skills if (text := live_state.skill(skill).blocked)},
        states=states,
        unattended=unattended_state(system.target, system.skillset, states.states if states else {}, alive, running),
        mission=missions[-1] if MISSION in alive and missions else None,
        recording=_recording_problem(system.target),
    )


def _recording_problem(target: Target) -> str:
    """A sentence while the disk of the run takes nothing, else empty."""
    failing = None if target.run_dir is None else read_state(target.run_dir).failing
    return "" if failing is None else f"The run is not recorded. {gap_sentence(failing)}"


def _states(system: System) -> ResourceStates | None:
    try:
        return system.ask(system.keys.resource_states, QueryStates(), ResourceStates)
    except (NoReplyError, RefusedError):
        return None


def _facts(seen: SystemOverview) -> dict[str, Any]:
    target, states = seen.target, seen.states
    return {
        "robot": target.robot,
        "endpoint": target.endpoint,
        "pid": target.pid,
        "run_dir": None if target.run_dir is None else str(target.run_dir),
        "mock": target.mock,
        "topology": target.topology,
        "t": None if states is None else states.t,
        "processes": {entry.state.name: process_facts(entry) for entry in seen.processes},
        "goals": [
            {"skill": each.skill, "goal_id": each.goal_id, "state": each.state, "terminal": each.terminal}
            for each in seen.goals
        ],
        "mission": None if seen.mission is None else _mission_facts(seen.mission),
        "troubles": seen.troubles,
        "unattended": seen.unattended,
        "recording": seen.recording or None,
        "resources": {} if states is None else states.states,
    }


def _mission_facts(mission: MissionStatus) -> dict[str, Any]:
    return {"mission": mission.mission, "phase": mission.phase, "text": mission.text, "t": mission.t}


def _print(console: Console, seen: SystemOverview, addressed: Callable[[str], str]) -> None:
    target, states = seen.target, seen.states
    traits = [*(["mock"] if target.mock else []), *(["mesh"] if target.topology == "mesh" else [])]
    kind = f" ({', '.join(traits)})" if traits else ""
    time = "" if states is None or target.clock == "wall" else f" at {states.t:.1f} s"
    console.print(Text(f"{target.robot}{kind}{time}", style="bold"), f"  {target.endpoint}", end="")
    console.print(f"  logs in {target.run_dir}/logs" if target.run_dir else "")
    console.print(running_count(entry.condition for entry in seen.processes if entry.state.name != ROUTER))
    for entry in seen.processes:
        if entry.condition is not ProcessCondition.RUNS and entry.state.last_words:
            console.print(Text(entry.state.last_words, style="red"))
    if seen.mission is not None:
        text = addressed(seen.mission.text)
        console.print(f"Mission {seen.mission.mission}: {seen.mission.phase}  {text}", markup=False)
    if seen.recording:
        console.print(Text(seen.recording, style="red"))
    if seen.unattended is not None:
        console.print(Text(addressed(f"{seen.unattended.what} {seen.unattended.remedy}"), style="red"))
    console.print()
    console.print(process_table(seen.processes))
    if seen.goals or not seen.troubles:
        _print_goals(console, seen.goals)
    console.print()
    for skill, text in seen.troubles.items():
        console.print(Text(f"{skill}: {text}", style="red"))
    if seen.troubles:
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
