"""Mission flights of the m600 in which one process is killed or stopped in the air, and their outcomes."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path

from signs import BAD_ENDS, Fault, Sign, Signs

from skillwing.bt_missions.missions.mapping import MISSION
from skillwing.bt_missions.running.process import mission_process
from skillwing.dsl.model import Skillset
from skillwing.m600.robot import ROBOT
from skillwing.onboard.topics.flight import FLIGHT, FlightState
from skillwing.onboard.topics.truth import TRUTH, Truth
from skillwing.services.bus.reading import message_reader
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.client.causal_feed import follow_records
from skillwing.services.names import DATA_MANAGER, RESOURCE_MANAGER, skill_process
from skillwing.services.processes.launcher import ROUTER, Launcher
from skillwing.services.protocol import Keys, MissionStatus, Record, RecordKind
from skillwing.services.robot import ProcessSpec

ROUTE = ((14.0, 0.0, 4.0),)
STOPPED_FOR = 6.0
"""Wall seconds between SIGSTOP and SIGCONT."""
TO_THE_MOMENT = 120.0
"""Wall seconds in which a flight has to reach the moment of the fault."""
TO_THE_GROUND = 240.0
"""Wall seconds after the fault in which the drone has to be on the ground."""
LAST_WORDS = 20.0
"""Wall seconds that the mission has for its last status after the landing."""
CLOCK_TOLERANCE = 0.1
"""Seconds of robot time by which a cause may be later than its effect: each process follows the clock by itself."""
SIMULATOR = "sim"
MISSION_PROCESS = "mission"


class Moment(StrEnum):
    TAKE_OFF = "take-off"
    CRUISE = "cruise"

    def reached(self, truth: Truth) -> bool:
        east, _, up = truth.position
        return up > 1.5 if self is Moment.TAKE_OFF else east > 4.0


@dataclass(frozen=True)
class FlightCell:
    process: str
    fault: Fault
    moment: Moment


@dataclass(frozen=True)
class FlightResult:
    """Outcome of a flight.

    noticed: first sign of the fault. lost: goals that ended LOST or ERROR, as `skill LABEL`. mission: its last status,
    or that it is dead. landed: wall seconds from the fault to standing still on the ground; None without a landing.
    from_home: horizontal distance in m. failsafe: True if a failsafe of the autopilot acted. collisions, left_fence:
    ground truth of the physics. world_ended: True if the simulator was killed, and the world with it. bad_chains:
    failures whose causes lead nowhere, back in time, or to something unrelated.
    """

    cell: FlightCell
    noticed: Sign | None
    lost: tuple[str, ...]
    mission: str
    landed: float | None
    from_home: float
    failsafe: bool
    collisions: int
    left_fence: bool
    world_ended: bool
    bad_chains: tuple[str, ...] = ()

    @property
    def kept(self) -> bool:
        """True if the drone hit nothing, stayed in the fence and landed, and the causes are right. A world that ended
        needs no landing."""
        safe = not self.collisions and not self.left_fence and not self.bad_chains
        return safe and (self.world_ended or self.landed is not None)

    @property
    def outcome(self) -> str:
        """Short description of the event."""
        if self.world_ended:
            return "the simulated world ends with it, and the system"
        if self.landed is None:
            return "**still flies**"
        where = "at home" if self.from_home < 2.0 else f"{self.from_home:.0f} m from home"
        hit = f", **{self.collisions} collisions**" if self.collisions else ""
        helped = "; the autopilot's failsafe helped" if self.failsafe else ""
        return f"landed {where}{hit}{helped}" + "".join(f"; **{chain}**" for chain in self.bad_chains)


def flight_cells() -> Iterator[FlightCell]:
    """Cells to fly: each process killed in cruise, some also stopped there, and three killed at take-off."""
    everybody = (
        ROUTER,
        RESOURCE_MANAGER,
        DATA_MANAGER,
        skill_process("goto_straight"),
        MISSION_PROCESS,
        "recorder",
        SIMULATOR,
        "guidance",
        "obstacles",
        "mapping",
        "bridge",
    )
    stopped = (skill_process("goto_straight"), MISSION_PROCESS, SIMULATOR, "guidance", "obstacles", "bridge")
    for process in everybody:
        yield FlightCell(process, Fault.KILL, Moment.CRUISE)
        if process in stopped:
            yield FlightCell(process, Fault.STOP, Moment.CRUISE)
    for process in (skill_process("takeoff"), MISSION_PROCESS, "guidance"):
        yield FlightCell(process, Fault.KILL, Moment.TAKE_OFF)


def fly(cell: FlightCell) -> FlightResult:
    """Fly, inject the fault and wait for the landing. Raises StartError, and RuntimeError if there was no flight."""
    with tempfile.TemporaryDirectory(prefix="chaos-") as folder:
        run_dir = Path(folder)
        skillset = ROBOT.load_skillset()
        with Launcher(ROBOT.name, skillset.name, run_dir, clock=ROBOT.clock, restarts=True) as launcher:
            launcher.start((*_robot(run_dir), _mission()))
            bus = ZenohBus("chaos", ROBOT.name, launcher.endpoint)
            try:
                flight = _Flight(bus, skillset, launcher)
                with closing(flight.signs):
                    return flight.suffer(cell)
            finally:
                bus.close()


def _robot(run_dir: Path) -> tuple[ProcessSpec, ...]:
    options = {"seed": 1, "run_dir": str(run_dir)}
    return (*ROBOT.observers(options), *ROBOT.functional_layer(options), *ROBOT.managers(options))


def _mission() -> ProcessSpec:
    return replace(mission_process(ROBOT, MISSION.name, {"route": ROUTE}), essential=False)


class _Flight:
    def __init__(self, bus: ZenohBus, skillset: Skillset, launcher: Launcher) -> None:
        keys = Keys(skillset.name)
        self._skillset = skillset
        self._truth: Truth | None = None
        self._state: FlightState | None = None
        self._status: MissionStatus | None = None
        self._failsafe = False
        self._left_fence = False
        self._harmed = False
        self._lost: dict[str, str] = {}
        self.signs = Signs(bus, keys, launcher, ROBOT)
        bus.subscribe(TRUTH, message_reader(Truth, self._on_truth), latest_only=True)
        bus.subscribe(FLIGHT, message_reader(FlightState, self._on_state), latest_only=True)
        bus.subscribe(keys.mission_status, message_reader(MissionStatus, self._on_mission), events=True)
        follow_records(bus, keys, self._on_record)

    def suffer(self, cell: FlightCell) -> FlightResult:
        signs = self.signs
        if not signs.run_until(lambda: self._truth is not None and cell.moment.reached(self._truth), TO_THE_MOMENT):
            raise RuntimeError(f"The flight did not get to {cell.moment}: {self._status}")
        self._harmed = True
        since_fault = self._truth.t if self._truth is not None else 0.0
        signs.harm(cell.process, cell.fault)
        world_ended = cell.process == SIMULATOR and cell.fault is Fault.KILL
        if cell.fault is Fault.STOP:
            signs.run_until(lambda: False, STOPPED_FOR)
            signs.wake()
        if world_ended:
            signs.run_until(lambda: signs.first is not None, STOPPED_FOR)
        stands = not world_ended and signs.run_until(self._stands, TO_THE_GROUND)
        landed = signs.elapsed if stands else None
        silent = cell.process == MISSION_PROCESS and cell.fault is Fault.KILL
        if stands and not silent:
            signs.run_until(self._mission_over, LAST_WORDS)
        assert self._truth is not None
        east, north, _ = self._truth.position
        return FlightResult(
            cell=cell,
            noticed=signs.first,
            lost=tuple(self._lost.values()),
            mission="it is dead" if silent else self._last_words(),
            landed=landed,
            from_home=math.hypot(east, north),
            failsafe=self._failsafe,
            collisions=self._truth.collisions,
            left_fence=self._left_fence,
            world_ended=world_ended,
            bad_chains=signs.bad_exit() + signs.bad_chains(self._skillset, since_fault, CLOCK_TOLERANCE),
        )

    def _stands(self) -> bool:
        return self._state is not None and self._state.on_ground and not self._state.rotors_on

    def _mission_over(self) -> bool:
        return self._status is not None and self._status.phase.over

    def _last_words(self) -> str:
        if self._status is None:
            return "it never began"
        return f"{self._status.phase}: {self._status.text}" if self._status.text else self._status.phase

    def _on_truth(self, truth: Truth) -> None:
        self._truth = truth
        self._left_fence |= not truth.inside_fence

    def _on_state(self, state: FlightState) -> None:
        self._state = state
        self._failsafe |= bool(state.failsafe) and self._harmed

    def _on_mission(self, status: MissionStatus) -> None:
        self._status = status

    def _on_record(self, record: Record) -> None:
        if self._harmed and record.kind is RecordKind.GOAL and record.after in BAD_ENDS:
            self._lost[record.goal_id or record.id] = f"{record.subject} {record.after}"
