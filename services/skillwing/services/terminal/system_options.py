"""Options of the commands that run a system: `up`, `mock` and `demo`."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, TypeAlias

import typer

from skillwing.services.access.exposure import require_address, require_protected
from skillwing.services.bus import Topology
from skillwing.services.bus.identity import needs_identity
from skillwing.services.errors import InvalidOptionError
from skillwing.services.processes.router import LOOPBACK, LOOPBACK_WITH_KEYS
from skillwing.services.processes.run_options import MAX_SPEED, keep, speed
from skillwing.services.recording.retention import KEEP
from skillwing.services.robot import ClockKind
from skillwing.services.sizes import size_words
from skillwing.services.viewer.viewer import ViewerKind

DetachOption = Annotated[bool, typer.Option("--detach", "-d", help="Return once it runs; `down` stops it.")]
ListenOption = Annotated[
    str, typer.Option("--listen", metavar="tcp/HOST:PORT", help="Address of the router; with --keys tls/HOST:PORT.")
]
KeysOption = Annotated[
    Path | None,
    typer.Option("--keys", metavar="DIR", help="Let in holders of certificates only: folder of `skillwing keys init`."),
]
InsecureOption = Annotated[
    bool, typer.Option("--insecure", help="Listen beyond this machine without keys: everybody may command.")
]


def read_run_dir(text: str | Path) -> Path:
    """A directory for a run. Raises BadParameter for an empty name, as of a variable without a value."""
    if not str(text):
        raise typer.BadParameter("A run directory without a name. Name one, or leave the option out.")
    return Path(text)


RunDirOption: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        "--run-dir",
        metavar="DIR",
        parser=read_run_dir,
        help="Directory for logs; default runs/TIME.",
        show_default=False,
    ),
]
TopologyOption = Annotated[
    Topology,
    typer.Option(
        "--topology",
        help="Processes meet at the router, or each connects to each, for the lowest latency on one host.",
    ),
]
ColocateOption = Annotated[
    bool, typer.Option("--colocate", help="All managers but the resource manager in one process, for small machines.")
]
RouterOption = Annotated[
    str | None,
    typer.Option("--router", metavar="tcp/HOST:PORT", help="Use the router of a system that runs; start none."),
]
RobotNameOption = Annotated[
    str | None, typer.Option("--robot-name", metavar="NAME", help="Name of this robot, if others run here.")
]
ResumeOption = Annotated[bool, typer.Option("--resume", help="Continue from the journal in --run-dir.")]
DurableOption = Annotated[
    bool, typer.Option("--durable", help="Keep the journal safe from power loss: an fsync for each change.")
]
RecordOption = Annotated[
    bool, typer.Option("--record/--no-record", help="Record the run, and write a report of each mission.")
]


def read_keep(text: str | int) -> int:
    """Bytes that the files of a run may have. Raises BadParameter."""
    try:
        return text if isinstance(text, int) else keep(text)
    except ValueError as error:
        raise typer.BadParameter(f"`{text}` is no size of a run: {error}.") from error


KeepOption: TypeAlias = Annotated[
    int,
    typer.Option(
        "--keep",
        metavar="SIZE",
        parser=read_keep,
        help="Size that the files of the run may have, such as 10GB; older parts are deleted.",
    ),
]
VIEWER_HELP = "Show the run in the Rerun viewer: in its window, or in a browser."
ViewerOption = Annotated[ViewerKind, typer.Option("--viewer", help=VIEWER_HELP)]


def read_speed(text: str | float) -> float:
    """Robot seconds per second, 0 for as fast as possible. Raises BadParameter."""
    try:
        return speed(text)
    except ValueError as error:
        raise typer.BadParameter(f"`{text}` is no speed: {error}.") from error


SpeedOption: TypeAlias = Annotated[
    float,
    typer.Option(
        "--speed",
        metavar="FACTOR|max",
        parser=read_speed,
        help="Robot seconds per second; max is the highest speed at which no process falls behind.",
    ),
]


def speed_word(factor: float) -> str:
    """A speed in the form that `read_speed` accepts."""
    return str(factor) if factor > 0.0 else MAX_SPEED


def require_robot_name(name: str) -> None:
    """Raise InvalidOptionError for a name that cannot be a part of keys and file names."""
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_-]*", name):
        raise InvalidOptionError("robot-name", f"A robot cannot be called `{name}`. Use letters, digits, `_` and `-`.")


@dataclass(frozen=True, kw_only=True)
class RunSettings:
    """Settings of a run. clock: owner of robot time. listen: address of the own router. mock: nothing in it is real.

    topology: way in which processes meet. colocate: managers share a process. router: address of another system's
    router. mission_context: facts about the site for missions, by mission. resume, durable: of the journal.
    record: the run is recorded, with these options. keep: bytes that its files may have. viewer: way to show it. keys:
    folder with certificates, None for none. insecure: strangers may reach a router without keys.
    """

    clock: ClockKind
    listen: str
    mock: bool
    topology: Topology = "router"
    colocate: bool = False
    router: str | None = None
    mission_context: dict[str, dict[str, Any]] = field(default_factory=dict[str, dict[str, Any]])
    resume: bool = False
    durable: bool = False
    record: bool = False
    keep: int = KEEP
    options: dict[str, Any] = field(default_factory=dict[str, Any])
    viewer: ViewerKind = "none"
    keys: Path | None = None
    insecure: bool = False

    def __post_init__(self) -> None:
        if self.keys is not None and self.listen == LOOPBACK:
            object.__setattr__(self, "listen", LOOPBACK_WITH_KEYS)
        if self.keys is not None and self.topology == "mesh":
            text = "Peers of a mesh would get round the router's rules. With keys, leave out `--topology mesh`."
            raise InvalidOptionError("topology", text)
        self._check_router()
        if self.viewer != "none" and not self.record:
            raise InvalidOptionError("viewer", "A viewer shows what is recorded. Leave out `--no-record`.")

    def _check_router(self) -> None:
        if self.router is None:
            require_protected(self.listen, self.keys, insecure=self.insecure)
            return
        if self.listen not in (LOOPBACK, LOOPBACK_WITH_KEYS):
            text = "The router of another system has its address already. Leave out `--listen`."
            raise InvalidOptionError("listen", text)
        require_address(self.router, "router")
        if needs_identity(self.router) != (self.keys is not None):
            text = f"The address {self.router} is one without keys. Write tls/HOST:PORT, or leave out --keys."
            if self.keys is None:
                text = f"The router at {self.router} asks for keys. Name their folder with --keys DIR."
            raise InvalidOptionError("keys", text)

    def words(self) -> list[str]:
        """The options of a command line that give the same settings."""
        words = ["--listen", self.listen, "--topology", self.topology, "--viewer", self.viewer]
        words += ["--keep", size_words(self.keep)]
        words += [] if self.router is None else ["--router", self.router]
        words += [] if self.keys is None else ["--keys", str(self.keys.absolute())]
        flags = {
            "--colocate": self.colocate,
            "--resume": self.resume,
            "--durable": self.durable,
            "--no-record": not self.record,
            "--insecure": self.insecure,
        }
        return [*words, *(flag for flag, given in flags.items() if given)]
