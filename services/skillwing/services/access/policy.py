"""The policy: what each role may offer and ask, from the tables of keys. Everything else is denied.

All key expressions here are relative to the namespace of a robot.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import lru_cache

from skillwing.services.bus.identity import owned_chunk, signed
from skillwing.services.bus.keys import matches
from skillwing.services.names import CLIENT, MISSION, skill_process
from skillwing.services.protocol import (
    CLOCK_DONE_KEY,
    CLOCK_KEY,
    AbortMission,
    ErrorCode,
    ErrorReply,
    FireEvent,
    FireExtern,
    InterruptGoal,
    Keys,
    MockCall,
    MockedWorldCall,
    ModifyGoal,
    PauseMission,
    ResumeMission,
    StartGoal,
    StartMission,
)
from skillwing.services.wire.channel import PEOPLE, Channel, Each, Kind, Role
from skillwing.services.wire.channels import CHANNELS, COMMANDERS

LAYER = "fl/**"
"""All keys of the functional layer."""
ADVANCED = "@adv/**"
"""Keys below an event's key at which Zenoh's advanced publishers offer history and recovery."""
DEEDS: dict[object, str] = {
    StartGoal: "start skills",
    InterruptGoal: "interrupt skills",
    ModifyGoal: "modify goals",
    FireExtern: "change resources",
    FireEvent: "fire events",
    StartMission: "start missions",
    AbortMission: "abort missions",
    PauseMission: "pause missions",
    ResumeMission: "resume missions",
    MockCall: "direct mocks",
    MockedWorldCall: "direct mocks",
}
"""Verbs for the requests of people."""


COMMAND_LAYER = "ask or command the functional layer"


def certificate_name(robot: str, process: str) -> str:
    """Name of a process's certificate, one chunk of a key: `rover.skill.drive`. Names of people have no dot."""
    return f"{robot}.{process.replace('/', '.')}"


@dataclass(frozen=True, slots=True)
class RobotAccess:
    """The facts about a robot that its policy follows from.

    skillset: its name. processes: the role of each. topics: rows of its functional layer, each with the names of the
    offering processes; empty for a layer without a table, whose processes share all keys below `fl/`.
    works_at: names of other robots that its processes may read. shared: processes that act there, too: as the other
    robot's own process of the same name.
    """

    name: str
    skillset: str
    processes: Mapping[str, Role]
    topics: tuple[Channel, ...] = ()
    shared: tuple[str, ...] = ()
    works_at: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class SiteAccess:
    """Robots and people that a router serves. people: the role of each person and station, by name."""

    robots: tuple[RobotAccess, ...] = ()
    people: Mapping[str, Role] = field(default_factory=dict[str, Role])


@dataclass(frozen=True, slots=True)
class Grants:
    """The key expressions that one certificate may use in a robot. Everybody there may listen to everything.

    streams, events: it may publish there. serves: it may answer questions there. asks: it may ask there. tokens: it
    may hold these liveliness tokens. Questions carry the sender's name in addition: `KEY/by/NAME`.
    """

    streams: frozenset[str]
    events: frozenset[str]
    serves: frozenset[str]
    asks: frozenset[str]
    tokens: frozenset[str]


def process_grants(robot: RobotAccess, process: str) -> Grants:
    """The grants of a process in its robot. Raises KeyError for a process that the robot does not have."""
    role = robot.processes[process]
    return _grants(robot, role, process, certificate_name(robot.name, process))


def guest_grants(robot: RobotAccess, guest: RobotAccess, process: str) -> Grants:
    """The grants in a robot of a process of another robot, which works there as well.

    A shared process does what the robot's own one of the same name may, under its own name. All others read.
    """
    name = certificate_name(guest.name, process)
    if _acts_at(robot, guest, process):
        return _grants(robot, robot.processes[process], process, name, guest=guest.name)
    return _grants(robot, Role.VIEWER, None, name)


def person_grants(robot: RobotAccess, role: Role, name: str) -> Grants:
    """The grants of a person or station in a robot."""
    return _grants(robot, role, None, name)


@lru_cache(maxsize=1024)
def refusal(role: Role, name: str, key: str) -> ErrorReply | None:
    """The reason against a question of a person at a key, None for none: the same rules, without the robot's tables.

    At keys of the functional layer, the router alone decides about an operator.
    """
    rows = [row for row in CHANNELS if row.kind is Kind.QUERY and matches(row.spell(Keys("*"), "*"), key)]
    row = rows[0] if rows else None
    allowed = row.used_by if row is not None else (Role.OPERATOR,)
    if role in allowed:
        return None
    deed = COMMAND_LAYER if row is None else DEEDS.get(row.message, f"ask at `{key}`")
    needed = next(each for each in PEOPLE if each in allowed) if set(PEOPLE) & set(allowed) else None
    advice = "No certificate for people allows it." if needed is None else f"Ask for a certificate of role {needed}."
    return ErrorReply(
        code=ErrorCode.DENIED, message=f"`{name}` is {_article(role)} {role} and may not {deed}.", help=advice
    )


