"""Every rule of the policy on a live router: for each certificate, key and verb, what is granted and what is not.

`r1` has no table of topics. `r3` has that of the M600, and `r4` works there. The router's own session is not bound by
its rules. It listens, answers and asks everywhere.
"""

from __future__ import annotations

import shutil
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path

import pytest
import zenoh
from keyed_site import PEOPLE, Site, free_port, make_store, opened_by_file, opened_site

from skillwing.dsl import load
from skillwing.services.access.identity_files import person_identity
from skillwing.services.access.policy import (
    Grants,
    RobotAccess,
    certificate_name,
    guest_grants,
    person_grants,
    process_grants,
)
from skillwing.services.access.robots import robot_access
from skillwing.services.bus import Answer, NoReply, Refused
from skillwing.services.bus.identity import SessionIdentity, owned_chunk, signed
from skillwing.services.bus.keys import matches
from skillwing.services.bus.router_robots import robots_at
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.bus.zenoh_session import open_client
from skillwing.services.client.joining import robots_with_missions
from skillwing.services.protocol import Keys
from skillwing.services.robot import ProcessSpec, Robot
from skillwing.services.wire.channel import Role
from skillwing.services.wire.channels import CHANNELS, keys_in

ROVER = Path(__file__).parents[2] / "examples" / "rover" / "rover.skillset"
SKILLSET = load(ROVER)


def rover(name: str, *layer: str, topics: str | None = None) -> Robot:
    """A rover with these processes in its functional layer."""
    specs = tuple(ProcessSpec(each, "none:none") for each in layer)
    return Robot(
        name=name,
        skillset=ROVER,
        hooks={},
        clock="wall",
        functional_layer=lambda _: specs,
        topics=topics,
        shared_processes=("sim",),
    )


M600_TOPICS = "skillwing.onboard.interface.table:TOPICS"
PLAIN = robot_access(rover("r1", "bridge"))
TABLED = robot_access(rover("r3", "bridge", "sim", "guidance", "mapping", topics=M600_TOPICS))
GUEST = robot_access(rover("r4", "bridge", "sim", "guidance", "mapping", topics=M600_TOPICS), works_at=("r3",))
SECOND = "r2"
PROCESSES = ("resource_manager", "data_manager", "skill/turn", "bridge", "mocked_world", "mission", "recorder")
TIMEOUT = 10.0


@dataclass(frozen=True)
class Caller:
    """The holder of a certificate in a robot. name: a person, or a process of that robot, or of its `guest`."""

    name: str
    robot: RobotAccess = PLAIN
    guest: RobotAccess | None = None

    @property
    def home(self) -> str:
        return (self.guest or self.robot).name

    @property
    def chunk(self) -> str:
        """The name in the certificate."""
        return self.name if self.name in PEOPLE else certificate_name(self.home, self.name)

    @property
    def grants(self) -> Grants:
        if self.guest is not None:
            return guest_grants(self.robot, self.guest, self.name)
        if self.name in PEOPLE:
            return person_grants(self.robot, PEOPLE[self.name], self.name)
        return process_grants(self.robot, self.name)

    @property
    def space(self) -> str:
        """The begin of the robot's keys at the router."""
        return f"robot/{self.robot.name}/"

    def identity(self, site: Site) -> SessionIdentity | None:
        return site.identity(self.name, self.home)

    def session(self, site: Site, robot: str | None = None) -> zenoh.Session:
        return site.session(self.name, robot or self.robot.name, self.home)

    def __str__(self) -> str:
        return f"{self.robot.name}-{self.chunk}"


CALLERS = (
    *map(Caller, (*PEOPLE, *PROCESSES, "launcher")),
    *(Caller(name, TABLED) for name in ("olga", "sim", "guidance", "mapping", "skill/turn")),
    *(Caller(name, TABLED, GUEST) for name in ("sim", "mission", "mapping")),
)
CHUNKS = sorted({caller.chunk for caller in CALLERS})

