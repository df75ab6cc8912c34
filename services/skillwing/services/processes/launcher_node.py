"""Node of a launcher: it runs missions on board, and puts the exits of processes on the timeline."""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from types import MappingProxyType
from typing import Any, Protocol

import msgspec

from skillwing.services.access.certificate_watch import CertificateWatch
from skillwing.services.bus import Bus, Request
from skillwing.services.bus.reading import message_reader
from skillwing.services.core.attribution import attributed
from skillwing.services.core.refusal import RefusedError
from skillwing.services.errors import SkillwingError
from skillwing.services.names import EXITED, KILLED, LAUNCHER, MISSION, STARTED
from skillwing.services.processes.child import ProcessExit
from skillwing.services.processes.launcher import LOGS
from skillwing.services.processes.lifetime import EXIT_CONFIGURATION, EXIT_PASSING
from skillwing.services.processes.mission_slot import MissionSlot, being_started
from skillwing.services.processes.process_state import ProcessState
from skillwing.services.protocol import (
    ErrorCode,
    ErrorReply,
    Keys,
    M,
    MissionStatus,
    NodesExited,
    ProtocolError,
    QueryMission,
    RecordKind,
    StartMission,
    decode,
    encode,
)
from skillwing.services.robot import ProcessSpec, Robot
from skillwing.services.timeline import Timeline

FACTORY = "skillwing.bt_missions.running.on_board:make_mission_on_board"
TREES = "trees"
"""Folder of the tree files that were sent to this robot, in the directory of its run."""

MISSIONS_KEPT = 20
"""Missions on board whose log and tree file stay: the latest ones."""
NEWS = " INFO "
"""Mark of the lines of a log that are no reasons."""
LATE_STATUS = 1.0
"""Wall seconds by which the last status of a mission may arrive after the end of its process, on another route."""

log = logging.getLogger(__name__)


def mission_on_board(
    robot: Robot,
    mission: str,
    options: Mapping[str, Any],
    *,
    robots: Mapping[str, str] = MappingProxyType({}),
    sites: Mapping[str, Mapping[str, Any]] = MappingProxyType({}),
    request_id: str = "",
) -> ProcessSpec:
    """The process of a mission on board of a robot, by the mission's name or file.

    robots: of a mission on several, by their names in the mission. sites: options of missions by the site, by mission.
    request_id: of the request for it.
    """
    given = {
        "mission": mission,
        "skillset": str(robot.skillset),
        "rescue_goal": msgspec.to_builtins(robot.rescue_goal),
        "options": dict(options),
        "robot": robot.name,
        "robots": dict(robots),
        "sites": {name: dict(site) for name, site in sites.items()},
        "request_id": request_id,
    }
    return ProcessSpec(MISSION, FACTORY, given, essential=False, extra="missions", restart="never")


class ProcessLauncher(Protocol):
    """The part of a `Launcher` that its node needs."""

    @property
    def run_dir(self) -> Path: ...
    @property
    def states(self) -> tuple[ProcessState, ...]: ...
    def launch(self, spec: ProcessSpec, log: str) -> None: ...
    def forget(self, name: str) -> None: ...


