"""A mission on board, seen from the command that has started it: the command may end, and the mission goes on."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import typer
from rich.console import Console

from skillwing.bt_missions.cli.foreground import print_if_open
from skillwing.bt_missions.cli.mission_robots import addressed_text
from skillwing.bt_missions.cli.watch import SILENCES, ask_latest_status, status_line
from skillwing.bt_missions.library import UnknownMissionError, find_mission
from skillwing.bt_missions.mission.mission import Mission
from skillwing.services.bus.reading import message_reader
from skillwing.services.errors import InvalidOptionError, NoReplyError, RefusedError, SkillwingError, TimedOutError
from skillwing.services.names import MISSION
from skillwing.services.processes.mission_slot import NAME
from skillwing.services.protocol import ErrorCode, MissionPhase, MissionStatus, QueryMission, StartMission
from skillwing.services.terminal.connection import System
from skillwing.services.terminal.exit_codes import FAILED, INTERRUPTED, OK
from skillwing.services.terminal.link_monitor import ON_BOARD, follow_link
from skillwing.services.terminal.output import print_json

ASK_PERIOD = 0.25
"""Time between two questions whether the mission's process has started, in seconds of wall time."""
START_TIMEOUT = 60.0
"""Longest time for that start, in seconds of wall time."""
NEWS_WAIT = 1.0
"""Wait for the last status of a mission whose alive token is gone, in seconds of wall time."""
ABORT = "`skillwing mission abort` ends it."
LEFT = f"The mission goes on on board. {ABORT}"
FORGOTTEN = "`skillwing runs list` has its result, `skillwing status` the state of the robot."
CLIENT = "cli"


class NoLauncherError(SkillwingError):
    """No launcher serves missions: the processes of the robot were started by other means, such as containers."""

    def __init__(self) -> None:
        super().__init__(
            "No launcher of this robot runs missions. Start the robot with `skillwing up`, or leave out --on-board."
        )


class MissionForgottenError(SkillwingError):
    """The launcher of a mission has been started again, and the mission has ended with the one before."""

    def __init__(self, mission: str, remedy: str = FORGOTTEN) -> None:
        text = f"The robot's system was started again, and mission {mission} ended with the one before."
        super().__init__(f"{text} {remedy}")


def known_mission(name: str) -> Mission | None:
    """The mission of a tree file, or an installed one; None for one that is at most installed on the robot.

    Raises InvalidOptionError for a Python file, and TreeFileError for a tree file with problems.
    """
    if Path(name).suffix == ".py":
        text = f"`{name}` is a Python file. Its mission has to be installed on the robot. Then give its name."
        raise InvalidOptionError("on-board", text)
    try:
        return find_mission(name)
    except (UnknownMissionError, InvalidOptionError):
        if Path(name).suffix == ".xml":
            raise
        return None


def make_request(
    name: str, options: dict[str, Any], robots: Mapping[str, str], request_id: str, mission: Mission | None = None
) -> StartMission:
    """The request for a mission: by its name on the robot, or with the text of a tree file.

    robots: of a mission on several. mission: that of the file, whose name it has in all messages.
    """
    file = Path(name)
    tree = ""
    if file.suffix == ".xml":
        tree = file.read_text(encoding="utf-8")
        name = mission.name if mission is not None and NAME.fullmatch(mission.name) else file.stem
    return StartMission(
        request_id=request_id, mission=name, client=CLIENT, options=options, tree=tree, robots=dict(robots)
    )


