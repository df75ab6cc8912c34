"""Attacks on a robot: each one succeeds against a router without keys, and fails against one with keys.

The attacker against keys is an insider: a viewer, who may be connected, or a client, who may start skills. Attackers
without a certificate of the site cannot connect at all.
"""

from __future__ import annotations

import json
import shutil
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass
from datetime import timedelta
from pathlib import Path

import pytest
import zenoh
from keyed_site import PEOPLE, make_store
from msgspec import structs

from skillwing.dsl import load
from skillwing.services.access.certificate_facts import Issued, utc_now
from skillwing.services.access.certificates import issue
from skillwing.services.access.handshake import explained
from skillwing.services.access.identity_files import read_identity
from skillwing.services.access.key_store import KeyStore
from skillwing.services.access.robots import robot_access
from skillwing.services.bus.identity import SessionIdentity, signed
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.bus.zenoh_session import RouterUnreachableError, open_client
from skillwing.services.client.causal_feed import follow_records
from skillwing.services.errors import NotKnownError
from skillwing.services.mocking.system import mock_processes
from skillwing.services.processes.launcher import Launcher
from skillwing.services.processes.router import LOOPBACK, LOOPBACK_WITH_KEYS
from skillwing.services.protocol import (
    FireExtern,
    GoalStatus,
    Keys,
    Message,
    QueryGoal,
    QueryStates,
    Record,
    RecordKind,
    ResourceStates,
    StartGoal,
    decode,
    encode,
)
from skillwing.services.robot import ProcessSpec, Robot
from skillwing.services.wire.channel import Role

ROVER = Path(__file__).parents[2] / "examples" / "rover" / "rover.skillset"
SKILLSET = load(ROVER)
ROBOT = Robot(
    name="rover",
    skillset=ROVER,
    hooks={},
    clock="wall",
    functional_layer=lambda _: tuple(ProcessSpec(each, "none:none") for each in ("bridge", "sim", "mapping")),
    topics="skillwing.onboard.interface.table:TOPICS",
)
KEYS = Keys("rover")
TARGET = {"target": {"x": 1.0, "y": 2.0, "heading": 0.0}}
TIMEOUT = 5.0


@dataclass
class Stage:
    """A mocked rover. store: its keys, None for a router without any."""

    launcher: Launcher
    store: KeyStore | None

    @property
    def secure(self) -> bool:
        return self.store is not None

    def identity(self, name: str) -> SessionIdentity | None:
        if self.store is None:
            return None
        person = self.store.folder / "people" / name
        return read_identity(person if person.exists() else self.store.folder / "robots" / "rover" / name)

    def session(self, name: str = "vic", mode: str = "client") -> zenoh.Session:
        """A plain session of an attacker, or of somebody who may. mode: Zenoh's."""
        identity = self.identity(name)
        return opened(self.launcher.endpoint, mode, None if identity is None else identity.connecting())

    def ask(self, session: zenoh.Session, key: str, message: Message, *names: str) -> bytes | None:
        """The first answer to a question: at the plain key, and with keys under each of these names."""
        asked = [key] if self.store is None else [key, *(signed(key, name) for name in names)]
        for each in asked:
            for reply in session.get(each, payload=encode(message), timeout=TIMEOUT):
                if reply.ok is not None:
                    return reply.ok.payload.to_bytes()
        return None

    def owner(self, name: str, suffix: str) -> str:
        return f"client/{name}~{suffix}"


def opened(endpoint: str, mode: str, tls: Mapping[str, object] | None, timeout: float = TIMEOUT) -> zenoh.Session:
    """A session of Zenoh in any mode, with any settings of TLS. Raises ZError if the router does not let it in."""
    config = {
        "mode": mode,
        "namespace": "robot/rover",
        "scouting": {"multicast": {"enabled": False}},
        "connect": {"endpoints": [endpoint], "timeout_ms": round(1000 * timeout), "exit_on_failure": True},
        "listen": {"endpoints": []},
        "transport": {"link": {} if tls is None else {"tls": dict(tls)}},
    }
    return zenoh.open(zenoh.Config.from_json5(json.dumps(config)))


