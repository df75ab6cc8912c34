"""The policy as Zenoh's access control: rules for each certificate, by its common name. The default is to deny."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from skillwing.services.access.policy import (
    ADVANCED,
    Grants,
    RobotAccess,
    SiteAccess,
    certificate_name,
    guest_grants,
    person_grants,
    process_grants,
)
from skillwing.services.bus.identity import WHO, signed
from skillwing.services.names import RESOURCE_MANAGER
from skillwing.services.protocol import Keys

LISTENING = ("declare_subscriber", "liveliness_query", "declare_liveliness_subscriber")
HEARING = (
    *("put", "delete", "reply", "query", "liveliness_token"),
    *("declare_subscriber", "declare_queryable", "liveliness_query", "declare_liveliness_subscriber"),
)
"""Messages from the router. A publisher has to hear of subscribers, or it sends nothing."""

AccessRule = dict[str, Any]


def access_control(site: SiteAccess) -> dict[str, Any]:
    """The value of `access_control` in the configuration of a Zenoh router."""
    rules = list(_rules_of_the_router())
    common = [rule["id"] for rule in rules]
    granted: dict[str, list[str]] = {}
    for robot in site.robots:
        everybody = list(_rules_of_everybody(robot))
        rules += everybody
        for name, grants in (*_named_grants(site, robot), *_guest_grants(site, robot)):
            own = [*_own_rules(robot, name, grants), *(() if name in granted else _rules_of_a_name(name))]
            rules += own
            granted.setdefault(name, [*common]).extend(rule["id"] for rule in (*everybody, *own))
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": [{"id": name, "cert_common_names": [name]} for name in granted],
        "policies": [{"rules": ids, "subjects": [name]} for name, ids in granted.items()],
    }


def _named_grants(site: SiteAccess, robot: RobotAccess) -> Iterator[tuple[str, Grants]]:
    for process in robot.processes:
        yield certificate_name(robot.name, process), process_grants(robot, process)
    for name, role in site.people.items():
        yield name, person_grants(robot, role, name)


def _guest_grants(site: SiteAccess, robot: RobotAccess) -> Iterator[tuple[str, Grants]]:
    """The grants of processes of other robots that work at this one."""
    for guest in site.robots:
        if robot.name in guest.works_at and guest is not robot:
            for process in guest.processes:
                yield certificate_name(guest.name, process), guest_grants(robot, guest, process)


def _rules_of_everybody(robot: RobotAccess) -> Iterator[AccessRule]:
    everything = _with_advanced(["**"])
    yield _rule(robot, "listens", LISTENING, "ingress", everything)
    yield _rule(robot, "hears", HEARING, "egress", everything)
    # History and recovery of events. `**` does not match a chunk that begins with `@`.
    yield _rule(robot, "recovers", ("query",), "ingress", [f"**/{ADVANCED}"])


def _own_rules(robot: RobotAccess, name: str, grants: Grants) -> Iterator[AccessRule]:
    advanced = [f"{key}/{ADVANCED}" for key in grants.events]
    answers = [signed(key, "*") for key in grants.serves]
    yield _rule(robot, f"{name}:publishes", ("put",), "ingress", [*grants.streams, *grants.events, *advanced])
    yield _rule(robot, f"{name}:answers", ("declare_queryable",), "ingress", [*answers, *advanced])
    yield _rule(robot, f"{name}:replies", ("reply",), "ingress", [*answers, *grants.events, *advanced])
    yield _rule(robot, f"{name}:lives", ("liveliness_token",), "ingress", [*grants.tokens, *advanced])
    yield _rule(robot, f"{name}:asks", ("query",), "ingress", [signed(key, name) for key in grants.asks])


def _rules_of_the_router() -> Iterator[AccessRule]:
    """Rules by which everybody sees the robots at the router."""
    robots = [Keys("*").alive(RESOURCE_MANAGER)]
    yield _rule(None, "finds robots", ("liveliness_query",), "ingress", robots)
    yield _rule(None, "sees robots", ("liveliness_token",), "egress", robots)


def _rules_of_a_name(name: str) -> Iterator[AccessRule]:
    """Rules by which the holder of a name asks the router whether it is known."""
    yield _rule(None, f"{name}:asks who", ("query",), "ingress", [f"{WHO}/{name}"])
    yield _rule(None, f"{name}:is known", ("reply",), "egress", [f"{WHO}/{name}"])


def _with_advanced(keys: Iterable[str]) -> list[str]:
    return [each for key in keys for each in (key, f"{key}/{ADVANCED}")]


def _rule(robot: RobotAccess | None, name: str, messages: Iterable[str], flow: str, keys: Iterable[str]) -> AccessRule:
    """A rule that allows messages. robot: None for the keys of all robots."""
    namespace = "*" if robot is None else robot.name
    return {
        "id": f"{namespace}:{name}",
        "permission": "allow",
        "flows": [flow],
        "messages": list(messages),
        # An empty list is no valid rule; a role that may offer nothing gets a key that nobody uses.
        "key_exprs": [f"robot/{namespace}/{key}" for key in sorted(keys)] or [f"robot/{namespace}/nothing"],
    }
