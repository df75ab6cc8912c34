"""One flight of the m600 with a cut link: robot and station in namespaces of their own, every process real."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import msgspec
from link_cells import GRACE, LinkCell, LinkResult, Moment, Place
from namespaces import ROBOT_ADDRESS, TwoNamespaces
from robot_observer import Seen

OBSERVER = Path(__file__).with_name("robot_observer.py")
PORT = 7447
CLI = (sys.executable, "-m", "skillwing.services.terminal.cli")
MISSION = ("mission", "run", "mapping", "route=14,0,4")
UP = ("up", "--seed", "1", "--no-record")
STATION, WATCHER = "station", "watcher"
"""Names in the certificates of the operator's station, and of the observer on the robot."""
LOST, BACK = re.compile(r"has not answered since"), re.compile(r"answers again at")
TO_START, TO_THE_MOMENT, TO_THE_GROUND = 90.0, 180.0, 240.0
"""Wall seconds for the start of the robot, until the moment of the cut, and until the drone stands after it."""
LAST_WORDS = 40.0
"""Wall seconds that mission and command have for their ends after the landing."""
LOOK = 0.02
"""Wall seconds between two looks at the lines that have come."""


class Lines:
    """Lines of a process's output, each with the wall time at which it came. A thread reads them."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self.all: list[tuple[float, str]] = []
        self.process = process
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.all.append((time.monotonic(), line.rstrip()))

    @property
    def text(self) -> str:
        return "\n".join(line for _, line in self.all)

    def first(self, pattern: re.Pattern[str], since: float) -> tuple[float, str] | None:
        """The first line after a time that matches."""
        return next(((t, line) for t, line in list(self.all) if t >= since and pattern.search(line)), None)


class FlightError(Exception):
    """A flight that did not get to the moment of its cut."""


@dataclass(frozen=True)
class Site:
    """Address of the robot's router. options: of `up`. robot, station: environment of each side."""

    endpoint: str
    options: tuple[str, ...]
    robot: Mapping[str, str]
    station: Mapping[str, str]


def fly(cell: LinkCell, speed: float = 1.0, *, keys: bool = False) -> LinkResult:
    """Fly a cell. speed: robot seconds for each wall second. keys: over TLS, with certificates. Raises FlightError."""
    with tempfile.TemporaryDirectory(prefix="links-") as folder, TwoNamespaces() as spaces:
        site = _keyed_site(Path(folder)) if keys else _open_site(Path(folder))
        listen = ("--listen", site.endpoint, *site.options)
        up = (*CLI, *UP, *listen, "--speed", f"{speed:g}", "--run-dir", f"{folder}/run")
        with _running(spaces, spaces.robot, up, site.robot) as system:
            _wait(lambda: "Start a skill with" in system.text, TO_START, system)
            observer = (sys.executable, str(OBSERVER))
            with _running(spaces, spaces.robot, observer, site.robot) as seen:
                _wait(lambda: "{" in seen.text, TO_START, seen)
                with _running(spaces, spaces.station, (*CLI, *MISSION, *_words(cell.place)), site.station) as screen:
                    return msgspec.structs.replace(_cut_and_watch(cell, spaces, seen, screen), keys=keys)


def _open_site(folder: Path) -> Site:
    """A site without keys."""
    robot, station = (_environment(folder / side) for side in ("robot", "station"))
    endpoint = f"tcp/{ROBOT_ADDRESS}:{PORT}"
    return Site(endpoint, ("--insecure",), robot, station | {"SKILLWING_CONNECT": endpoint})


