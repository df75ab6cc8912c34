"""`skillwing top`: every process, skill and resource, live."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from typing import Annotated, Any

import msgspec
import typer
from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.text import Text

from skillwing.services.bus import Answer, Answered, NoReply
from skillwing.services.bus.reading import message_reader
from skillwing.services.client.causal_feed import follow_records
from skillwing.services.history.goal_ends import recorded_goals
from skillwing.services.names import RESOURCE_MANAGER, skill_process
from skillwing.services.processes.process_monitor import ProcessStatus
from skillwing.services.processes.process_state import ProcessCondition
from skillwing.services.protocol import (
    GoalProgress,
    GoalStatus,
    ProtocolError,
    QueryGoal,
    QueryStates,
    decode,
    encode,
)
from skillwing.services.terminal.connection import JsonOption, RobotOption, System, connect
from skillwing.services.terminal.keyboard import when_pressed
from skillwing.services.terminal.link_monitor import follow_link
from skillwing.services.terminal.live_state import LiveState, ResourceNow, SkillNow
from skillwing.services.terminal.output import (
    DOES_NOT_ANSWER,
    NO_MANAGER,
    end_text,
    make_console,
    make_table,
    print_json,
    state_text,
    value_text,
)
from skillwing.services.terminal.process_table import STYLES, duration, process_facts, process_table

PERIOD = 1.0
"""Period of the display, and time over which the load of a process is measured [wall s]."""
QUIT = "q"
FRAME = 7
"""Lines of the display without rows: title, headings, and empty lines."""
FEWEST = 3
"""Number of processes on the smallest screen."""


def top(
    robot: RobotOption = None,
    once: Annotated[bool, typer.Option("--once", help="Show one picture and end.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Show every process, skill and resource of the running system, live, until q or Ctrl-C. See docs/operations.md.

    With --once or --json, or in a pipe, it shows them once. CPU is percent of one core; it is unknown for processes of
    another machine or of containers.
    """
    console = make_console()
    with connect(robot, wait_for_clock=False) as system:
        watch = SystemTop(system)
        watch.update()
        system.bus.run_until(lambda: False, PERIOD)
        watch.update()
        watch.add_recorded()
        if as_json or once or not console.is_terminal:
            # Only the timeout of a query distinguishes a process that hangs from a slow one.
            system.bus.run_until(lambda: watch.heard_all)
        if as_json:
            print_json(watch.facts())
        elif once or not console.is_terminal:
            console.print(watch.picture())
        else:
            _stay(system, watch, console)


def _stay(system: System, watch: SystemTop, console: Console) -> None:
    pressed: set[str] = set()
    with (
        Live(watch.picture(console.height), console=console, screen=True, auto_refresh=False) as live,
        when_pressed(lambda key: system.bus.post(lambda: pressed.add(key))),
    ):
        while QUIT not in pressed:
            system.bus.run_until(lambda: QUIT in pressed, PERIOD)
            watch.update()
            live.update(watch.picture(console.height), refresh=True)


