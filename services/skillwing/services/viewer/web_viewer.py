"""The web viewer as a process of its own, for a system without a terminal: containers.

When every process of the robot is up, the last line of this process's log is the address for a browser.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Collection
from typing import Any

import msgspec

from skillwing.services.bus import Bus
from skillwing.services.errors import InvalidOptionError, PassingError
from skillwing.services.protocol import Keys
from skillwing.services.robot import find_robot
from skillwing.services.viewer.viewer import (
    LOOPBACK,
    PAGE_PORT,
    STREAM_PORT,
    answers,
    page_address,
    required_program,
    stop,
    web_options,
)

PERIOD = 1.0
"""Seconds between two checks of the processes, so that their first log lines come before the address."""
PATIENCE = 60.0
"""Seconds after which the address is printed although processes are missing."""


class WebViewerOptions(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Options of the viewer. robot: owner of the awaited processes. bind: interface to listen at.

    page, stream: `HOST:PORT` at which browsers reach the ports 9090 and 9876 of this process, which may be forwarded.
    """

    robot: str
    bind: str = LOOPBACK
    page: str = f"{LOOPBACK}:{PAGE_PORT}"
    stream: str = f"{LOOPBACK}:{STREAM_PORT}"


class StartupNotice:
    """Lines on a system that comes up. Pure: callers pass the running processes and the time.

    robot: its name. awaited: its processes. address: for a browser. now: begin of the wait, in seconds.
    """

    def __init__(self, robot: str, awaited: Collection[str], address: str, now: float) -> None:
        self._robot = robot
        self._awaited = frozenset(awaited)
        self._address = address
        self._since = now
        self.complete = False
        self._impatient = False

    def lines(self, running: Collection[str], now: float) -> list[str]:
        """Lines to print now: once for a complete system, and before that at most once for missing processes."""
        missing = sorted(self._awaited.difference(running))
        if self.complete or (missing and (self._impatient or now - self._since < PATIENCE)):
            return []
        if missing:
            self._impatient = True
            text = f"{self._robot}: {len(missing)} of {len(self._awaited)} processes have not come up: "
            return [text + ", ".join(missing) + ". Look at their logs.", f"Open {self._address}"]
        self.complete = True
        return [f"{self._robot}: all {len(self._awaited)} processes run.", f"Open {self._address}"]


class WebViewer:
    """The node. Node and viewer program end together."""

    name = "viewer"
    owns_clock = False

    def __init__(self, options: WebViewerOptions, program: str) -> None:
        self._options = options
        self._program = program
        self._running: set[str] = set()

    def attach(self, bus: Bus) -> None:
        self._bus = bus
        robot = find_robot(self._options.robot)
        # Only names count here. With a run directory they include the recorder.
        run = {"run_dir": "."}
        specs = (*robot.functional_layer(run), *robot.managers(run), *robot.observers(run))
        address = page_address(self._options.page, self._options.stream)
        self._notice = StartupNotice(robot.name, [spec.name for spec in specs], address, bus.wall())
        keys = Keys(robot.skillset.stem)
        self._prefix = keys.alive("")
        bus.watch_alive(keys.alive("**"), self._on_alive)
        bus.every(PERIOD, self._check)
        # Last, because a node whose `attach` fails is never detached.
        self._viewer = subprocess.Popen(
            [self._program, "--bind", self._options.bind, "--port", str(STREAM_PORT), *web_options(PAGE_PORT)],
            stdin=subprocess.DEVNULL,
            # Without this it logs addresses that do not exist outside of a container.
            env={"RUST_LOG": "warn", **os.environ},
        )

    def detach(self) -> None:
        stop(self._viewer)

    def _on_alive(self, key: str, alive: bool) -> None:
        name = key.removeprefix(self._prefix)
        (self._running.add if alive else self._running.discard)(name)

    def _check(self) -> None:
        code = self._viewer.poll()
        if code is not None:
            raise PassingError(f"The viewer has ended by itself, with exit code {code}. Another try may succeed.")
        if not self._notice.complete and answers(STREAM_PORT, PERIOD) and answers(PAGE_PORT, PERIOD):
            for line in self._notice.lines(self._running, self._bus.wall()):
                sys.stdout.write(f"{line}\n")
            sys.stdout.flush()


def make_web_viewer(options: dict[str, Any]) -> WebViewer:
    """The viewer described by `WebViewerOptions`. Raises InvalidOptionError, also without Rerun."""
    try:
        checked = msgspec.convert(options, WebViewerOptions)
    except msgspec.ValidationError as error:
        known = ", ".join(WebViewerOptions.__struct_fields__)
        sentence = f"These options do not fit a viewer: {error}. Its options: {known}."
        raise InvalidOptionError("viewer", sentence) from error
    return WebViewer(checked, required_program())