KEYS = sorted(
    {
        *(key for row in CHANNELS for key in keys_in(SKILLSET, row)),
        *("rover/leader/mark", "rover/candidate/mark", "rover/data/x", "rover/event/x", "rover/foreign"),
        *("rover/alive/mission", "rover/alive/recorder", "rover/alive/launcher", "rover/alive/bridge"),
        *(f"rover/alive/client/{name}" for name in ("alice", "bob", "olga", "vic", "r4.mission")),
        *(f"rover/alive/client/{owned_chunk(name, 'x')}" for name in ("alice", "bob", "olga", "vic", "r4.mission")),
        *(f"fl/clock/done/{name}" for name in (*PROCESSES, "alice~x", "bob~x", "vic~x", "sim@r4", "r4.mapping~x")),
        *(f"rover/timeline/by/{name}" for name in ("alice", "bob", "vic", "r1.bridge", "r1.recorder", "r4.sim")),
        *("fl/autopilot/setpoint", "fl/guidance/command", "fl/geofence", "fl/map", "fl/imu", "fl/pilot", "elsewhere"),
        *("rover/skill/turn/status/@adv/pub/z/1/_", "rover/skill/drive_to/status/@adv/pub/z/1/_"),
    }
)


def covered(expressions: frozenset[str], key: str) -> bool:
    return any(_covers(each, key) for each in expressions)


def _covers(expression: str, key: str) -> bool:
    """True if a key expression of Zenoh covers the key. Only `~$*` at a chunk's end is new beside those of the bus."""
    head, wild, _ = expression.partition("$*")
    if wild:
        return key.startswith(head) and "/" not in key.removeprefix(head)
    return matches(expression, key)


def _with_advanced(events: frozenset[str], key: str) -> bool:
    return "/@adv/" in key and covered(events, key.partition("/@adv/")[0])


def eventually(done: Callable[[], bool]) -> bool:
    """Wait for a message that comes on another thread."""
    deadline = time.monotonic() + TIMEOUT
    while not done() and time.monotonic() < deadline:
        time.sleep(0.01)
    return done()


