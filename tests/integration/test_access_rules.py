"""Every rule of the policy on a live router: for each certificate, key and verb, what is granted and what is not.

The router's own session is not bound by its rules. It listens, answers and asks everywhere.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import zenoh
from keyed_site import PEOPLE, Site, free_port, make_store, opened_by_file, opened_site

from skillwing.dsl import load
from skillwing.services.access.policy import Grants, certificate_name, person_grants, process_grants
from skillwing.services.access.robots import robot_access
from skillwing.services.bus.identity import owned_chunk, signed
from skillwing.services.bus.keys import matches
from skillwing.services.bus.router_robots import robots_at
from skillwing.services.robot import ProcessSpec, Robot
from skillwing.services.wire.channels import CHANNELS, keys_in

ROVER = Path(__file__).parents[2] / "examples" / "rover" / "rover.skillset"
SKILLSET = load(ROVER)
ROBOT = Robot(
    name="r1", skillset=ROVER, hooks={}, clock="wall", functional_layer=lambda _: (ProcessSpec("bridge", "none:none"),)
)
ACCESS = robot_access(ROBOT)
SECOND = "r2"
PROCESSES = ("resource_manager", "data_manager", "skill/turn", "bridge", "mocked_world", "mission", "recorder")
NAMES = (*PEOPLE, *PROCESSES, "launcher")
TIMEOUT = 10.0

KEYS = sorted(
    {
        *(key for row in CHANNELS for key in keys_in(SKILLSET, row)),
        *("rover/leader/mark", "rover/candidate/mark", "rover/data/x", "rover/event/x", "rover/foreign"),
        *("rover/alive/mission", "rover/alive/recorder", "rover/alive/launcher", "rover/alive/bridge"),
        *(f"rover/alive/client/{name}" for name in ("alice", "bob", "olga", "vic")),
        *(f"rover/alive/client/{owned_chunk(name, 'x')}" for name in ("alice", "bob", "olga", "vic")),
        *(f"fl/clock/done/{name}" for name in (*PROCESSES, "alice~x", "bob~x")),
        *(f"rover/timeline/by/{name}" for name in ("alice", "bob", "vic", "r1.bridge", "r1.recorder")),
        *("fl/autopilot/setpoint", "fl/guidance/command", "fl/pilot", "elsewhere"),
        *("rover/skill/turn/status/@adv/pub/z/1/_", "rover/skill/drive_to/status/@adv/pub/z/1/_"),
    }
)


def chunk(name: str) -> str:
    """The name in the certificate of a person or process."""
    return name if name in PEOPLE else certificate_name(ROBOT.name, name)


def grants_of(name: str) -> Grants:
    return person_grants(ACCESS, PEOPLE[name], name) if name in PEOPLE else process_grants(ACCESS, name)


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
    store = make_store(tmp_path_factory.mktemp("site") / "keys", ACCESS)
    if request.param == "own":
        opened = opened_site(ROBOT.name, store)
    else:
        opened = opened_by_file(ROBOT.name, store, f"tls/127.0.0.1:{free_port()}")
    with opened as site:
        yield site


@pytest.fixture(scope="module", params=NAMES)
def named(request: pytest.FixtureRequest, site: Site) -> tuple[str, zenoh.Session]:
    return request.param, site.session(request.param)


def fence(session: zenoh.Session, name: str) -> None:
    """Return when the router has handled everything that the session sent before."""
    assert [reply for reply in session.get(f"access/{chunk(name)}", timeout=TIMEOUT) if reply.ok is not None]


def test_publications_pass_at_granted_keys_only(site: Site, named: tuple[str, zenoh.Session]) -> None:
    name, session = named
    heard: set[str] = set()
    note = zenoh.handlers.Callback(lambda sample: heard.add(str(sample.key_expr)[9:]), indirect=False)
    with (
        site.router.declare_subscriber("robot/r1/**", note),
        site.router.declare_subscriber("robot/r1/**/@adv/**", note),
    ):
        for key in KEYS:
            session.put(key, name.encode())
        fence(session, name)
    grants = grants_of(name)
    granted = grants.streams | grants.events
    assert heard == {key for key in KEYS if covered(granted, key) or _with_advanced(grants.events, key)}


def test_tokens_live_at_granted_keys_only(site: Site, named: tuple[str, zenoh.Session]) -> None:
    name, session = named
    tokens = [session.liveliness().declare_token(key) for key in KEYS]
    fence(session, name)
    seen = {
        str(reply.ok.key_expr).removeprefix("robot/r1/")
        for expression in ("robot/r1/**", "robot/r1/**/@adv/**")
        for reply in site.router.liveliness().get(expression, timeout=TIMEOUT)
        if reply.ok is not None
    }
    for token in tokens:
        token.undeclare()
    grants = grants_of(name)
    granted = {key for key in KEYS if covered(grants.tokens, key) or _with_advanced(grants.events, key)}
    assert seen & set(KEYS) == granted


def test_questions_are_answered_at_granted_keys_only(site: Site, named: tuple[str, zenoh.Session]) -> None:
    name, session = named
    plain = [key for key in KEYS if "/@adv/" not in key]

    def reply(query: zenoh.Query) -> None:
        query.reply(query.key_expr, name.encode())

    callback = zenoh.handlers.Callback(reply, indirect=False)
    served = [session.declare_queryable(signed(key, "*"), callback) for key in plain]
    served += [session.declare_queryable(key, callback) for key in plain]
    fence(session, name)
    grants = grants_of(name)
    for key in plain:
        asked = f"robot/r1/{signed(key, 'somebody')}"
        assert answered_by(site.router, asked, name) == covered(grants.serves, key), key
        assert not answered_by(site.router, f"robot/r1/{key}", name), key
    for each in served:
        each.undeclare()


def answered_by(session: zenoh.Session, key: str, name: str) -> bool:
    replies = session.get(key, timeout=TIMEOUT, target=zenoh.QueryTarget.ALL)
    return name.encode() in {reply.ok.payload.to_bytes() for reply in replies if reply.ok is not None}


def test_questions_pass_at_granted_keys_under_the_own_name_only(site: Site, named: tuple[str, zenoh.Session]) -> None:
    name, session = named
    heard: set[str] = set()

    def take(query: zenoh.Query) -> None:
        heard.add(str(query.key_expr).removeprefix("robot/r1/"))
        query.reply(query.key_expr, b"")

    plain = [key for key in KEYS if "/@adv/" not in key]
    names = sorted({*map(chunk, NAMES), "*"})
    callback = zenoh.handlers.Callback(take, indirect=False)
    with site.router.declare_queryable("robot/r1/**", callback):
        fence(session, name)
        for key in plain:
            for tail in (key, *(signed(key, each) for each in names)):
                session.get(tail, timeout=TIMEOUT)
        fence(session, name)
    grants = grants_of(name)
    own = {signed(key, chunk(name)) for key in plain if covered(grants.asks, key)}
    assert {key for key in heard if not key.startswith("access/")} == own


def test_everybody_hears_everything_of_its_robot(site: Site, named: tuple[str, zenoh.Session]) -> None:
    name, session = named
    heard: set[str] = set()
    note = zenoh.handlers.Callback(lambda sample: heard.add(str(sample.key_expr)), indirect=False)
    with session.declare_subscriber("**", note), session.declare_subscriber("**/@adv/**", note):
        fence(session, name)
        for key in KEYS:
            site.router.put(f"robot/r1/{key}", b"")
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
        for name in NAMES:
            session = site.session(name, SECOND)
            for key in KEYS:
                session.put(key, b"")
            assert not list(session.get(signed("rover/skill/turn/start", chunk(name)), timeout=1.0))
    assert heard == []


def test_everybody_finds_the_robots_at_the_router(site: Site) -> None:
    manager = site.session("resource_manager")
    token = manager.liveliness().declare_token("rover/alive/resource_manager")
    fence(manager, "resource_manager")
    for name in NAMES:
        assert robots_at(site.endpoint, timeout=TIMEOUT, identity=site.identity(name)) == {"r1": "rover"}
        assert robots_at(site.endpoint, "r1", TIMEOUT, site.identity(name)) == {"r1": "rover"}
    token.undeclare()