def denial(role: str, name: str, key: str) -> ErrorReply | None:
    """The reason against a question at a key in a role that the router says; None for none, and for no known role."""
    if role not in {str(each) for each in Role}:
        return None
    known = Role(role)
    # The table of the robot's topics says where its own processes ask in the functional layer.
    return None if known not in PEOPLE and key.startswith("fl/") else refusal(known, name, key)


def role_at(site: SiteAccess, robot: str, name: str) -> Role | None:
    """The role of the holder of a certificate in a robot; None for a name without rights there."""
    if name in site.people:
        return site.people[name]
    for home in site.robots:
        for process, role in home.processes.items():
            if certificate_name(home.name, process) == name:
                return role if home.name == robot else _guest_role(site, robot, home, process)
    return None


def _guest_role(site: SiteAccess, robot: str, guest: RobotAccess, process: str) -> Role | None:
    """The role in a robot of a process of another one."""
    host = next((each for each in site.robots if each.name == robot), None)
    if host is None or robot not in guest.works_at:
        return None
    return host.processes[process] if _acts_at(host, guest, process) else Role.VIEWER


def _acts_at(robot: RobotAccess, guest: RobotAccess, process: str) -> bool:
    """True for a process of a guest that may do what the robot's own one of the same name may."""
    return process in guest.shared and process in robot.processes


def _article(noun: str) -> str:
    return "an" if noun[0] in "aeiou" else "a"


# --- grants from rows ------------------------------------------------------------------------------------------------


def _grants(robot: RobotAccess, role: Role, process: str | None, name: str, guest: str = "") -> Grants:
    keys = Keys(robot.skillset)
    streams, events, serves, asks, tokens = (set[str]() for _ in range(5))
    offers = {Kind.STREAM: streams, Kind.ARRAYS: streams, Kind.EVENTS: events, Kind.QUERY: serves, Kind.TOKEN: tokens}
    listed = _is_listed(robot.topics, process)
    # A table says which process owns robot time.
    rows = [(row, {role}) for row in CHANNELS if not (listed and row.key == CLOCK_KEY)]
    # Only rows of the functional layer name processes. A process elsewhere may be called like a role.
    rows += [(row, {role, process}) for row in robot.topics]
    for row, sides in rows:
        if sides & set(row.offered_by):
            offers[row.kind].update(row.spell(keys, own) for own in _own_names(row, role, process, name))
        if row.kind is Kind.QUERY and sides & set(row.used_by):
            asks.add(row.spell(keys, "*" if row.each else ""))
    if keys.timeline in events:
        # The name in the key shows who has written a record.
        events -= {keys.timeline}
        events |= {signed(keys.timeline, name)}
    if f"{CLOCK_DONE_KEY}/*" in streams:
        done = {f"{CLOCK_DONE_KEY}/{own}" for own in _bus_names(process, name, guest)}
        streams -= {f"{CLOCK_DONE_KEY}/*"}
        streams |= done
        tokens |= done
    if role is Role.FUNCTIONAL_LAYER and not listed:
        for own in (streams, events, serves):
            own.add(LAYER)
    if role in (Role.FUNCTIONAL_LAYER, Role.SKILL_MANAGER, Role.OPERATOR) and not robot.topics:
        asks.add(LAYER)
    return Grants(*map(frozenset, (streams, events, serves, asks, tokens)))


def _is_listed(topics: Iterable[Channel], process: str | None) -> bool:
    return any(process in row.offered_by for row in topics)


def _own_names(row: Channel, role: Role, process: str | None, name: str) -> Iterator[str]:
    """The names in the changing part of a row's key for which this certificate may offer it."""
    match row.each:
        case None:
            yield ""
        case Each.SKILL if role is Role.SKILL_MANAGER and process is not None:
            yield process.removeprefix(skill_process(""))
        case Each.PROCESS if row.key is Keys.alive:
            yield from _alive_names(role, process, name)
        case _:
            yield "*"


def _alive_names(role: Role, process: str | None, name: str) -> Iterator[str]:
    """Names of the alive tokens that a certificate may hold: its own process, its client, and its mission."""
    if process is not None:
        yield process
    if role in COMMANDERS:
        yield f"{CLIENT}{name}"
        yield f"{CLIENT}{owned_chunk(name, '$*')}"
    if role in (Role.CLIENT, Role.OPERATOR):
        yield MISSION


def _bus_names(process: str | None, name: str, guest: str) -> Iterator[str]:
    """Names under which a certificate may report its progress in robot time. guest: the robot that it comes from."""
    if process is None:
        yield owned_chunk(name, "$*")
    else:
        yield f"{process}@{guest}" if guest else process
