"""`skillwing keys`: certificates for a router, its robots, and people."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from skillwing.services.access.certificate_facts import utc_now
from skillwing.services.access.key_store import KeyStore
from skillwing.services.access.robots import robot_access
from skillwing.services.access.site_names import DAYS
from skillwing.services.errors import InvalidOptionError
from skillwing.services.robot import Robot, find_robot
from skillwing.services.terminal.completion import robots
from skillwing.services.terminal.output import make_console, print_json
from skillwing.services.terminal.system_options import require_robot_name
from skillwing.services.wire.channel import Role

RESTART = "The router knows it after its next start."
EARLIER = (
    "Earlier keys of `{name}` stay valid, with this role. "
    "If they were lost: `skillwing keys remove {name}`, and add another name."
)
keys = typer.Typer(
    no_args_is_help=True,
    help="Make, list and take back certificates, without which nobody can reach a robot from elsewhere.",
)
DirOption = Annotated[Path, typer.Option("--keys", metavar="DIR", help="Folder of the keys.")]
SkillsetOption = Annotated[
    Path | None, typer.Option("--skillset", metavar="FILE", help="For a robot of mocks: its skillset.")
]
RobotNameOption = Annotated[
    str | None, typer.Option("--robot-name", metavar="NAME", help="Name of this robot, as in `up --robot-name`.")
]
WithOption = Annotated[
    list[str] | None,
    typer.Option(
        "--with",
        metavar="NAME",
        help="Other robot at which missions of this one work; repeatable.",
    ),
]
FOLDER = Path("keys")


class PersonRole(StrEnum):
    """Role that a person or station can have: one of `PEOPLE`."""

    VIEWER = Role.VIEWER.value
    CLIENT = Role.CLIENT.value
    OPERATOR = Role.OPERATOR.value


@keys.command()
def init(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="New folder.")] = FOLDER,
    robot: Annotated[
        str, typer.Option("--robot", "-r", metavar="NAME", help="Robot, as for `up`.", autocompletion=robots)
    ] = "m600",
    host: Annotated[
        list[str] | None, typer.Option("--host", metavar="HOST", help="Name or address of the router; repeatable.")
    ] = None,
    skillset: SkillsetOption = None,
    robot_name: RobotNameOption = None,
    beside: WithOption = None,
    days: Annotated[int, typer.Option(metavar="N", min=2, max=3650, help="Validity of certificates.")] = DAYS,
) -> None:
    """Make an authority, a certificate for the router, and one for each process of a robot.

    The folder stays on a machine that you trust. Who reads `DIR/authority/key.pem` can let in anybody.

    Exit codes: 0 made, 2 unknown robot, or a folder that has keys already.
    """
    table = _table(robot, skillset, robot_name)
    store = KeyStore.init(folder, host or (), days)
    store.add_robot(robot_access(table, _others(table, beside)))
    count = len(store.names().robots[table.name].processes)
    typer.echo(f"{folder} has an authority, and keys for a router and {count} processes of {table.name}.")
    typer.echo(f"Let somebody in: `skillwing keys add NAME --role operator --keys {folder}`.")


@keys.command()
def prepare(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder, new or not.")] = FOLDER,
    robot: Annotated[
        list[str] | None,
        typer.Option("--robot", "-r", metavar="NAME", help="Robot, as for `up`; repeatable.", autocompletion=robots),
    ] = None,
    host: Annotated[
        list[str] | None, typer.Option("--host", metavar="HOST", help="Name or address of the router; repeatable.")
    ] = None,
    operator: Annotated[
        list[str] | None,
        typer.Option("--operator", metavar="NAME", help="Person or station; a known one keeps its role. Repeatable."),
    ] = None,
) -> None:
    """Make what is missing in a folder of keys, and renew what ends within 30 days.

    For scripts and containers, which call it at every start. What is there already, and lasts, is not changed.

    Exit codes: 0 ready, 2 unknown robot, or a name that cannot be one.
    """
    tables = [find_robot(name) for name in robot or ()]
    names = KeyStore.prepare(folder, host or (), map(robot_access, tables), operator or ()).names()
    typer.echo(f"{folder} has keys of {', '.join((*names.robots, *names.people))}. Router: {', '.join(names.hosts)}.")


@keys.command()
def add_robot(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="Robot, as for `up`.", autocompletion=robots)],
    folder: DirOption = FOLDER,
    skillset: SkillsetOption = None,
    robot_name: RobotNameOption = None,
    beside: WithOption = None,
) -> None:
    """Make keys for one more robot at the same router, or for new processes of a known one.

    With --with its processes may also read the other robot, and its missions and shared processes, such as a simulator,
    may act there. See docs/keys.md.

    Exit codes: 0 made, 2 unknown robot, or a folder without keys.
    """
    table = _table(robot, skillset, robot_name)
    KeyStore(folder).add_robot(robot_access(table, _others(table, beside)))
    typer.echo(f"{folder} has keys for {table.name}. {RESTART}")


@keys.command()
def add(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Person or station.")],
    role: Annotated[
        PersonRole,
        typer.Option(metavar="viewer|client|operator", help="viewer reads, client commands, operator does all."),
    ],
    folder: DirOption = FOLDER,
    days: Annotated[int | None, typer.Option(metavar="N", min=1, max=3650, help="Validity.")] = None,
) -> None:
    """Make the keys of a person or station: a folder to hand over. For a known name they are made again.

    Earlier keys of that name stay valid. For keys that were lost, remove the name and add another one.

    Exit codes: 0 made, 2 no such role, a name that cannot be one or was removed, or a folder without keys.
    """
    store = KeyStore(folder)
    known = name in store.names().people
    place = store.add_person(name, Role(role), days)
    typer.echo(f"Give {place} to {name}, by a safe way. There: `export SKILLWING_KEYS={name}`.")
    typer.echo(f"On this machine: `export SKILLWING_KEYS={place}`. {RESTART}")
    if known:
        typer.echo(EARLIER.format(name=name), err=True)


@keys.command()
def remove(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Person, station or robot.")], folder: DirOption = FOLDER
) -> None:
    """Take a name back. The router denies it everything after its next start, whatever certificate it shows.

    The name cannot be given again, since the router tells certificates apart by their names alone.

    Exit codes: 0 removed, 2 unknown name, or a folder without keys.
    """
    store = KeyStore(folder)
    is_robot = name in store.names().robots
    store.remove(name)
    if is_robot:
        typer.echo(f"`{name}` is a robot. After the next start of the router, none of its processes can connect.")
    typer.echo(f"{name} is removed. Restart the router now: until then the old rules hold.")
    typer.echo(f"`{name}` cannot be given again, or its old certificates would be let in. Later, choose another name.")


@keys.command(name="list")
def list_(
    folder: DirOption = FOLDER, as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False
) -> None:
    """Show all names, their roles, and how long their certificates are valid.

    Exit codes: 0 shown, 2 a folder without keys.
    """
    now = utc_now()
    holders = [(each.name, each.what, each.expires) for each in KeyStore(folder).holders()]
    if as_json:
        ends = [(name, what, end and end.isoformat()) for name, what, end in holders]
        print_json([{"name": name, "role": what, "expires": end} for name, what, end in ends])
        return
    table = Table("name", "role", "valid until")
    for name, what, end in holders:
        table.add_row(name, what, _until(end, now))
    make_console().print(table)


def _until(end: datetime | None, now: datetime) -> str:
    if end is None:
        return "damaged: make it again"
    return f"{end:%Y-%m-%d} ({(end - now).days} days)" if end > now else f"expired {end:%Y-%m-%d}"


def _others(table: Robot, names: list[str] | None) -> list[str]:
    """The other robots of `--with`. They may get their keys later. Raises InvalidOptionError."""
    for name in names or ():
        require_robot_name(name)
        if name == table.name:
            raise InvalidOptionError("with", f"Robot `{name}` works at itself. Name other robots by --with.")
    return names or []


def _table(robot: str, skillset: Path | None, name: str | None) -> Robot:
    """The robot of these options, under its name."""
    if name is not None:
        require_robot_name(name)
    if skillset is not None:
        return Robot(name=name or skillset.stem, skillset=skillset.absolute(), hooks={}, clock="wall")
    found = find_robot(robot)
    return found if name is None else replace(found, name=name)
