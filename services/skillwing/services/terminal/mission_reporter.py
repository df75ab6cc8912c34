"""The report of each mission that is flown with a running system, made when it is over."""

from __future__ import annotations

import json
import math
import subprocess
import sys
import threading
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import msgspec
from rich.console import Console

from skillwing.services.bus import Bus, Handle
from skillwing.services.bus.reading import message_reader
from skillwing.services.history.report import ProcessEntry, Witnessed
from skillwing.services.names import MISSION
from skillwing.services.processes.process_state import ProcessState
from skillwing.services.protocol import Keys, MissionStatus
from skillwing.services.terminal.exit_codes import OK
from skillwing.services.terminal.system_options import shown

LAST_WORDS = 5.0
"""Wall seconds that the recorder gets for the map and the last records."""
LATE_WORD = 1.0
"""Wall seconds by which the last word of a mission may come after the end of its process: they take different ways."""
Tell = Callable[[str, str], None]
"""Says a sentence in a style, on the bus's thread."""


class FlightReports:
    """Follows the missions of a system, and has a process write their reports: drawing would keep whoever watches over
    a robot from it.

    states: what becomes of the system's processes. `attach` while it runs; `finish` when it has stopped.
    """

    def __init__(self, run_dir: Path, skillset: str, states: Callable[[], Iterable[ProcessState]]) -> None:
        self._run_dir = run_dir
        self._keys = Keys(skillset)
        self._states = states
        self._processes: tuple[ProcessEntry, ...] = ()
        self._flies_at: float | None = None
        """Robot time at which the mission that flies told of itself last; None where none does."""
        self._begun: float | None = None
        """Wall time of its begin; None where that is not known."""
        self._present = False
        self._wall_time: float | None = None
        self._over_at = math.inf
        self._waiting: Handle | None = None
        self._writing: threading.Thread | None = None
        self._writer: subprocess.Popen[bytes] | None = None

    def attach(self, bus: Bus, tell: Tell) -> None:
        self._bus, self._tell = bus, tell
        bus.subscribe(self._keys.mission_status, message_reader(MissionStatus, self._on_status), events=True)
        bus.watch_alive(self._keys.alive(MISSION), self._on_alive)

    def finish(self, console: Console) -> None:
        """Wait for what is being written, and write of a mission whose end nobody saw what there is of it."""
        unfinished = self._flies_at is not None or self._waiting is not None
        if self._writing is None and not unfinished:
            return
        try:
            with console.status("Writing the report ..."):
                if self._writing is not None:
                    self._writing.join()
                if unfinished:
                    if self._flies_at is not None:
                        self._measure()
                    console.print(self._write(self._witnessed(), math.inf))
        except KeyboardInterrupt:
            if self._writer is not None:
                self._writer.kill()
            console.print(f"No report. `skillwing report {shown(self._run_dir)}` writes it.", style="red")

    def _on_status(self, status: MissionStatus) -> None:
        if self._waiting is not None:
            self._waiting.cancel()
            self._start()
        if status.over:
            self._measure()
            self._flies_at, self._over_at = None, status.t
            self._waiting = self._bus.after(LAST_WORDS, self._start, wall=True)
        elif status.phase != "IDLE":
            if self._flies_at is None:
                self._begun = self._bus.wall()
            self._flies_at = status.t

    def _on_alive(self, key: str, alive: bool) -> None:
        """A mission that is gone without a word was killed, unless only the router is away, or its word is late."""
        self._present = alive
        if not alive and self._flies_at is not None:
            begun = self._begun
            self._bus.after(LATE_WORD, lambda: self._forget(begun), wall=True)
            self._bus.after(LAST_WORDS, self._miss, wall=True)

    def _forget(self, begun: float | None) -> None:
        """If a mission is there again, nobody can tell whether it is the same."""
        if self._begun == begun:
            self._begun = None

    def _miss(self) -> None:
        if not self._present and self._flies_at is not None:
            self._measure()
            self._flies_at, self._over_at = None, self._flies_at
            self._start()

    def _measure(self) -> None:
        self._wall_time = None if self._begun is None else self._bus.wall() - self._begun
        self._begun = None

    def _start(self) -> None:
        self._waiting = None
        before, witnessed, until = self._writing, self._witnessed(), self._over_at

        def write() -> None:
            if before is not None:
                before.join()
            text = self._write(witnessed, until)
            self._bus.post(lambda: self._tell(text, ""))

        self._writing = threading.Thread(target=write, name="report", daemon=True)
        self._writing.start()

    def _witnessed(self) -> bytes:
        return msgspec.json.encode(Witnessed(wall_time_s=self._wall_time, processes=tuple(map(_entry, self._states()))))

    def _write(self, witnessed: bytes, until: float) -> str:
        """Have the last mission reported that had begun by then, and what has no report yet; returns what to say."""
        words = ["report", str(self._run_dir), "--json", "--witnessed", "/dev/stdin", "--until", str(until)]
        self._writer = subprocess.Popen(
            [sys.executable, "-m", "skillwing.services.terminal.cli", *words],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            start_new_session=True,
        )
        out, error = self._writer.communicate(witnessed)
        if self._writer.returncode != OK:
            return f"There is no report of the mission. {error.decode(errors='replace').strip()}"
        return "\n".join(_sentence(each["report"], Path(each["folder"])) for each in json.loads(out))


def _sentence(report: dict[str, Any], folder: Path) -> str:
    return f"Mission {report['mission']}: {report['result']}. Its report is in {shown(folder)}."


def _entry(state: ProcessState) -> ProcessEntry:
    told = [state.last_words] if state.last_words else []
    told += (
        [f"It was started again {state.restarts} time{'s' if state.restarts > 1 else ''}."] if state.restarts else []
    )
    return ProcessEntry(name=state.name, state="died" if state.life == "given up" else "runs", detail=" ".join(told))