@pytest.fixture(scope="module", params=["insecure", "keys"])
def stage(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stage]:
    folder = tmp_path_factory.mktemp(request.param)
    store = make_store(folder / "keys", robot_access(ROBOT)) if request.param == "keys" else None
    if store is not None:
        # ann was an operator and kept that folder, before her keys were made again for another role.
        shutil.copytree(store.add_person("ann", Role.OPERATOR), store.folder / "people" / "ann-before")
        store.add_person("ann", Role.VIEWER)
    with Launcher("rover", "rover", folder, clock="wall", keys=None if store is None else store.folder) as launcher:
        launcher.start_router(LOOPBACK if store is None else LOOPBACK_WITH_KEYS)
        launcher.start(mock_processes(ROBOT, run={"run_dir": folder}))
        yield Stage(launcher, store)


def succeeds(attack: bool, stage: Stage) -> None:
    """The attack worked exactly where there are no keys."""
    assert attack == (not stage.secure)


def arrives(condition: Callable[[], bool], within: float = TIMEOUT) -> bool:
    deadline = time.monotonic() + within
    while not condition() and time.monotonic() < deadline:
        time.sleep(0.01)
    return condition()


def states(stage: Stage) -> dict[str, str]:
    """The states of all resources, as somebody sees them who may."""
    with stage.session("olga") as session:
        answer = stage.ask(session, KEYS.resource_states, QueryStates(), "olga")
    assert answer is not None
    return decode(answer, ResourceStates).states


@pytest.mark.parametrize("way", ["no authority", "no certificate", "tcp", "peer", "router"])
def test_somebody_without_a_certificate_reads_every_topic(stage: Stage, way: str) -> None:
    """The certificate of the authority is no secret, and all ways but the first one have it."""
    heard: set[str] = set()
    endpoint, tls = stage.launcher.endpoint, None
    if stage.store is not None and way != "no authority":
        tls = {"root_ca_certificate": str(stage.store.router_folder / "authority.pem")}
    if way == "tcp":
        endpoint = endpoint.replace("tls/", "tcp/")
    try:
        session = opened(endpoint, way if way in ("peer", "router") else "client", tls, timeout=1.0)
    except zenoh.ZError:
        succeeds(False, stage)
        return
    with session:
        note = zenoh.handlers.Callback(lambda sample: heard.add(str(sample.key_expr)), indirect=False)
        session.declare_subscriber("**", note)
        succeeds(arrives(lambda: len(heard) > 2), stage)


def test_forged_extern_transitions(stage: Stage) -> None:
    request = FireExtern(resource="traction", target="SLIPS", source="bridge")
    with stage.session("alice") as session:
        stage.ask(session, KEYS.resource_extern, request, "alice", "olga", "rover.bridge", "*")
    succeeds(states(stage)["traction"] == "SLIPS", stage)
    with stage.session("olga") as session:
        back = FireExtern(resource="traction", target="GRIPS", source="olga")
        assert stage.ask(session, KEYS.resource_extern, back, "olga") is not None


FORGED = [
    ("alice", key, "client") for key in ("fl/autopilot/setpoint", "rover/data/pose", "rover/resource/step", "fl/clock")
]
FORGED += [("mapping", key, "client") for key in ("fl/autopilot/setpoint", "rover/resource/step", "fl/clock")]
FORGED += [("alice", "fl/autopilot/setpoint", mode) for mode in ("peer", "router")]


@pytest.mark.parametrize(("name", "key", "mode"), FORGED)
def test_forged_publications(stage: Stage, name: str, key: str, mode: str) -> None:
    """The attacker is a client, or a process of the same robot whose table gives the key to another one."""
    heard: list[bytes] = []
    own = signed(KEYS.timeline, name if name in PEOPLE else f"rover.{name}")
    with stage.session("bridge") as victim, stage.session(name, mode) as attacker:
        note = zenoh.handlers.Callback(lambda sample: heard.append(sample.payload.to_bytes()), indirect=False)
        victim.declare_subscriber(key, note)
        victim.declare_subscriber(own, note)

        def publish(mark: bytes) -> bool:
            attacker.put(key, b"forged")
            attacker.put(own, mark)
            return mark in heard

        # A subscription arrives after a while. Once the own publication has passed, the forged one would have, too.
        assert arrives(lambda: publish(b"first"))
        assert arrives(lambda: publish(b"second"))
    succeeds(b"forged" in heard, stage)


def test_an_impostor_in_place_of_a_manager(stage: Stage) -> None:
    caught: list[str] = []
    catch = zenoh.handlers.Callback(lambda query: caught.append(str(query.key_expr)), indirect=False)
    with stage.session("alice") as attacker, stage.session("bob") as victim:
        for key in (KEYS.goal("turn"), signed(KEYS.goal("turn"), "*"), "rover/skill/**", "**"):
            attacker.declare_queryable(key, catch, complete=True)

        def ask() -> bool:
            asked = KEYS.goal("turn") if not stage.secure else signed(KEYS.goal("turn"), "bob")
            list(victim.get(asked, payload=encode(QueryGoal()), timeout=0.5, target=zenoh.QueryTarget.ALL))
            return bool(caught)

        succeeds(arrives(ask, 2.0), stage)


