"""The folder of a site's keys: its authority, and certificates for its router, robots and people.

    DIR/names.json                     hosts, robots with their processes, people with their roles
    DIR/authority/  DIR/router/        certificate.pem, key.pem; the router's with authority.pem
    DIR/robots/ROBOT/PROCESS/          the same three files for each process
    DIR/people/NAME/                   the same for each person and station: the folder to hand over

The router reads names.json at its start. A name that is missing there is denied, whatever certificate it shows.
"""

from __future__ import annotations

import fcntl
import os
import shutil
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path

import msgspec

from skillwing.services.access.certificate_facts import ROUTER_NAME, CertificateFacts, Issued, utc_now
from skillwing.services.access.policy import RobotAccess, SiteAccess, certificate_name
from skillwing.services.access.site_names import DAYS, Names, require_hosts
from skillwing.services.bus.identity import AUTHORITY_FILE, CERTIFICATE_FILE, KEY_FILE
from skillwing.services.errors import KeysError
from skillwing.services.wire.channel import Role

RENEWAL = timedelta(days=30)
"""Time before the end of a certificate's validity from which on it is renewed."""
AUTHORITY, ROUTER, ROBOTS, PEOPLE_FOLDER = "authority", "router", "robots", "people"
NAMES_FILE = "names.json"
FILES = (CERTIFICATE_FILE, KEY_FILE, AUTHORITY_FILE)
REREADS = 3
REREAD_PAUSE = 0.2
"""Wall seconds between two readings of files that do not fit."""
ALWAYS = ("localhost", "127.0.0.1", "::1")
"""Hosts at which every router is found on its own machine."""


@dataclass(frozen=True, slots=True)
class KeyHolder:
    """A certificate that was issued. what: `router`, a robot's process, or the role of a person.

    expires: None for a certificate that cannot be read.
    """

    name: str
    what: str
    expires: datetime | None
    folder: Path