def run_on_board(system: System, request: StartMission, console: Console | None) -> int:
    """Start a mission on board and show its progress until it is over; returns the exit code.

    Raises NoLauncherError, MissionForgottenError, InvalidOptionError for a mission that does not fit, and RefusedError
    while another one runs.
    """

    def show(status: MissionStatus) -> None:
        print_if_open(console, status_line(status, addressed_text(status.text, system, request.robots)))

    seen = OnBoardWatch(system, show)
    try:
        seen.start(request)
        if console is not None:
            console.print(
                f"Mission {request.mission} runs on board. Ctrl-C ends this view only. {system.addressed(ABORT)}"
            )
        system.bus.run_until(lambda: seen.over or seen.forgotten)
    except KeyboardInterrupt:
        typer.echo(system.addressed(LEFT), err=console is None)
        return INTERRUPTED
    if seen.forgotten:
        raise MissionForgottenError(request.mission, system.addressed(FORGOTTEN))
    if console is None:
        print_json(seen.status)
    return OK if seen.succeeded else FAILED


def begins_on_board(system: System) -> str | None:
    """Name of the mission that the launcher runs, even before its process has an alive token; None without one."""
    try:
        return system.ask(system.keys.mission_status, QueryMission(on_board=True), MissionStatus).mission
    except (NoReplyError, RefusedError):  # no launcher, or no such mission
        return None


class OnBoardWatch:
    """Watch of a mission on board until its end, also when the end comes while the link is away.

    forgotten: the robot has another launcher now, which does not know the mission.
    """

    def __init__(self, system: System, show: Callable[[MissionStatus], None]) -> None:
        self.status: MissionStatus | None = None
        self.forgotten = False
        self._request_id = ""
        self._system = system
        self._show = show

    @property
    def over(self) -> bool:
        return self.status is not None and self.status.phase.over

    @property
    def succeeded(self) -> bool:
        return self.status is not None and self.status.phase is MissionPhase.SUCCEEDED

    def start(self, request: StartMission) -> None:
        """Ask until the mission runs, and follow it from then on. Raises as `run_on_board` does."""
        system = self._system
        bus, keys = system.bus, system.keys
        self._request_id = request.request_id
        follow_link(system, self._on_link, ON_BOARD)
        self._asked_until_it_runs(request)
        bus.subscribe(keys.mission_status, message_reader(MissionStatus, self._take), events=True)
        bus.watch_alive(keys.alive(MISSION), self._on_alive)
        # It may be over already, and its statuses gone with its process.
        bus.after(NEWS_WAIT, self._ask_launcher, wall=True)

    def _asked_until_it_runs(self, request: StartMission) -> MissionStatus:
        bus, key = self._system.bus, self._system.keys.mission_start
        deadline, silences = bus.wall() + START_TIMEOUT, 0
        while bus.wall() < deadline:
            try:
                return self._system.ask(key, request, MissionStatus)
            except NoReplyError:
                silences = silences + 1 if bus.connected else 0
                if silences >= SILENCES:
                    raise NoLauncherError from None
            except RefusedError as refusal:
                if refusal.code is ErrorCode.BAD_REQUEST:
                    raise InvalidOptionError("mission", str(refusal)) from refusal
                if refusal.code is not ErrorCode.UNAVAILABLE:
                    raise
                silences = 0
            bus.run_until(lambda: False, ASK_PERIOD)
        raise TimedOutError(f"The start of mission {request.mission}", START_TIMEOUT)

    def _take(self, status: MissionStatus) -> None:
        """Take a status of this mission; the same one may come twice."""
        if status.request_id != self._request_id or self.over:
            return
        if self.status is None or status.t > self.status.t or status.phase != self.status.phase:
            self.status = status
            self._show(status)

    def _on_link(self, sentence: str) -> None:
        typer.echo(sentence, err=True)
        if self._system.bus.connected:
            self._ask_launcher()

    def _on_alive(self, _key: str, alive: bool) -> None:
        if not alive:
            self._system.bus.after(NEWS_WAIT, self._ask_launcher, wall=True)

    def _ask_launcher(self) -> None:
        """Ask for the latest status, which may have been published while the link was away."""
        if not self.over:
            ask_latest_status(self._system, self._take, self._request_id, self._forget)

    def _forget(self) -> None:
        self.forgotten = not self.over