def test_a_second_resource_manager(stage: Stage) -> None:
    seen: set[str] = set()
    with stage.session("alice") as attacker, stage.session("olga") as observer:
        token = attacker.liveliness().declare_token(KEYS.candidate("zzz"))
        for reply in attacker.get("nothing", timeout=1.0):
            del reply
        for reply in observer.liveliness().get("**", timeout=TIMEOUT):
            if reply.ok is not None:
                seen.add(str(reply.ok.key_expr))
        token.undeclare()
    assert KEYS.alive("resource_manager") in seen
    succeeds(KEYS.candidate("zzz") in seen, stage)


def test_forged_tokens(stage: Stage) -> None:
    forged = (KEYS.alive(stage.owner("bob", "1")), KEYS.alive("skill/lift"), KEYS.alive("bridge"))
    seen: set[str] = set()
    with stage.session("alice") as attacker, stage.session("olga") as observer:
        tokens = [attacker.liveliness().declare_token(key) for key in (*forged, KEYS.alive(stage.owner("alice", "1")))]
        list(attacker.get("nothing", timeout=1.0))
        seen = {str(reply.ok.key_expr) for reply in observer.liveliness().get("**", timeout=TIMEOUT) if reply.ok}
        for token in tokens:
            token.undeclare()
    assert KEYS.alive(stage.owner("alice", "1")) in seen, "that one is its own"
    succeeds(set(forged) <= seen, stage)
    assert not stage.secure or not seen & set(forged)


def test_a_start_in_the_name_of_somebody_else(stage: Stage) -> None:
    """A recorded start of alice's, sent by a viewer; and by another client, whose name it then has."""
    recorded = StartGoal(
        goal_id=f"replayed-{stage.secure}", inputs={"heading": 0.1}, client="alice", schema=SKILLSET.schema_hash
    )
    texts: list[str] = []
    with stage.session("vic") as viewer, stage.session("bob") as client, stage.session("olga") as observer:

        def note(sample: zenoh.Sample) -> None:
            status = decode(sample.payload.to_bytes(), GoalStatus)
            if status.goal_id.startswith("replayed"):
                texts.append(status.text)

        observer.declare_subscriber(KEYS.status("turn"), zenoh.handlers.Callback(note, indirect=False))
        # The router has passed on the subscription when it answers.
        assert list(observer.get("access/olga", timeout=TIMEOUT))
        replayed = stage.ask(viewer, KEYS.start("turn"), recorded, "vic", "alice", "olga")
        succeeds(replayed is not None, stage)
        again = structs.replace(recorded, goal_id=f"{recorded.goal_id}-again")
        assert stage.ask(client, KEYS.start("turn"), again, "bob") is not None
        under_her_name = structs.replace(recorded, goal_id=f"{recorded.goal_id}-stolen")
        succeeds(stage.ask(client, KEYS.start("turn"), under_her_name, "alice") is not None, stage)
        assert arrives(lambda: f"asked by {'bob (alice)' if stage.secure else 'alice'}" in texts)
    assert ("asked by alice" in texts) == (not stage.secure)


def test_a_goal_that_is_owned_by_somebody_else(stage: Stage) -> None:
    """An owner that never lives would end the goal; one of another client would end with that client."""
    start = StartGoal(
        goal_id=f"owned-{stage.secure}",
        inputs={"heading": 0.1},
        client="alice",
        schema=SKILLSET.schema_hash,
        owner=stage.owner("bob", "1"),
    )
    with stage.session("alice") as session:
        succeeds(stage.ask(session, KEYS.start("turn"), start, "alice") is not None, stage)