def _keyed_site(folder: Path) -> Site:
    """A site whose station is an operator. The observer on the robot may only read."""
    keys, bare, endpoint = folder / "keys", _open_site(folder), f"tls/{ROBOT_ADDRESS}:{PORT}"
    for words in (
        ("init", str(keys), "--robot", "m600", "--host", ROBOT_ADDRESS),
        ("add", STATION, "--role", "operator", "--keys", str(keys)),
        ("add", WATCHER, "--role", "viewer", "--keys", str(keys)),
    ):
        subprocess.run([*CLI, "keys", *words], capture_output=True, check=True)
    people = keys / "people"
    return Site(
        endpoint,
        ("--keys", str(keys)),
        {**bare.robot, "SKILLWING_KEYS": str(people / WATCHER)},
        {**bare.station, "SKILLWING_KEYS": str(people / STATION), "SKILLWING_CONNECT": endpoint},
    )


def _cut_and_watch(cell: LinkCell, spaces: TwoNamespaces, seen: Lines, screen: Lines) -> LinkResult:
    def now() -> Seen:
        line = next(line for _, line in reversed(seen.all) if line.startswith("{"))  # others are of its log
        return msgspec.json.decode(line, type=Seen)

    _wait(lambda: _is_at(cell.moment, now()), TO_THE_MOMENT, screen)
    since = time.monotonic()
    spaces.cut()
    if cell.seconds is not None:
        _until(lambda: False, cell.seconds - (time.monotonic() - since))
        spaces.heal()
    landed = time.monotonic() - since if _until(lambda: now().stands and not now().up, TO_THE_GROUND) else None
    _until(lambda: now().over, LAST_WORDS)
    ended = _until(lambda: screen.process.poll() is not None, LAST_WORDS if cell.heals else 0.0)
    told, again, state = screen.first(LOST, since), screen.first(BACK, since), now()
    return LinkResult(
        cell=cell,
        known=None if told is None else told[0] - since,
        screen="" if told is None else told[1],
        mission=state.mission or "it never began",
        heard=state.over,
        succeeded=state.succeeded and (screen.process.returncode == 0 if ended else not cell.heals),
        landed=landed,
        from_home=state.from_home,
        collisions=state.collisions,
        left_fence=state.left_fence,
        code=screen.process.returncode if ended else None,
        load=os.getloadavg()[0],
        back=None if again is None or cell.seconds is None else again[0] - since - cell.seconds,
    )


def _is_at(moment: Moment, seen: Seen) -> bool:
    match moment:
        case Moment.TAKE_OFF:
            return seen.up
        case Moment.CRUISE:
            return seen.away
        case Moment.RETURN:
            return "return_home" in seen.running
        case Moment.LANDING:
            return "land" in seen.running


def _words(place: Place) -> tuple[str, ...]:
    match place:
        case Place.ON_BOARD:
            return ("--on-board",)
        case Place.GROUND:
            return ("--owner-grace", "0")
        case Place.GROUND_WITH_GRACE:
            return ("--owner-grace", f"{GRACE:g}")


def _environment(runtime: Path) -> dict[str, str]:
    """Environment of one side: the other one's run state is not seen, and lines come at once."""
    runtime.mkdir(mode=0o700)
    return {"XDG_RUNTIME_DIR": str(runtime), "PYTHONUNBUFFERED": "1"}


@contextmanager
def _running(
    spaces: TwoNamespaces, namespace: str, command: tuple[str, ...], environment: Mapping[str, str]
) -> Iterator[Lines]:
    """A process that is ended in order, and else killed."""
    process = spaces.start(namespace, command, environment)
    try:
        yield Lines(process)
    finally:
        for number, patience in ((signal.SIGINT, 15.0), (signal.SIGKILL, 15.0)):
            if process.poll() is None:
                process.send_signal(number)
                try:
                    process.wait(patience)
                except subprocess.TimeoutExpired:
                    continue


def _until(done: Callable[[], bool], within: float) -> bool:
    deadline = time.monotonic() + within
    while not done():
        if time.monotonic() > deadline:
            return False
        time.sleep(LOOK)
    return True


def _wait(done: Callable[[], bool], within: float, of: Lines) -> None:
    """Wait for a condition. Raises FlightError with what the process has said."""
    if not _until(lambda: done() or of.process.poll() is not None, within) or not done():
        raise FlightError(f"It did not come to that within {within:g} s. {of.text}")