class KeyStore:
    """A folder of keys. Its files are for the owner of the folder alone (mode 600)."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    @classmethod
    def init(cls, folder: Path, hosts: Iterable[str], days: int = DAYS) -> KeyStore:
        """Make an authority and a certificate for a router. Raises KeysError for a folder that has keys already, and
        InvalidOptionError for a malformed host."""
        store = cls(folder)
        if not store._made(tuple(hosts), days):
            raise KeysError(f"{folder} holds keys already. Use `skillwing keys add-robot` or `add`, or another folder.")
        return store

    @classmethod
    def prepare(
        cls, folder: Path, hosts: Iterable[str], robots: Iterable[RobotAccess], operators: Iterable[str]
    ) -> KeyStore:
        """The folder with all that is named: missing keys are made, and those that end soon are renewed.

        operators: they become operators, unless they are known already, in any role.
        Repeated calls change nothing else. Raises KeysError and InvalidOptionError as the other methods do.
        """
        store, hosts = cls(folder), tuple(hosts)
        if not store._made(hosts, DAYS):
            store.add_hosts(hosts)
        for robot in robots:
            store.add_robot(robot)
        for name in operators:
            role = store.names().people.get(name)
            if role is None or not store._lasts(f"{PEOPLE_FOLDER}/{name}", name):
                store.add_person(name, role or Role.OPERATOR)
        return store

    @property
    def router_folder(self) -> Path:
        """Folder of the router's certificate."""
        return self.folder / ROUTER

    def robot_folder(self, robot: str) -> Path:
        """Folder of a robot's processes. Raises KeysError for a robot without keys."""
        if robot not in self.names().robots:
            raise KeysError(f"{self.folder} has no keys of `{robot}`. Make them: `skillwing keys add-robot {robot}`.")
        return self.folder / ROBOTS / robot

    def names(self) -> Names:
        """All known names. Raises KeysError for a folder without keys."""
        path = self.folder / NAMES_FILE
        try:
            return msgspec.json.decode(path.read_bytes(), type=Names)
        except FileNotFoundError as error:
            text = (
                f"{self.folder} holds no keys of a site. Make some with `skillwing keys init`, or name another folder."
            )
            raise KeysError(text) from error
        except (OSError, msgspec.DecodeError) as error:
            raise KeysError(f"{path} cannot be read: {error}. Restore it, or make new keys.") from error

    def site(self) -> SiteAccess:
        """The facts that the policy follows from."""
        return self.names().site()

    def add_hosts(self, hosts: Iterable[str]) -> None:
        """Name further hosts at which the router is reached. Its certificate is issued again if one of them is new.

        Raises InvalidOptionError for a malformed one.
        """
        with self._changing() as names:
            every = tuple(dict.fromkeys((*names.hosts, *hosts)))
            if every != names.hosts:
                require_hosts(every)
                self._issue(ROUTER, ROUTER_NAME, ROUTER, names.days, every)
                self._save(msgspec.structs.replace(names, hosts=every))

    def add_robot(self, robot: RobotAccess) -> None:
        """Issue a certificate for each process of a robot that lacks a lasting one, and take in its present processes.

        The robots at which it works are added to those that are known. The router's certificate is renewed as well, if
        it ends soon. Raises InvalidOptionError for the name of a person, or one that was removed.
        """
        with self._changing() as names:
            named = names.with_robot(robot)
            for process, role in robot.processes.items():
                name = certificate_name(robot.name, process)
                place = f"{ROBOTS}/{robot.name}/{process_folder(process)}"
                if not self._lasts(place, name):
                    self._issue(place, name, str(role), names.days)
            if not self._lasts(ROUTER, ROUTER_NAME):
                self._issue(ROUTER, ROUTER_NAME, ROUTER, names.days, names.hosts)
            self._save(named)

    def add_person(self, name: str, role: Role, days: int | None = None) -> Path:
        """Issue a certificate for a person or station, again for a known name; returns the folder to hand over.

        Raises InvalidOptionError for a name that cannot be one, that of a robot, or one that was removed.
        """
        place = f"{PEOPLE_FOLDER}/{name}"
        with self._changing() as names:
            named = names.with_person(name, role)
            self._issue(place, name, str(role), days or names.days)
            self._save(named)
        return self.folder / place

    def remove(self, name: str) -> None:
        """Forget a person or a robot: after the router's next start its certificates are denied, for good.

        Raises KeysError for an unknown name.
        """
        with self._changing() as names:
            if name not in names.people and name not in names.robots:
                known = ", ".join((*names.people, *names.robots)) or "nobody"
                text = f"`{name}` is no person and no robot in {self.folder}. Known: {known}."
                robot = name.partition(".")[0]
                raise KeysError(f"{text} Remove `{robot}` as a whole." if robot in names.robots else text)
            self._save(names.without(name))
            for place in (PEOPLE_FOLDER, ROBOTS):
                shutil.rmtree(self.folder / place / name, ignore_errors=True)

    def _made(self, hosts: tuple[str, ...], days: int) -> bool:
        """Make the authority, the router's certificate and the names. Returns False for a folder that has keys."""
        from skillwing.services.access.certificates import new_authority  # noqa: PLC0415 - as in `_facts`

        require_hosts(hosts)
        self.folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        with self._locked():
            if (self.folder / NAMES_FILE).exists():
                return False
            self._write(AUTHORITY, new_authority(10 * days, utc_now()), authority=None)
            names = Names(hosts=tuple(dict.fromkeys((*hosts, *ALWAYS))), days=days)
            self._issue(ROUTER, ROUTER_NAME, ROUTER, names.days, names.hosts)
            self._save(names)
        return True

    @contextmanager
    def _changing(self) -> Iterator[Names]:
        """The names, which nobody else changes meanwhile: a lost change could let in somebody who was removed."""
        self.names()  # a folder without keys has its own message
        with self._locked():
            yield self.names()

    @contextmanager
    def _locked(self) -> Iterator[None]:
        """The folder, in which no other command writes meanwhile."""
        folder = os.open(self.folder, os.O_RDONLY)
        try:
            fcntl.flock(folder, fcntl.LOCK_EX)
            yield
        finally:
            os.close(folder)

    def holders(self) -> Iterator[KeyHolder]:
        """Every certificate that was issued and is known, with the end of its validity."""
        names = self.names()
        yield self._holder(ROUTER, ROUTER, ROUTER_NAME)
        for robot, known in names.robots.items():
            for process in known.processes:
                place = f"{ROBOTS}/{robot}/{process_folder(process)}"
                yield self._holder(place, f"process of {robot}", certificate_name(robot, process))
        for name, role in names.people.items():
            yield self._holder(f"{PEOPLE_FOLDER}/{name}", str(role), name)

    def _lasts(self, place: str, name: str) -> bool:
        """True for a whole folder with a certificate of this name and authority, valid for longer than `RENEWAL`.

        A command that was killed, a full disk or a power cut may leave files that are damaged, or of two certificates.
        """
        from skillwing.services.access.certificates import fits  # noqa: PLC0415 - as in `_facts`

        folder = self.folder / place
        try:
            certificate, key, issuer = ((folder / file).read_bytes() for file in FILES)
            found = read_facts(folder)
            if found.name != name or found.expires - utc_now() <= RENEWAL or not fits(certificate, key):
                return False
        except (OSError, ValueError, KeysError):
            return False
        # A folder can outlive its authority where they are separate volumes.
        authority = self.folder / AUTHORITY / CERTIFICATE_FILE
        return not authority.exists() or issuer == authority.read_bytes()

    def _holder(self, place: str, what: str, name: str) -> KeyHolder:
        folder = self.folder / place
        try:
            expires = read_facts(folder).expires
        except KeysError:  # one damaged certificate must not hide the others
            expires = None
        return KeyHolder(name, what, expires, folder)

    def _issue(self, place: str, name: str, role: str, days: int, hosts: Iterable[str] = ()) -> None:
        from skillwing.services.access.certificates import issue  # noqa: PLC0415 - as in `_facts`

        try:
            authority = Issued(
                *((self.folder / AUTHORITY / file).read_bytes() for file in (CERTIFICATE_FILE, KEY_FILE))
            )
        except OSError as error:
            text = f"The authority in {self.folder} cannot be read: {error.strerror}. Use the folder where it was made."
            raise KeysError(text) from error
        try:
            issued = issue(authority, name, role, days, utc_now(), hosts)
        except ValueError as error:
            text = f"The authority in {self.folder / AUTHORITY} is damaged. Restore its files from a copy,"
            raise KeysError(f"{text} or make a new folder with `skillwing keys init`.") from error
        self._write(place, issued, authority=authority.certificate)

    def _write(self, place: str, issued: Issued, authority: bytes | None) -> None:
        folder = self.folder / place
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        _write_private(folder / CERTIFICATE_FILE, issued.certificate)
        _write_private(folder / KEY_FILE, issued.key)
        if authority is not None:
            _write_private(folder / AUTHORITY_FILE, authority)

    def _save(self, names: Names) -> None:
        _write_private(self.folder / NAMES_FILE, msgspec.json.format(msgspec.json.encode(names)))