@pytest.fixture(scope="module", params=["own", "file"])
def site(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    """A site with the own router, and with Zenoh's by the file of `skillwing access-control`."""
    store = make_store(tmp_path_factory.mktemp("site") / "keys", PLAIN, TABLED, GUEST)
    if request.param == "own":
        opened = opened_site(PLAIN.name, store)
    else:
        opened = opened_by_file(PLAIN.name, store, f"tls/127.0.0.1:{free_port()}")
    with opened as site:
        yield site


@pytest.fixture(scope="module", params=CALLERS, ids=str)
def named(request: pytest.FixtureRequest, site: Site) -> tuple[Caller, zenoh.Session]:
    return request.param, request.param.session(site)


def fence(session: zenoh.Session, caller: Caller) -> None:
    """Return when the router has handled everything that the session sent before."""
    assert [reply for reply in session.get(f"access/{caller.chunk}", timeout=TIMEOUT) if reply.ok is not None]


def test_publications_pass_at_granted_keys_only_and_deletions_nowhere(
    site: Site, named: tuple[Caller, zenoh.Session]
) -> None:
    caller, session = named
    put: set[str] = set()
    deleted: set[str] = set()

    def hear(sample: zenoh.Sample) -> None:
        verb = put if sample.kind == zenoh.SampleKind.PUT else deleted
        verb.add(str(sample.key_expr).removeprefix(caller.space))

    note = zenoh.handlers.Callback(hear, indirect=False)
    with (
        site.router.declare_subscriber(f"{caller.space}**", note),
        site.router.declare_subscriber(f"{caller.space}**/@adv/**", note),
    ):
        for key in KEYS:
            session.put(key, b"")
            session.delete(key)
        fence(session, caller)
    grants = caller.grants
    granted = grants.streams | grants.events
    expected = {key for key in KEYS if covered(granted, key) or _with_advanced(grants.events, key)}
    assert put == expected
    assert not deleted, "no protocol of ours deletes"


def test_tokens_live_at_granted_keys_only(site: Site, named: tuple[Caller, zenoh.Session]) -> None:
    caller, session = named
    tokens = [session.liveliness().declare_token(key) for key in KEYS]
    fence(session, caller)
    seen = {
        str(reply.ok.key_expr).removeprefix(caller.space)
        for expression in (f"{caller.space}**", f"{caller.space}**/@adv/**")
        for reply in site.router.liveliness().get(expression, timeout=TIMEOUT)
        if reply.ok is not None
    }
    for token in tokens:
        token.undeclare()
    grants = caller.grants
    granted = {key for key in KEYS if covered(grants.tokens, key) or _with_advanced(grants.events, key)}
    assert seen & set(KEYS) == granted


def test_questions_are_answered_at_granted_keys_only(site: Site, named: tuple[Caller, zenoh.Session]) -> None:
    caller, session = named
    plain = [key for key in KEYS if "/@adv/" not in key]

    def reply(query: zenoh.Query) -> None:
        query.reply(query.key_expr, caller.chunk.encode())

    callback = zenoh.handlers.Callback(reply, indirect=False)
    served = [session.declare_queryable(signed(key, "*"), callback) for key in plain]
    served += [session.declare_queryable(key, callback) for key in plain]
    fence(session, caller)
    grants = caller.grants
    for key in plain:
        asked = f"{caller.space}{signed(key, 'somebody')}"
        assert answered_by(site.router, asked, caller.chunk) == covered(grants.serves, key), key
        assert not answered_by(site.router, f"{caller.space}{key}", caller.chunk), key
    for each in served:
        each.undeclare()


def answered_by(session: zenoh.Session, key: str, name: str) -> bool:
    replies = session.get(key, timeout=TIMEOUT, target=zenoh.QueryTarget.ALL)
    return name.encode() in {reply.ok.payload.to_bytes() for reply in replies if reply.ok is not None}


def test_questions_pass_at_granted_keys_under_the_own_name_only(
    site: Site, named: tuple[Caller, zenoh.Session]
) -> None:
    caller, session = named
    heard: set[str] = set()

    def take(query: zenoh.Query) -> None:
        heard.add(str(query.key_expr).removeprefix(caller.space))
        query.reply(query.key_expr, b"")

    plain = [key for key in KEYS if "/@adv/" not in key]
    callback = zenoh.handlers.Callback(take, indirect=False)
    with site.router.declare_queryable(f"{caller.space}**", callback):
        fence(session, caller)
        for key in plain:
            for tail in (key, *(signed(key, each) for each in (*CHUNKS, "*"))):
                session.get(tail, timeout=TIMEOUT)
        fence(session, caller)
    grants = caller.grants
    own = {signed(key, caller.chunk) for key in plain if covered(grants.asks, key)}
    assert {key for key in heard if not key.startswith("access/")} == own


def test_everybody_hears_everything_of_its_robot(site: Site, named: tuple[Caller, zenoh.Session]) -> None:
    caller, session = named
    heard: set[str] = set()
    note = zenoh.handlers.Callback(lambda sample: heard.add(str(sample.key_expr)), indirect=False)
    with session.declare_subscriber("**", note), session.declare_subscriber("**/@adv/**", note):
        fence(session, caller)
        for key in KEYS:
            site.router.put(f"{caller.space}{key}", b"")
            site.router.put(f"robot/{SECOND}/{key}", b"")
        assert eventually(lambda: heard >= set(KEYS))
    assert heard == set(KEYS)


def test_nobody_reaches_another_robot(site: Site) -> None:
    heard: list[str] = []
    note = zenoh.handlers.Callback(lambda sample: heard.append(str(sample.key_expr)), indirect=False)
    ask = zenoh.handlers.Callback(lambda query: heard.append(str(query.key_expr)), indirect=False)
    with (
        site.router.declare_subscriber(f"robot/{SECOND}/**", note),
        site.router.declare_queryable(f"robot/{SECOND}/rover/**", ask),
    ):
        for caller in CALLERS:
            session = caller.session(site, SECOND)
            for key in KEYS:
                session.put(key, b"")
            assert not list(session.get(signed("rover/skill/turn/start", caller.chunk), timeout=1.0))
    assert heard == []


def test_everybody_finds_the_robots_at_the_router(site: Site) -> None:
    owner = Caller("resource_manager")
    manager = owner.session(site)
    token = manager.liveliness().declare_token("rover/alive/resource_manager")
    fence(manager, owner)
    for caller in CALLERS:
        identity = caller.identity(site)
        assert robots_at(site.endpoint, timeout=TIMEOUT, identity=identity) == {"r1": "rover"}
        assert robots_at(site.endpoint, "r1", TIMEOUT, identity) == {"r1": "rover"}
    token.undeclare()


def test_people_find_the_robots_with_a_mission(site: Site, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SKILLWING_KEYS", str(site.store.folder / "people" / "vic") if site.store else "")
    tokens = []
    for robot, process in ((PLAIN, "resource_manager"), (TABLED, "resource_manager"), (TABLED, "mission")):
        owner = Caller(process, robot)
        session = owner.session(site)
        tokens.append(session.liveliness().declare_token(f"rover/alive/{process}"))
        fence(session, owner)
    assert robots_with_missions(site.endpoint) == ["r3"]
    for token in tokens:
        token.undeclare()


def test_a_role_that_the_router_took_back_meanwhile_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A bus that joined before the router's new start has asked for its role then."""
    store = make_store(tmp_path / "keys", PLAIN)
    shutil.copytree(store.folder / "people" / "olga", tmp_path / "olga")
    store.add_person("olga", Role.VIEWER)
    monkeypatch.setenv("SKILLWING_KEYS", str(tmp_path / "olga"))
    answers: list[Answer] = []
    with opened_site(PLAIN.name, store) as site:
        identity = person_identity(site.endpoint)
        with closing(ZenohBus("x", PLAIN.name, site.endpoint, identity=identity)) as bus:
            for key in ("rover/resource/extern", "rover/resource/state"):
                bus.ask(key, b"", answers.append)
            assert bus.run_until(lambda: len(answers) == 2, TIMEOUT)
    denied = next(each for each in answers if isinstance(each, Refused))
    assert denied.error.message == "`olga` is a viewer and may not change resources."
    assert NoReply(timed_out=False) in answers, "nobody answers there, and she may ask"


class Tunnel:
    """A tunnel to an address on loopback, which can be cut."""

    def __init__(self, endpoint: str) -> None:
        self._target = ("127.0.0.1", int(endpoint.rpartition(":")[2]))
        self._server = socket.create_server(("127.0.0.1", 0))
        self.endpoint = f"tls/127.0.0.1:{self._server.getsockname()[1]}"
        self._open = True
        self._links: list[socket.socket] = []
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self) -> None:
        with suppress(OSError):  # it was closed
            while True:
                near, _ = self._server.accept()
                if not self._open:
                    near.close()
                    continue
                far = socket.create_connection(self._target)
                self._links += [near, far]
                for ends in ((near, far), (far, near)):
                    threading.Thread(target=self._forward, args=ends, daemon=True).start()

    @staticmethod
    def _forward(source: socket.socket, target: socket.socket) -> None:
        with suppress(OSError):  # it was cut
            while data := source.recv(65536):
                target.sendall(data)

    def cut(self) -> None:
        """End all links, and let nobody through until `restore`."""
        self._open = False
        while self._links:
            link = self._links.pop()
            with suppress(OSError):
                link.shutdown(socket.SHUT_RDWR)
            link.close()

    def restore(self) -> None:
        self._open = True

    def close(self) -> None:
        self.cut()
        self._server.shutdown(socket.SHUT_RDWR)
        self._server.close()


def test_an_event_that_was_lost_is_asked_for_again(site: Site) -> None:
    """A listener without history, so that nothing but the publisher's heartbeats tells of the loss."""
    key, heard = Keys("rover").status("turn"), list[bytes]()
    note = zenoh.handlers.Callback(lambda sample: heard.append(sample.payload.to_bytes()), indirect=False)
    recovery = zenoh.ext.RecoveryConfig(periodic_queries=None, heartbeat=True)
    with (
        closing(Tunnel(site.endpoint)) as tunnel,
        closing(
            ZenohBus("skill/turn", PLAIN.name, site.endpoint, identity=site.identity("skill/turn", PLAIN.name))
        ) as bus,
        open_client(tunnel.endpoint, PLAIN.name, TIMEOUT, site.identity("vic")) as listener,
    ):
        status = bus.advertise(key, events=True)
        zenoh.ext.declare_advanced_subscriber(listener, key, note, recovery=recovery)

        def hears() -> bool:
            status.put(b"early")
            return bool(heard)

        assert eventually(hears)
        tunnel.cut()
        status.put(b"lost")
        assert b"lost" not in heard
        tunnel.restore()
        assert eventually(lambda: b"lost" in heard)
    assert heard.count(b"lost") == 1