class LauncherNode:
    """Serves `mission/start` for the processes of a launcher.

    sites: options of missions by the site, by mission. certificates: None without keys. In the last day of one of them
    no mission starts: the router would end all links of the robot at the same time, perhaps while it moves.
    """

    name = LAUNCHER
    owns_clock = False

    def __init__(
        self,
        launcher: ProcessLauncher,
        robot: Robot,
        skillset: str,
        sites: Mapping[str, Mapping[str, Any]],
        certificates: CertificateWatch | None = None,
    ) -> None:
        self._launcher = launcher
        self._robot = robot
        self._keys = Keys(skillset)
        self._sites = sites
        self._certificates = certificates
        self._slot = MissionSlot()
        self._started = 0
        self._files: deque[tuple[Path, ...]] = deque()
        """Files of the missions on board that were started last, by mission."""

    def attach(self, bus: Bus) -> None:
        self._bus = bus
        keys = self._keys
        self._timeline = Timeline(bus, keys)
        self._exits = bus.advertise(keys.exits, events=True)
        # No events: their history would show the end of an earlier mission to those who come later.
        self._status = bus.advertise(keys.mission_status)
        bus.subscribe(keys.mission_status, message_reader(MissionStatus, self._slot.note), events=True)
        bus.watch_alive(keys.alive(MISSION), self._on_alive)
        _serve(bus, keys.mission_start, StartMission, self._start_on_request)
        _serve(bus, keys.mission_status, QueryMission, self._latest_status)

    def detach(self) -> None:
        """Do nothing: the processes end with their launcher."""

    def take_exit(self, ended: ProcessExit) -> bool:
        """Put the exit of a process on the timeline. Returns False for one of no interest: a mission that is over."""
        if ended.process == MISSION and self._end_mission(ended):
            return False
        after = EXITED if ended.signal is None else KILLED
        record = self._timeline.record(RecordKind.PROCESS, ended.process, None, after, text=str(ended))
        nodes = next((each.tokens for each in self._launcher.states if each.name == ended.process), (ended.process,))
        self._exits.put(encode(NodesExited(nodes=nodes, record=record, t=self._bus.now())))
        return True

    # --- missions ----------------------------------------------------------------------------------------------------

    def _start_on_request(self, message: StartMission) -> MissionStatus:
        status = self._slot.request(message, self._bus.now(), self._objection())
        if status is None:
            self._start(message)
            raise being_started(message)
        return status

    def _objection(self) -> RefusedError | None:
        watch = self._certificates
        if watch is None or not (text := watch.objection()):
            return None
        return RefusedError(ErrorCode.NOT_ALLOWED, text, help=watch.remedy())

    def _latest_status(self, query: QueryMission) -> MissionStatus:
        return self._slot.on_board() if query.on_board else self._slot.latest(query.request_id)

    def _start(self, message: StartMission) -> None:
        """Start the process of a mission. Its node checks that the mission fits; if not, the process ends at once."""
        self._started += 1
        number = "" if self._started == 1 else f"-{self._started}"
        try:
            tree = self._written_tree(message, number)
            self._keep_files(self._launcher.run_dir / LOGS / f"{MISSION}{number}.log", tree)
            self._launcher.launch(self._process(message, tree), f"{MISSION}{number}")
            text = f"{message.client} starts `{message.mission}` on board"
            self._timeline.record(RecordKind.PROCESS, MISSION, None, STARTED, text=text)
        except (SkillwingError, OSError) as error:
            log.exception("the mission %s could not be started", message.mission)
            self._slot.exited(f"{error}".rstrip(".") + ".", ())

    def _written_tree(self, message: StartMission, number: str) -> Path | None:
        """Write the tree of a mission to a file, if it has one."""
        if not message.tree:
            return None
        file = self._launcher.run_dir / TREES / f"{message.mission}{number}.xml"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(message.tree, encoding="utf-8")
        return file

    def _keep_files(self, log: Path, tree: Path | None) -> None:
        """Note the files of a mission that is started, and delete those of the oldest."""
        self._files.append((log, log.with_name(f"{log.name}.1"), *([] if tree is None else [tree])))
        while len(self._files) > MISSIONS_KEPT:
            for file in self._files.popleft():
                with suppress(OSError):
                    file.unlink(missing_ok=True)

    def _process(self, message: StartMission, tree: Path | None) -> ProcessSpec:
        mission = message.mission if tree is None else str(tree)
        return mission_on_board(
            *(self._robot, mission, message.options),
            robots=message.robots,
            sites=self._sites,
            request_id=message.request_id,
        )

    def _on_alive(self, _key: str, alive: bool) -> None:
        if alive:
            self._slot.appeared()
        else:
            self._slot.vanished()

    def _end_mission(self, ended: ProcessExit) -> bool:
        """Take the end of the mission's process. Returns True if the mission was over, or had not begun."""
        if ended.exit_code == 0 and self._slot.ends_unheard:

            def free() -> None:
                self._free_slot(ended)

            self._bus.after(LATE_STATUS, free, wall=True)
            return True
        return self._free_slot(ended) or ended.exit_code == 0

    def _free_slot(self, ended: ProcessExit) -> bool:
        """Free the place of the mission. Returns True if the mission had not begun."""
        told = ended.exit_code in (EXIT_CONFIGURATION, EXIT_PASSING)  # its last lines are the reason
        does_not_fit = ended.exit_code == EXIT_CONFIGURATION
        lines = [line for line in ended.log if NEWS not in line]
        sentence = "" if told and lines else str(ended)
        refused = self._slot.exited(sentence, lines, does_not_fit=does_not_fit)
        self._launcher.forget(MISSION)
        cut_short = None if refused else self._slot.cut_short(f"its process has ended: {ended}", self._bus.now())
        if cut_short is not None:
            self._status.put(encode(cut_short))
        return refused


def _serve(bus: Bus, key: str, kind: type[M], answer: Callable[[M], MissionStatus]) -> None:
    def on_request(request: Request) -> None:
        try:
            request.reply(encode(answer(attributed(decode(request.payload, kind), request.asker))))
        except ProtocolError as error:
            help_ = f"Send the message `{kind.__name__}`."
            request.refuse(ErrorReply(code=ErrorCode.BAD_REQUEST, message=f"{error}.", help=help_))
        except RefusedError as error:
            request.refuse(error.reply)

    bus.serve(key, on_request)