def process_folder(process: str) -> str:
    """Name of the folder of a process: `skill.drive` for `skill/drive`."""
    return process.replace("/", ".")


def ask_for_keys() -> str:
    """The remedy of somebody who was given a folder of keys."""
    return "Ask for a new folder of keys."


def read_whole(folder: Path, remedy: Callable[[], str] = ask_for_keys) -> CertificateFacts:
    """The content of the certificate in a folder with all three files. remedy: a sentence against a missing one.

    Zenoh reports a missing or damaged file as an address at which it cannot connect or listen. Raises KeysError, also
    for the key of another certificate. A renewal replaces one file after the other, so these are read again first.
    """
    for attempt in range(REREADS):
        if attempt:
            time.sleep(REREAD_PAUSE)
        certificate, key, authority = (_content(folder / file, remedy) for file in FILES)
        found = _facts(folder / CERTIFICATE_FILE, certificate, remedy)
        _facts(folder / AUTHORITY_FILE, authority, remedy)
        if _fits(folder / KEY_FILE, certificate, key, remedy):
            return found
    raise KeysError(f"{folder / KEY_FILE} is the key of another certificate. {remedy()}")


def _content(path: Path, remedy: Callable[[], str]) -> bytes:
    try:
        content = path.read_bytes()
        reason = "The file is empty"
    except OSError as error:
        content, reason = b"", error.strerror or str(error)
    if not content:
        raise KeysError(f"{path} cannot be read: {reason}. {remedy()}")
    return content


def _facts(path: Path, content: bytes, remedy: Callable[[], str]) -> CertificateFacts:
    # Every process of a robot imports this module. One without keys is spared the library of certificates.
    from skillwing.services.access.certificates import facts  # noqa: PLC0415

    try:
        return facts(content)
    except ValueError as error:
        raise KeysError(f"{path} is no certificate that can be read. {remedy()}") from error


def _fits(path: Path, certificate: bytes, key: bytes, remedy: Callable[[], str]) -> bool:
    from skillwing.services.access.certificates import fits  # noqa: PLC0415 - as in `_facts`

    try:
        return fits(certificate, key)
    except ValueError as error:
        raise KeysError(f"{path} is no key that can be read. {remedy()}") from error


def read_facts(folder: Path, remedy: Callable[[], str] = ask_for_keys) -> CertificateFacts:
    """The content of the certificate in a folder. remedy: as of `read_whole`. Raises KeysError."""
    path = folder / CERTIFICATE_FILE
    return _facts(path, _content(path, remedy), remedy)


def _write_private(path: Path, content: bytes) -> None:
    """Write a file that its owner alone can read; it is complete at every moment, also after a power cut."""
    fresh = path.with_name(f"{path.name}.new")
    fresh.unlink(missing_ok=True)
    fresh.touch(mode=0o600)
    with fresh.open("wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
    fresh.replace(path)