class SystemTop:
    """Monitor of a system on the bus of a connection, which must run between updates."""

    def __init__(self, system: System) -> None:
        self._system = system
        self._live_state = LiveState()
        self._alive: set[str] = set()
        self._processes: list[ProcessStatus] = []
        self._cpu: dict[str, float] = {}
        self._used: dict[int, tuple[float, float]] = {}
        self._silent: set[str] = set()
        self._unheard = 0
        self._link = follow_link(system, lambda sentence: None)
        bus, keys, live_state = system.bus, system.keys, self._live_state
        prefix = keys.alive("")

        def note(key: str, alive: bool) -> None:
            (self._alive.add if alive else self._alive.discard)(key.removeprefix(prefix))

        bus.watch_alive(keys.alive("**"), note)
        self._feed = follow_records(bus, keys, live_state.add_record, live_state.add_status)
        bus.subscribe(keys.progress("*"), message_reader(GoalProgress, live_state.add_progress), latest_only=True)

    def update(self) -> None:
        """Measure the processes, and ask all managers; their answers come while the bus runs."""
        system = self._system
        self._unheard += 1
        on_states = partial(self._on_states, question=self._feed.note_question())
        system.bus.ask(system.keys.resource_states, encode(QueryStates()), on_states)
        for skill in system.skillset.skills:
            on_answer = partial(self._on_goal, skill.name)
            self._unheard += 1
            system.bus.ask(system.keys.goal(skill.name), encode(QueryGoal()), on_answer)
        self._processes = system.process_statuses(self._alive)
        now = time.monotonic()
        shares: dict[str, float] = {}
        used: dict[int, tuple[float, float]] = {}
        for entry in self._processes:
            pid = entry.state.pid
            if pid is None or entry.used is None:
                continue
            used[pid] = (now, entry.used.cpu)
            before = self._used.get(pid)
            if before is not None and now > before[0]:
                shares[entry.state.name] = 100.0 * (entry.used.cpu - before[1]) / (now - before[0])
        self._cpu, self._used = shares, used

    @property
    def heard_all(self) -> bool:
        """True if every query has its answer, or has timed out."""
        return self._unheard == 0

    def _on_states(self, answer: Answer, question: int) -> None:
        self._unheard -= 1
        if isinstance(answer, Answered):
            self._feed.take_states(answer.payload, question)

    def _on_goal(self, skill: str, answer: Answer) -> None:
        """Find silent managers, and goals that began before this subscription."""
        self._unheard -= 1
        silent = isinstance(answer, NoReply) and answer.timed_out
        (self._silent.add if silent else self._silent.discard)(skill)
        if isinstance(answer, Answered):
            with suppress(ProtocolError):  # `doctor` reports such processes
                self._feed.take_status(decode(answer.payload, GoalStatus))

    def add_recorded(self) -> None:
        """Add the goals of the run's recording on which no living process has an answer."""
        runs = self._condition(RESOURCE_MANAGER) is ProcessCondition.RUNS
        answering = self._alive if runs else self._alive - {RESOURCE_MANAGER}
        self._live_state.add_recorded(recorded_goals(self._system.target.run_dir), answering)

    # --- output ------------------------------------------------------------------------------------------------------

    @property
    def _now(self) -> float:
        return self._system.bus.now()

    def _skills(self) -> Iterable[SkillNow]:
        return (self._live_state.skill(skill.name) for skill in self._system.skillset.skills)

    def _resources(self) -> Iterable[ResourceNow]:
        return self._live_state.resources(self._feed.view.states)

    def picture(self, height: int | None = None) -> RenderableType:
        """Three tables, one above the other. A low screen leaves out idle skills and healthy processes."""
        skills, resources, entries = list(self._skills()), list(self._resources()), self._processes
        if height is not None and height < FRAME + len(skills) + len(resources) + len(entries):
            skills = [skill for skill in skills if skill.goal_id is not None or skill.last is not None]
            entries = busiest(entries, self._cpu, height - FRAME - len(skills) - len(resources))
        target = self._system.target
        time_of_robot = "" if target.clock == "wall" else f" at {self._now:.1f} s"
        title = Text.assemble((f"{target.robot}{' (mock)' if target.mock else ''}{time_of_robot}", "bold"))
        measured = any(entry.used is not None for entry in self._processes)
        use = f"   CPU {sum(self._cpu.values()):.0f} % of a core" if measured else ""
        title.append(f"   {target.endpoint}{use}", style="dim")
        if self._link.warning:
            title.append(f"\n{self._link.warning}", style="bold red")
        if len(entries) < len(self._processes):
            title.append(f"   {len(self._processes) - len(entries)} more processes", style="dim")
        skill_table = make_table(("SKILL", "STATE", "FOR", "PROGRESS", "ENDED LAST"), right=("FOR",))
        for skill in skills:
            skill_table.add_row(*self._skill_row(skill))
        resource_table = make_table(("RESOURCE", "STATE", "FOR", "BY"), right=("FOR",))
        for resource in resources:
            resource_table.add_row(
                resource.resource, state_text(resource.state), self._age(resource.since), Text(resource.by, "dim")
            )
        troubles = [Text(f"{skill}: {text}", "red") for skill, text in self._troubles().items()]
        between = [Text(), *troubles] if troubles else []
        processes = process_table(entries, self._cpu if measured else None)
        return Group(title, Text(), processes, Text(), skill_table, *between, Text(), resource_table)

    def _troubles(self) -> dict[str, str]:
        """Problems of the managers of skills, by skill."""
        skills = list(self._skills())
        reports = {skill.skill: skill.blocked for skill in skills if skill.blocked}
        for skill in skills:
            if skill.goal_id is not None and self._manager(skill.skill) is not ProcessCondition.RUNS:
                reports[skill.skill] = NO_MANAGER
        return reports | dict.fromkeys(sorted(self._silent), DOES_NOT_ANSWER)

    def _manager(self, skill: str) -> ProcessCondition:
        """Condition of a skill's manager."""
        return self._condition(skill_process(skill))

    def _condition(self, name: str) -> ProcessCondition:
        for entry in self._processes:
            if entry.state.name == name:
                return entry.condition
            if name in entry.nodes:
                return entry.nodes[name]
        return ProcessCondition.RUNS if name in self._alive else ProcessCondition.DOWN

    def _state(self, skill: SkillNow) -> Text:
        """The state of a skill: that of its goal, else IDLE, or the condition of a manager that does not run."""
        manager = self._manager(skill.skill)
        if skill.goal_id is not None:
            return Text(skill.state, "blue" if manager is ProcessCondition.RUNS else STYLES[manager])
        return Text(skill.state, "dim") if manager is ProcessCondition.RUNS else Text(manager.upper(), STYLES[manager])

    def _skill_row(self, skill: SkillNow) -> tuple[str | Text, ...]:
        last: str | Text = "" if skill.last is None else end_text(skill.last)
        if isinstance(last, Text):
            last.truncate(60, overflow="ellipsis")
        return (
            skill.skill,
            self._state(skill),
            self._age(skill.since),
            value_text(skill.feedback) if skill.feedback is not None else "",
            last,
        )

    def _age(self, since: float | None) -> str:
        return "" if since is None else duration(max(0.0, self._now - since))

    def facts(self) -> dict[str, Any]:
        """The same facts for programs."""
        return {
            "robot": self._system.target.robot,
            "t": self._now,
            "processes": {
                entry.state.name: {
                    **process_facts(entry),
                    "cpu_percent": None if entry.used is None else round(self._cpu.get(entry.state.name, 0.0), 2),
                    "memory_bytes": None if entry.used is None else entry.used.memory,
                }
                for entry in self._processes
            },
            "skills": {
                skill.skill: {**msgspec.to_builtins(skill), "manager": self._manager(skill.skill)}
                for skill in self._skills()
            },
            "silent_skills": sorted(self._silent),
            "resources": {resource.resource: resource for resource in self._resources()},
        }


def busiest(entries: Sequence[ProcessStatus], cpu: Mapping[str, float], room: int) -> list[ProcessStatus]:
    """Processes that fit into `room` rows, in their order: those with a problem, then those with the highest load."""

    def rank(entry: ProcessStatus) -> tuple[bool, float]:
        return entry.condition is ProcessCondition.RUNS, -cpu.get(entry.state.name, 0.0)

    chosen = sorted(entries, key=rank)[: max(room, FEWEST)]
    return [entry for entry in entries if entry in chosen]
