"""The names of a site: content of `names.json`, from which the router's policy follows.

A certificate is known by its name alone, so names are given once. A robot and a person never share one. A removed name
is not given again: its old certificates would be let in with the new ones.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from ipaddress import ip_address

import msgspec

from skillwing.services.access.certificate_facts import ROUTER_NAME
from skillwing.services.access.policy import RobotAccess, SiteAccess
from skillwing.services.errors import InvalidOptionError
from skillwing.services.wire.channel import PEOPLE, Channel, Kind, Role

DAYS = 365
"""Validity of certificates, unless said otherwise."""
HOST = re.compile(r"[A-Za-z0-9_-]+(\.[A-Za-z0-9_-]+)*")
PERSON = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,39}")


class Topic(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A row of a functional layer, as far as the policy needs it."""

    key: str
    kind: Kind
    offered_by: tuple[str, ...]
    used_by: tuple[str, ...]


class RobotNames(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A robot: its skillset's name, the role of each process, and the topics of its functional layer.

    shared, works_at: as of `RobotAccess`.
    """

    skillset: str
    processes: dict[str, Role]
    topics: tuple[Topic, ...] = ()
    shared: tuple[str, ...] = ()
    works_at: tuple[str, ...] = ()


class Names(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Content of names.json. days: validity of certificates that are issued. removed: names that were taken back."""

    hosts: tuple[str, ...]
    days: int = DAYS
    robots: dict[str, RobotNames] = {}
    people: dict[str, Role] = {}
    removed: tuple[str, ...] = ()

    def site(self) -> SiteAccess:
        """The facts that the policy follows from."""
        robots = (
            RobotAccess(
                *(name, robot.skillset, robot.processes, tuple(map(_row, robot.topics)), robot.shared, robot.works_at)
            )
            for name, robot in self.robots.items()
        )
        return SiteAccess(tuple(robots), self.people)

    def with_person(self, name: str, role: Role) -> Names:
        """These names and a person's. Raises InvalidOptionError for a name or role that it cannot have."""
        if role not in PEOPLE:
            raise InvalidOptionError("role", f"A person is {', '.join(PEOPLE[:-1])} or {PEOPLE[-1]}, not {role}.")
        if name == ROUTER_NAME:
            raise InvalidOptionError("name", f"`{name}` is the name of the router. Choose another one.")
        if PERSON.fullmatch(name) is None:
            text = f"Nobody can be called `{name}` here. Use a letter, then at most 39 letters, digits, `_` and `-`."
            raise InvalidOptionError("name", text)
        self._require_free(name, self.robots, "a robot", "name", f"`{name}2`")
        return msgspec.structs.replace(self, people={**self.people, name: role})

    def with_robot(self, robot: RobotAccess) -> Names:
        """These names and a robot's with its present processes, and the robots at which it worked before.

        Raises InvalidOptionError for a name that it cannot have.
        """
        self._require_free(robot.name, self.people, "a person", "robot-name", f"--robot-name {robot.name}2")
        earlier = self.robots[robot.name].works_at if robot.name in self.robots else ()
        works_at = tuple(dict.fromkeys((*earlier, *robot.works_at)))
        topics = tuple(map(_topic, robot.topics))
        known = RobotNames(robot.skillset, dict(robot.processes), topics, robot.shared, works_at)
        return msgspec.structs.replace(self, robots={**self.robots, robot.name: known})

    def without(self, name: str) -> Names:
        """These names without that of a person or a robot, which cannot be given again."""
        people = {each: role for each, role in self.people.items() if each != name}
        robots = {each: robot for each, robot in self.robots.items() if each != name}
        return msgspec.structs.replace(self, people=people, robots=robots, removed=(*self.removed, name))

    def _require_free(self, name: str, others: Mapping[str, object], what: str, option: str, advice: str) -> None:
        if name in self.removed:
            text = f"The name `{name}` was removed, and its old certificates would be let in again."
            raise InvalidOptionError(option, f"{text} Choose another name, such as {advice}.")
        if name in others:
            raise InvalidOptionError(option, f"`{name}` is {what} here. Choose another name, such as {advice}.")


def _topic(row: Channel) -> Topic:
    key = row.key if isinstance(row.key, str) else ""
    pattern = f"{key}/*" if row.each else key
    return Topic(pattern, row.kind, tuple(map(str, row.offered_by)), tuple(map(str, row.used_by)))


def _row(topic: Topic) -> Channel:
    return Channel(topic.key, topic.kind, topic.offered_by, topic.used_by)


def require_hosts(hosts: Iterable[str]) -> None:
    """Raise InvalidOptionError for what is neither a name nor an address of a machine."""
    for host in hosts:
        if HOST.fullmatch(host) is None and not _is_ip_address(host):
            text = f"`{host}` is no name or address of a machine. Write it as in `robot.local` or `192.168.1.7`."
            raise InvalidOptionError("host", f"{text} A port does not belong to it.")


def _is_ip_address(host: str) -> bool:
    try:
        ip_address(host)
    except ValueError:
        return False
    return True
