"""Identities from folders of keys: of a process, of a person, and of the environment (SKILLWING_KEYS)."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from dataclasses import replace
from datetime import timedelta
from pathlib import Path

from skillwing.services.access.certificate_facts import ROUTER_NAME, CertificateFacts, utc_now
from skillwing.services.access.key_store import (
    NAMES_FILE,
    ROBOTS,
    ROUTER,
    KeyStore,
    ask_for_keys,
    process_folder,
    read_facts,
    read_whole,
)
from skillwing.services.access.policy import certificate_name, denial, refusal
from skillwing.services.bus.identity import CERTIFICATE_FILE, KEYS_VARIABLE, SessionIdentity, needs_identity
from skillwing.services.errors import KeysError
from skillwing.services.names import LAUNCHER
from skillwing.services.protocol import ErrorReply
from skillwing.services.wire.channel import PEOPLE, Role

NEEDED = timedelta(days=1)
"""Validity that each certificate of a robot has to have left at its start, and at that of a mission on board."""


def unknown_table() -> str:
    """The word for the table of a robot whose name alone is known, as in the help of `keys add-robot`."""
    return "ROBOT"


def read_identity(folder: Path, remedy: Callable[[], str] = ask_for_keys) -> SessionIdentity:
    """The identity in a folder with one certificate. remedy: as of `read_whole`. Raises KeysError."""
    found = read_whole(folder, remedy)
    role = Role(found.role) if found.role in PEOPLE else None
    return SessionIdentity(found.name, folder.absolute(), _refusals(role, found.name))


def _refusals(role: Role | None, name: str) -> Callable[[str], ErrorReply | None]:
    """The refusals of a person's own policy; none for a process, whose questions follow from its code."""
    if role is None:
        return lambda _: None
    return lambda key: refusal(role, name, key)


def process_identity(
    folder: Path, robot: str, process: str, table: Callable[[], str] = unknown_table
) -> SessionIdentity:
    """The identity of a process. folder: its own, its robot's, or that of a whole site.

    table: as of `require_certificates`. Raises KeysError, also for the certificate of somebody else.
    """

    is_site = (folder / NAMES_FILE).exists()

    def remedy() -> str:
        return f"Make it again: {add_robot_command(folder, robot, table)}." if is_site else ask_for_keys()

    for place in (folder, folder / process_folder(process), folder / ROBOTS / robot / process_folder(process)):
        if (place / CERTIFICATE_FILE).exists():
            return _required(read_identity(place, remedy), robot, process, remedy if is_site else None)
    advice = f"Make one: {add_robot_command(folder, robot, table)}."
    raise KeysError(f"There is no certificate for `{process}` of `{robot}` in {folder}. {advice}")


def _required(found: SessionIdentity, robot: str, process: str, remedy: Callable[[], str] | None) -> SessionIdentity:
    """An identity that has to be that of a process: under another name, the router would deny it all that it does.

    remedy: in the folder of a site; None for another folder.
    """
    name = certificate_name(robot, process)
    if found.name == name:
        return found
    text = f"The certificate in {found.folder} is that of `{found.name}`, and `{process}` of `{robot}` needs `{name}`."
    if remedy is None:
        raise KeysError(f"{text} Give the folder of the site, DIR, or that of the robot, DIR/{ROBOTS}/{robot}.")
    raise KeysError(f"{text} {remedy()}")


def add_robot_command(folder: Path, robot: str, table: Callable[[], str]) -> str:
    """The command that makes the certificates of a robot, or renews them. folder: of the site."""
    words = table()
    name = "" if words.split()[0] == robot else f" --robot-name {robot}"
    return f"`skillwing keys add-robot {words}{name} --keys {folder}`"


def robot_certificates(
    folder: Path, robot: str, processes: Iterable[str], table: Callable[[], str] = unknown_table
) -> list[CertificateFacts]:
    """The certificates of a robot's processes, of its launcher, and of a router in the folder. Raises KeysError."""
    used = [process_identity(folder, robot, process, table).folder for process in (*processes, LAUNCHER)]
    known = [read_facts(place) for place in used]
    if (folder / ROUTER / CERTIFICATE_FILE).exists():
        known.append(read_facts(folder / ROUTER, lambda: remake(folder)))
    return known


def require_certificates(
    folder: Path, robot: str, processes: Iterable[str], table: Callable[[], str] = unknown_table
) -> None:
    """Raise KeysError if a process of a robot, or its launcher, has no certificate that lasts for `NEEDED`.

    table: such as `table_words`, which imports each installed robot; called for the remedy only.

    The router ends links whose certificate has expired, which must not happen while the robot moves.
    """
    if not folder.is_dir():
        raise KeysError(f"There is no folder {folder}. Make keys with `skillwing keys init`, or name another folder.")
    for found in robot_certificates(folder, robot, processes, table):
        _require_lasting(found, lambda: add_robot_command(folder, robot, table))


def require_router_certificate(folder: Path) -> None:
    """Raise KeysError if the certificate of the router in the folder of a site does not last for `NEEDED`."""
    store = KeyStore(folder)
    store.names()  # a folder without keys has its own message
    _require_lasting(read_whole(store.router_folder, lambda: remake(folder)), lambda: renewal_command(folder))


def renewal_command(folder: Path) -> str:
    """The command that renews the certificates of any robot of a site, and of its router."""
    return add_robot_command(folder, unknown_table(), unknown_table)


def remake(folder: Path) -> str:
    """The remedy for files of the router that are missing in the folder of a site."""
    return f"Make it again: {renewal_command(folder)}."


def _require_lasting(found: CertificateFacts, command: Callable[[], str]) -> None:
    if found.expires - utc_now() < NEEDED:
        text = f"The certificate `{found.name}` is valid until {found.expires:%Y-%m-%d %H:%M} UTC."
        raise KeysError(f"{text} Renew it before a start: {command()}.")


def ending_soon(identity: SessionIdentity | None) -> str:
    """Sentences about a person's certificate that does not last for `NEEDED`; empty for one that does, and for none."""
    if identity is None or (end := read_facts(identity.folder).expires) - utc_now() >= NEEDED:
        return ""
    text = (
        f"Your certificate `{identity.name}` ends on {end:%Y-%m-%d at %H:%M} UTC. Then your link to the robot breaks."
    )
    return f"{text} Ask for new keys."


def person_identity(endpoint: str) -> SessionIdentity | None:
    """The identity in SKILLWING_KEYS for a router that asks for one; None for a router that does not.

    Raises KeysError without a usable folder.
    """
    if not needs_identity(endpoint):
        return None
    folder = os.environ.get(KEYS_VARIABLE)
    if not folder:
        text = f"The router at {endpoint} asks for a key. Name the folder that you were given: {KEYS_VARIABLE}=FOLDER."
        raise KeysError(text)
    if not (Path(folder) / CERTIFICATE_FILE).exists():
        what = "holds no certificate" if Path(folder).is_dir() else "is no folder"
        text = f"{folder} in {KEYS_VARIABLE} {what}. Name the folder of one person, as in DIR/people/NAME."
        raise KeysError(text)
    found = read_identity(Path(folder))
    if found.name == ROUTER_NAME:
        text = f"{folder} in {KEYS_VARIABLE} has the certificate of the router. Name the folder of one person,"
        raise KeysError(f"{text} as in DIR/people/NAME.")
    return replace(found, denial=lambda role, key: denial(role, found.name, key))