def test_a_forged_record_of_the_timeline(stage: Stage) -> None:
    """Written by alice, as if the resource manager had recorded what olga did."""
    texts: list[tuple[str, str]] = []
    with (
        stage.session("alice") as attacker,
        closing(ZenohBus("recorder", "rover", stage.launcher.endpoint, identity=stage.identity("recorder"))) as bus,
    ):
        follow_records(bus, KEYS, lambda record: texts.append((record.source, record.text)))

        def forge(record_id: str, text: str) -> bool:
            record = Record(
                id=record_id,
                t=1.0,
                source="resource_manager",
                kind=RecordKind.GOAL,
                subject="turn",
                before=None,
                after="VALIDATING",
                text=text,
            )
            for key in (KEYS.timeline, *(signed(KEYS.timeline, name) for name in ("alice", "rover.resource_manager"))):
                attacker.put(key, encode(record))
            return any(told == text for _, told in texts)

        def heard(record_id: str, text: str) -> bool:
            """Forge until it is heard: a subscription arrives after a while."""
            return arrives(lambda: forge(record_id, text) or bus.run_until(lambda: False, 0.05), 2.0)

        assert heard("alice~1#1", "its own")
        heard("resource_manager~1#1", "forged")
    succeeds(("resource_manager", "its own") in texts, stage)
    succeeds(("resource_manager", "forged") in texts, stage)
    assert not stage.secure or {source for source, text in texts if text == "its own"} == {"alice"}


def test_one_person_in_two_roles(stage: Stage) -> None:
    """alice also has the folder of a viewer: neither session may what only an operator may."""
    request = FireExtern(resource="carousel", target="FULL", source="olga")
    answers: list[bytes | None] = []
    for name in ("alice", "vic"):
        with stage.session(name) as session:
            answers.append(stage.ask(session, KEYS.resource_extern, request, "alice", "vic", "olga"))
    succeeds(any(answer is not None for answer in answers), stage)


def test_an_earlier_certificate_of_a_name_has_the_present_role_of_that_name(stage: Stage) -> None:
    """ann was an operator. Her folder of that time now opens what a viewer may, and nothing more."""
    request = FireExtern(resource="carousel", target="ROOM", source="ann")
    with stage.session("ann-before") as session:
        assert stage.ask(session, KEYS.resource_states, QueryStates(), "ann") is not None
        succeeds(stage.ask(session, KEYS.resource_extern, request, "ann") is not None, stage)


def test_a_certificate_of_a_process_in_the_hands_of_a_person(stage: Stage) -> None:
    """The holder of copied keys of `mapping` starts a skill, as that process or as a client."""
    request = StartGoal(
        goal_id=f"copied-{stage.secure}", inputs={"heading": 0.1}, client="m", schema=SKILLSET.schema_hash
    )
    with stage.session("mapping") as session:
        succeeds(stage.ask(session, KEYS.start("turn"), request, "rover.mapping", "alice") is not None, stage)


def test_certificates_of_others_and_of_yesterday(stage: Stage, tmp_path: Path) -> None:
    if stage.store is None:
        with open_client(stage.launcher.endpoint, "rover", TIMEOUT):
            return
    foreign = make_store(tmp_path / "foreign", robot_access(ROBOT))
    for name, words in (("foreign", "another authority"), ("expired", "expired on")):
        folder = foreign.folder / "people" / "alice"
        if name == "expired":
            authority = Issued(
                *((stage.store.folder / "authority" / f"{each}.pem").read_bytes() for each in ("certificate", "key"))
            )
            made = issue(authority, "alice", "client", 1, utc_now() - timedelta(days=9))
            (folder / "certificate.pem").write_bytes(made.certificate)
            (folder / "key.pem").write_bytes(made.key)
        (folder / "authority.pem").write_bytes((stage.store.router_folder / "authority.pem").read_bytes())
        identity = read_identity(folder)
        with pytest.raises(RouterUnreachableError) as refused:
            open_client(stage.launcher.endpoint, "rover", 1.0, identity)
        reason = explained(refused.value, identity)
        assert isinstance(reason, NotKnownError)
        assert words in str(reason)
    absent = RouterUnreachableError("tls/127.0.0.1:1")
    assert explained(absent, stage.identity("alice")) is absent


def test_a_late_listener_gets_the_history_of_events(stage: Stage) -> None:
    """The other side: rules that deny too much lose history and recovery without a word."""
    start = StartGoal(goal_id=f"early-{stage.secure}", inputs=TARGET, client="x", schema=SKILLSET.schema_hash)
    with stage.session("alice") as session:
        assert stage.ask(session, KEYS.start("drive_to"), start, "alice") is not None
    seen: list[str] = []
    bus = ZenohBus("late", "rover", stage.launcher.endpoint, identity=stage.identity("vic"))
    with closing(bus):
        bus.subscribe(
            KEYS.status("*"), lambda sample: seen.append(decode(sample.payload, GoalStatus).goal_id), events=True
        )
        assert bus.run_until(lambda: seen.count(start.goal_id) >= 2, TIMEOUT)
