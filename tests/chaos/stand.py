"""The managers' half of the chaos matrix: one process of a small system is killed or stopped in a state of a goal.

Every process is real, and `Launcher` supervises them as `skillwing up` does.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import msgspec
from signs import Fault, Sign, Signs
from stand_nodes import MISSION, ORDERS, SKILL, STAND, Stages

from skillwing.dsl import load
from skillwing.services.bus.reading import message_reader
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.client.goal_handle import GoalHandle
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.ids import new_goal_id
from skillwing.services.mocking.system import mock_processes
from skillwing.services.names import DATA_MANAGER, RESOURCE_MANAGER, skill_process
from skillwing.services.processes.launcher import ROUTER, Launcher
from skillwing.services.protocol import GoalStatus, Keys, StartGoal, State, Terminal, encode
from skillwing.services.robot import ProcessSpec, Robot

RECORDER = "recorder"
IDLE = "idle"
STATES = (State.VALIDATING, State.DISPATCHING, State.RUNNING, State.INTERRUPTING)
PROCESSES = (
    ROUTER,
    RESOURCE_MANAGER,
    DATA_MANAGER,
    skill_process(SKILL),
    skill_process("other"),
    MISSION,
    RECORDER,
)
STAY = 2.0
"""Wall seconds for which a goal stays in the state in which the fault comes."""
RUNS_FOR = 6.0
"""Wall seconds for RUNNING, which leave time to notice that the mission was stopped."""
INTO_STATE = 0.2
"""Wall seconds from the start of that state to the fault."""
STOPPED_FOR = 4.0
"""Wall seconds between SIGSTOP and SIGCONT: longer than every lease."""
PATIENCE = 30.0
"""Longest wait for a state of a goal or for recovery, in wall seconds."""
BETWEEN_ATTEMPTS = 0.05
CLOCK_TOLERANCE = 0.01
"""Seconds by which a cause may be later than its effect: each process reads the clock of the machine itself."""
NOTICED_WITHIN = 4.0
"""Wall seconds to the first sign of a fault: a lease of 2 s, and as much again for a busy machine."""
OVER_WITHIN = 10.0
"""Wall seconds from the end of a fault to the answer of a harmed goal, its free tool, and the success of a new goal."""
HUNG_FOR = 25.0
"""Most wall seconds before a hung process is killed. Skills have to stop before that by themselves."""


@dataclass(frozen=True)
class Cell:
    process: str
    fault: Fault
    state: str
    """State of the goal when the fault comes: a `State`, or idle."""

    @property
    def expected(self) -> frozenset[str]:
        """Permitted ends of the goal. Faults in processes without a part in the goal do not change its end."""
        usual = "IT" if self.state == State.INTERRUPTING else "S_DONE"
        if self.process == skill_process(SKILL):
            lost = frozenset({"LOST by client", "LOST by resource_manager"})
            # The goal has no grant, and its start no answer yet: a repeated start may reach the next process.
            repeated = self.fault is Fault.KILL and self.state == State.VALIDATING
            return lost | {usual} if repeated else lost
        if self.process == MISSION or self.fault is Fault.HANG:
            return frozenset({"IT"})
        stopped = self.fault is Fault.STOP and self.process in (ROUTER, RESOURCE_MANAGER)
        if stopped and self.state == State.VALIDATING:
            # The robot's data have not reached the resource manager: the precondition on them is false while they are
            # stale, and a request that waited may be the first that it reads when it wakes up.
            return frozenset({usual, "NR"})
        if self.fault is Fault.STOP and self.process == ROUTER and self.state != IDLE:
            # Processes notice the silence of the router after 2 s. The lease of a grant may end up to 0.5 s before.
            return frozenset({usual, "LOST by resource_manager"})
        return frozenset({usual})


@dataclass(frozen=True)
class Result:
    """Outcome of a cell, in wall seconds.

    answer: end of the goal and its source; None without a goal. answered, free: time from the fault to that answer, and
    to the final release of the tool. again: time to the success of a new goal, from the fault, the wake-up or the end
    of an unharmed goal. None: it did not happen. harmed: True if the end differs from the faultless one. lasted:
    duration of the fault.
    """

    cell: Cell
    noticed: Sign | None
    answer: str | None
    harmed: bool
    answered: float | None
    free: float | None
    again: float | None
    lasted: float = 0.0
    bad_chains: tuple[str, ...] = ()
    """Failures since the fault whose causes lead nowhere, back in time, or to something unrelated. Exits of killed
    processes without a record are among them."""

    @property
    def as_promised(self) -> bool:
        """True if the goal has a permitted end, the tool is free, the system works, and the causes are right."""
        goal_is_over = self.cell.state == IDLE or (self.answered is not None and self.answer in self.cell.expected)
        return goal_is_over and self.free is not None and self.again is not None and not self.bad_chains

    @property
    def in_time(self) -> bool:
        """True if the fault was noticed, and its effects were over, within the limits."""
        noticed = self.noticed is not None and self.noticed.after <= NOTICED_WITHIN
        over = [each for each in (self.answered, self.free) if self.harmed and each is not None]
        again = self.again is not None and self.again <= OVER_WITHIN
        return noticed and again and max(over, default=0.0) <= self.lasted + OVER_WITHIN

    @property
    def kept(self) -> bool:
        """True if the cell is as promised, and in time."""
        return self.as_promised and self.in_time


def cells() -> Iterator[Cell]:
    """All cells. Each process runs for a while between its kills, as the launcher limits exits in a row."""
    for state in (IDLE, *STATES):
        for fault in (Fault.KILL, Fault.STOP):
            for process in PROCESSES:
                yield Cell(process, fault, state)
    yield Cell(RESOURCE_MANAGER, Fault.HANG, State.RUNNING)


class Stand:
    """The system and a client of it, as a context manager. Raises StartError."""

    def __init__(self, run_dir: Path) -> None:
        skillset = load(STAND)
        keys = Keys(skillset.name)
        robot = Robot(name="stand", skillset=STAND, hooks={SKILL: "stand_nodes:WorkManager"}, clock="wall")
        self._specs = _processes(robot, run_dir)
        self._skillset = skillset
        self._undoing = ExitStack()
        with ExitStack() as undoing:
            self.launcher = Launcher(skillset.name, skillset.name, run_dir, clock="wall", restarts=True)
            undoing.callback(self.launcher.stop)
            self.launcher.start(self._specs)
            self._bus = ZenohBus("chaos", skillset.name, self.launcher.endpoint)
            undoing.callback(self._bus.close)
            self.signs = Signs(self._bus, keys, self.launcher, robot)
            undoing.callback(self.signs.close)
            self._client = SkillsetInterface(self._bus, skillset, client="chaos")
            self._statuses: dict[str, GoalStatus] = {}
            self._bus.subscribe(keys.status(SKILL), message_reader(GoalStatus, self._on_status), events=True)
            self._orders = self._bus.advertise(ORDERS)
            self.signs.run_until(lambda: self._client.ready, PATIENCE)
            self._undoing = undoing.pop_all()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._undoing.close()

    def make_sound(self) -> bool:
        """Start ended processes without automatic restart. True if goals succeed and every process lives."""
        missing = [spec for spec in self._specs if not self.launcher.running(spec.name) and spec.restart == "never"]
        self.launcher.start(missing)
        return self._until_a_goal_succeeds() and all(self.launcher.running(name) for name in PROCESSES)

    def suffer(self, cell: Cell) -> Result:
        """Bring a goal into its state, inject the fault, and watch until the system has recovered."""
        goal = None if cell.state == IDLE else self._goal_in(cell)
        signs, since_fault = self.signs, self._bus.now()
        signs.harm(cell.process, cell.fault)
        answered = free = None
        lasted = 0.0

        def well() -> bool:
            nonlocal answered, free
            if answered is None and (goal is None or self._terminal(goal) is not None):
                answered = signs.elapsed
            if self._client.states["tool"] != "FREE":
                free = None
            elif free is None:
                free = signs.elapsed
            return answered is not None and free is not None

        if cell.fault is Fault.STOP:
            signs.run_until(lambda: well() and False, STOPPED_FOR)
            signs.wake()
            lasted = signs.elapsed
        elif cell.fault is Fault.HANG:
            assert goal is not None
            signs.run_until(lambda: well() or self._state(goal) is State.INTERRUPTING, HUNG_FOR)
            signs.kill()
            lasted = signs.elapsed
        recovered = signs.run_until(well, PATIENCE)
        terminal = None if goal is None else self._terminal(goal)
        harmed = terminal is not None and not _as_usual(terminal, cell.state)
        # The remaining time of an unharmed goal is no part of recovery.
        since = lasted if harmed or answered is None else max(lasted, answered)
        works = recovered and self._until_a_goal_succeeds()
        return Result(
            cell=cell,
            noticed=signs.first,
            answer=None if terminal is None else _told(terminal),
            harmed=harmed,
            answered=answered if goal is not None else None,
            free=free,
            again=signs.elapsed - since if works else None,
            lasted=lasted,
            bad_chains=signs.bad_exit() + signs.bad_chains(self._skillset, since_fault, CLOCK_TOLERANCE),
        )

    def _goal_in(self, cell: Cell) -> GoalHandle | str:
        """Bring a goal into the cell's state. Returns its handle, or its id if the mission has started it."""
        state, by_mission = State(cell.state), cell.process == MISSION
        # A fault of the mission takes effect on its goal when the blocking hook has returned.
        afterwards = STAY if by_mission else Stages().run
        stay = {
            State.VALIDATING: Stages(validate=STAY, run=afterwards),
            State.DISPATCHING: Stages(dispatch=STAY, run=afterwards),
            State.RUNNING: Stages(run=RUNS_FOR if cell.fault is not Fault.HANG else HUNG_FOR + PATIENCE),
            State.INTERRUPTING: Stages(run=PATIENCE, stop=STAY),
        }[state]
        inputs = msgspec.to_builtins(stay)
        if by_mission:
            goal = new_goal_id()
            order = StartGoal(goal_id=goal, inputs=inputs, client="chaos", schema="")
            self._orders.put(encode(order))
        else:
            goal = self._client.start(SKILL, inputs)
        if state is State.INTERRUPTING:
            self._reach(goal, State.RUNNING)
            handle = self._client.start(SKILL, inputs, goal_id=goal) if isinstance(goal, str) else goal
            self._client.interrupt(handle)
        self._reach(goal, state)
        self.signs.run_until(lambda: False, INTO_STATE)
        return goal

    def _reach(self, goal: GoalHandle | str, state: State) -> None:
        if not self.signs.run_until(lambda: self._state(goal) is state, PATIENCE):
            raise RuntimeError(f"No goal got to {state}; it is in {self._state(goal)}.")

    def _state(self, goal: GoalHandle | str) -> State | None:
        if isinstance(goal, GoalHandle):
            return goal.state
        return self._statuses[goal].state if goal in self._statuses else None

    def _terminal(self, goal: GoalHandle | str) -> Terminal | None:
        if isinstance(goal, GoalHandle):
            return goal.terminal
        return self._statuses[goal].terminal if goal in self._statuses else None

    def _until_a_goal_succeeds(self) -> bool:
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            goal = self._client.start(SKILL)
            self.signs.run_until(lambda goal=goal: goal.done, deadline - time.monotonic())
            if goal.terminal is not None and goal.terminal.label == "S_DONE":
                return True
            self.signs.run_until(lambda: False, BETWEEN_ATTEMPTS)
        return False

    def _on_status(self, status: GoalStatus) -> None:
        self._statuses[status.goal_id] = status


def _processes(robot: Robot, run_dir: Path) -> tuple[ProcessSpec, ...]:
    run = {"run_dir": str(run_dir)}
    specs = {spec.name: spec for spec in mock_processes(robot, run=run)}
    own = skill_process(SKILL)
    specs[own] = next(spec for spec in robot.managers(run) if spec.name == own)
    recorder = ProcessSpec(
        RECORDER,
        "skillwing.services.recording.recorder:make_recorder",
        {"run_dir": str(run_dir), "skillset": str(STAND)},
        essential=False,
        restart="never",
    )
    mission = ProcessSpec(MISSION, "stand_nodes:make_mission", essential=False, restart="never")
    return (*specs.values(), recorder, mission)


def _as_usual(terminal: Terminal, state: str) -> bool:
    if state == State.INTERRUPTING:
        return terminal.label == "IT" and not terminal.forced
    return terminal.label == "S_DONE"


def _told(terminal: Terminal) -> str:
    by = f" by {terminal.detected_by}" if terminal.detected_by else ""
    return f"{terminal.label}{' (forced)' if terminal.forced else ''}{by}"
