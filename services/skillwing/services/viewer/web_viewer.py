"""The web viewer as a process of its own, for systems that nobody starts at a terminal: containers.

Who runs such a system wants to know where to look, and when. So once every process of the robot is there, the last line
of this one's log is the address.
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
"""Seconds between two looks at who is there. What a process logs when it has come up comes before the next look."""
PATIENCE = 60.0
"""Seconds after which the address is told although somebody is missing."""


class WebViewerOptions(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """robot: whose processes are awaited. bind: the interface to listen at. page, stream: `HOST:PORT` where browsers
    reach the ports 9090 and 9876 of this process, which may be behind others."""

    robot: str
    bind: str = LOOPBACK
    page: str = f"{LOOPBACK}:{PAGE_PORT}"
    stream: str = f"{LOOPBACK}:{STREAM_PORT}"


class Welcome:
    """What is told of a system that comes up, and when. Pure: it is told who is there, and what time it is.

    robot: its name. awaited: its processes. address: what to open. now: when the wait begins, in seconds.
    """

    def __init__(self, robot: str, awaited: Collection[str], address: str, now: float) -> None:
        self._robot = robot
        self._awaited = frozenset(awaited)
        self._address = address
        self._since = now
        self.complete = False
        self._impatient = False

    def look(self, here: Collection[str], now: float) -> list[str]:
        """Lines to tell now: once that everybody is there, and before that at most once who is missing."""
        missing = sorted(self._awaited.difference(here))
        if self.complete or (missing and (self._impatient or now - self._since < PATIENCE)):
            return []
        if missing:
            self._impatient = True
            told = f"{self._robot}: {len(missing)} of {len(self._awaited)} processes have not come up: "
            return [told + ", ".join(missing) + ". Their logs tell why.", f"Open {self._address}"]
        self.complete = True
        return [f"{self._robot}: all {len(self._awaited)} processes run.", f"Open {self._address}"]


class WebViewer:
    """The node. It ends with the viewer's program, and the program with it."""

    name = "viewer"
    owns_clock = False

    def __init__(self, options: WebViewerOptions, program: str) -> None:
        self._options = options
        self._program = program
        self._here: set[str] = set()

    def attach(self, bus: Bus) -> None:
        self._bus = bus
        robot = find_robot(self._options.robot)
        # Only names count here; a recorder is among them wherever there is a place to record to.
        run = {"run_dir": "."}
        specs = (*robot.functional_layer(run), *robot.managers(run), *robot.observers(run))
        address = page_address(self._options.page, self._options.stream)
        self._welcome = Welcome(robot.name, [spec.name for spec in specs], address, bus.wall())
        keys = Keys(robot.skillset.stem)
        self._prefix = keys.alive("")
        bus.watch_alive(keys.alive("**"), self._on_alive)
        bus.every(PERIOD, self._look)
        # Last: nobody detaches a node that could not be attached.
        self._viewer = subprocess.Popen(
            [self._program, "--bind", self._options.bind, "--port", str(STREAM_PORT), *web_options(PAGE_PORT)],
            stdin=subprocess.DEVNULL,
            # It would tell other addresses, which nobody outside of a container can open.
            env={"RUST_LOG": "warn", **os.environ},
        )

    def detach(self) -> None:
        stop(self._viewer)

    def _on_alive(self, key: str, alive: bool) -> None:
        name = key.removeprefix(self._prefix)
        (self._here.add if alive else self._here.discard)(name)

    def _look(self) -> None:
        code = self._viewer.poll()
        if code is not None:
            raise PassingError(f"The viewer has ended by itself, with exit code {code}. It may do better next time.")
        if not self._welcome.complete and answers(STREAM_PORT, PERIOD) and answers(PAGE_PORT, PERIOD):
            for line in self._welcome.look(self._here, self._bus.wall()):
                sys.stdout.write(f"{line}\n")
            sys.stdout.flush()


def make_web_viewer(options: dict[str, Any]) -> WebViewer:
    """The viewer described by `WebViewerOptions`. Raises InvalidOptionError, also where Rerun is not installed."""
    try:
        checked = msgspec.convert(options, WebViewerOptions)
    except msgspec.ValidationError as error:
        known = ", ".join(WebViewerOptions.__struct_fields__)
        sentence = f"These options do not fit a viewer: {error}. It knows {known}."
        raise InvalidOptionError("viewer", sentence) from error
    return WebViewer(checked, required_program())
