"""Reports of the missions that run on a running system, each written when its mission is over."""

from __future__ import annotations

import errno
import math
import os
import subprocess
import sys
import threading
from collections.abc import Callable, Iterable
from pathlib import Path

import msgspec
from rich.console import Console

from skillwing.services.bus import Bus, Handle
from skillwing.services.bus.reading import message_reader
from skillwing.services.disk import has_room
from skillwing.services.history.report import OperatorFacts, ProcessEntry
from skillwing.services.names import MISSION
from skillwing.services.processes.process_state import ProcessState
from skillwing.services.protocol import Keys, MissionPhase, MissionStatus
from skillwing.services.terminal.exit_codes import OK
from skillwing.services.terminal.output import relative_path

LAST_WORDS = 5.0
"""Wall seconds in which the recorder receives the map and the last records."""
LOOK_FOR_ROOM = 5.0
"""Wall seconds between two looks at a full disk on which a report is to be written."""
FULL = os.strerror(errno.ENOSPC)
"""Reason of the operating system for a report that does not fit. There may be room for a smaller one."""
ABSENCE_PERIOD = 0.5
"""Wall seconds between two looks for a mission whose token is gone."""


class _Written(msgspec.Struct, frozen=True):
    """A report that was written, as `skillwing report --brief` names it. The whole may have megabytes."""

    mission: str
    result: str
    folder: str


_WRITTEN = msgspec.json.Decoder(list[_Written])
Print = Callable[[str, str], None]
"""Prints a sentence in a style, on the bus's thread."""


class MissionReporter:
    """Follows the missions of a system, and has another process write their reports: drawing would block supervision.

    states: state of the system's processes. Call `attach` while the system runs, and `finish` after its end.
    """

    def __init__(self, run_dir: Path, skillset: str, states: Callable[[], Iterable[ProcessState]]) -> None:
        self._run_dir = run_dir
        self._keys = Keys(skillset)
        self._states = states
        self._last_status: float | None = None
        """Robot time of the running mission's last status; None without a mission."""
        self._begun: tuple[float, float] | None = None
        """Wall time and robot time of the first status of the mission; None without one."""
        self._present = False
        self._absent_since = math.inf
        """Wall time since which the mission's token is missing, while this process is connected."""
        self._absence: Handle | None = None
        self._timed: tuple[float | None, float | None] = None, None
        """Robot time of the first status of the mission to be reported, and wall seconds since then."""
        self._over_at = math.inf
        self._end: MissionStatus | None = None
        """Last status of the mission to be reported, if its end was seen."""
        self._waiting: Handle | None = None
        self._writing: threading.Thread | None = None
        self._writer: subprocess.Popen[bytes] | None = None
        self._failed = False
        """True if the latest report could not be written."""
        self._told = ""
        """Sentence on the last attempt: a disk that stays full is reported once."""

    def attach(self, bus: Bus, print_: Print) -> None:
        self._bus, self._print = bus, print_
        bus.subscribe(self._keys.mission_status, message_reader(MissionStatus, self._on_status), events=True)
        bus.watch_alive(self._keys.alive(MISSION), self._on_alive)

    def finish(self, console: Console) -> None:
        """Wait for the report that is being written, and report a mission whose end was not seen."""
        pending = self._last_status is not None or self._waiting is not None
        if self._writing is None and not pending:
            return
        try:
            with console.status("Writing the report ..."):
                if self._writing is not None:
                    self._writing.join()
                if pending:
                    if self._last_status is not None:
                        self._stop_watch()
                    console.print(self._write(self._facts(), math.inf))
        except KeyboardInterrupt:
            if self._writer is not None:
                self._writer.kill()
            command = f"skillwing report {relative_path(self._run_dir)}"
            console.print(f"No report. `{command}` writes it.", style="red")

    def _on_status(self, status: MissionStatus) -> None:
        if self._waiting is not None:
            self._waiting.cancel()
            self._start()
        self._end = status if status.phase.over else None
        if status.phase.over:
            self._stop_watch()
            self._last_status, self._over_at = None, status.t
            self._waiting = self._bus.after(LAST_WORDS, self._start, wall=True)
        elif status.phase is not MissionPhase.IDLE:
            if self._last_status is None:
                self._begun = self._bus.wall(), status.t
            self._last_status = status.t

    def _on_alive(self, key: str, alive: bool) -> None:
        self._present = alive
        if not alive and self._last_status is not None:
            if self._absence is not None:
                self._absence.cancel()
            self._absent_since = self._bus.wall()
            self._look_for_mission()

    def _look_for_mission(self) -> None:
        """A mission without token was killed, unless the router is away: then its token returns soon after that."""
        self._absence = None
        if self._present or self._last_status is None:
            return
        if not self._bus.connected:
            self._absent_since = self._bus.wall()
        if self._bus.wall() - self._absent_since < LAST_WORDS:
            self._absence = self._bus.after(ABSENCE_PERIOD, self._look_for_mission, wall=True)
            return
        self._stop_watch()
        self._last_status, self._over_at = None, self._last_status
        self._start()

    def _stop_watch(self) -> None:
        self._timed = (None, None) if self._begun is None else (self._begun[1], self._bus.wall() - self._begun[0])
        self._begun = None

    def _start(self) -> None:
        self._waiting, self._told = None, ""
        self._report(self._facts(), self._over_at)

    def _report(self, facts: bytes, until: float) -> None:
        """Have a report written. On a full disk it is tried again until there is room."""
        before = self._writing

        def write() -> None:
            if before is not None:
                before.join()
            text = self._write(facts, until)
            if text != self._told:
                self._bus.post(lambda: self._print(text, ""))
            self._told = text
            if self._failed and (FULL in text or not has_room(self._run_dir)):
                self._bus.post(lambda: self._look_later(facts, until))

        self._writing = threading.Thread(target=write, name="report", daemon=True)
        self._writing.start()

    def _report_later(self, facts: bytes, until: float) -> None:
        if has_room(self._run_dir):
            self._report(facts, until)
        else:
            self._look_later(facts, until)

    def _look_later(self, facts: bytes, until: float) -> None:
        self._bus.after(LOOK_FOR_ROOM, lambda: self._report_later(facts, until), wall=True)

    def _facts(self) -> bytes:
        processes = tuple(map(_entry, self._states()))
        begun, wall_time = self._timed
        facts = OperatorFacts(begun=begun, wall_time_s=wall_time, processes=processes, end=self._end)
        return msgspec.json.encode(facts)

    def _write(self, facts: bytes, until: float) -> str:
        """Report the last mission that had begun by then, and others without a report; returns a sentence for each."""
        words = ["report", str(self._run_dir), "--brief", "--facts", "/dev/stdin", "--until", str(until)]
        self._writer = subprocess.Popen(
            [sys.executable, "-m", "skillwing.services.terminal.cli", *words],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            start_new_session=True,
        )
        out, error = self._writer.communicate(facts)
        self._failed = self._writer.returncode != OK
        if self._failed:
            return f"There is no report of the mission. {error.decode(errors='replace').strip()}"
        return "\n".join(map(_sentence, _WRITTEN.decode(out)))


def _sentence(written: _Written) -> str:
    return f"Mission {written.mission}: {written.result}. Its report is in {relative_path(Path(written.folder))}."


def _entry(state: ProcessState) -> ProcessEntry:
    details = [state.last_words] if state.last_words else []
    if state.restarts:
        details.append(f"It was started again {state.restarts} time{'s' if state.restarts > 1 else ''}.")
    result = "died" if state.life == "given up" else "runs"
    return ProcessEntry(name=state.name, state=result, detail=" ".join(details))
