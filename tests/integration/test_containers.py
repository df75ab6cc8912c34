"""docker-compose.yml on a real engine: images, keys, mocks, a flight and the shutdown (`make containers-test`).

The images are built first, from the current code; SKILLWING_BUILD_ARGS holds options of the build, as `--build-arg
PIP_INDEX_URL=...`. The project has a name and ports of its own, apart from those of running containers. The build
fetches packages, takes minutes and replaces the images `skillwing-*`. So it needs SKILLWING_CONTAINERS_TEST; without
it, an engine that answers only reads the file.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import signal
import socket
import subprocess
import threading
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from datetime import UTC, datetime
from http import HTTPStatus
from pathlib import Path
from urllib.request import urlopen

import pytest

from skillwing.m600.mocked import ROBOT as MOCKS
from skillwing.services.access.key_store import KeyStore
from skillwing.services.client.connection import Connection, find_target, open_connection
from skillwing.services.errors import KeysError, NoSystemError, NotKnownError, SkillwingError
from skillwing.services.protocol import Keys
from skillwing.services.recording.run_facts import read_facts
from skillwing.services.report.run_reports import write_reports
from skillwing.services.wire.channel import Role

ROOT = Path(__file__).parents[2]
PROJECT = f"skillwing-test-{os.getpid()}"
ROLES = ("manager", "onboard", "sim", "mission", "recorder", "viewer")
PROFILES = ("--profile", "mapping", "--profile", "mocks", "--profile", "cli")
CHOSEN = ("SEED", "WORLD", "SPEED", "FAULTS", "LINK", "SCENARIO", "HOST_ADDRESS")
PORTS = ("ZENOH_PORT", "PAGE_PORT", "STREAM_PORT")
WITHIN = 180.0
"""Longest wait for an event in containers on a busy machine [s]."""
DOWN_WITHIN = 60.0
LANDED_WITHIN = 120.0
READY = {"flight_status": "ON_GROUND", "homepoint_status": "VALID", "battery_status": "NORMAL"}
"""State changes of the mocked world, which starts among the others."""
CONTENTS = """
import os
from importlib.util import find_spec
names = ("pip", "numpy", "scipy", "mujoco", "embreex", "av", "py_trees", "rerun", "rerun_cli")
print(os.getuid(), *(name for name in names if find_spec(name)))
"""
FOLDER = "/home/skillwing/keys"
EXPIRED = """
from datetime import timedelta
from pathlib import Path
from skillwing.services.access import key_store
from skillwing.services.commands.keys import prepare
for certificate in Path("keys").glob("[rp]*/**/certificate.pem"):
    if certificate.parent.name != "alice":
        certificate.unlink()
then = key_store.utc_now() - timedelta(days=400)
key_store.utc_now = lambda: then
prepare(Path("keys"), ["m600", "m600-mocks"], [], ["cli"])
"""
"""A folder of keys as it was made 400 days ago."""
HEAVY = {
    "manager": "",
    "onboard": "numpy scipy av",
    "sim": "numpy scipy mujoco embreex av",
    "mission": "numpy py_trees",
    "recorder": "numpy rerun",
    "viewer": "rerun_cli",
}
"""Packages of one image that are not in all images."""


def works(*command: str) -> bool:
    try:
        return subprocess.run(command, check=False, capture_output=True, timeout=20).returncode == 0
    except (OSError, subprocess.TimeoutExpired):
        return False


def unavailable() -> str | None:
    """Reason to skip the tests; None if a container engine answers."""
    if shutil.which("docker") is None or not works("docker", "info"):
        return "no container engine answers (`docker info`)"
    if not works(*compose_program(), "version"):
        return "there is no `docker compose`"
    return None


def compose_program() -> list[str]:
    return ["docker", "compose"] if works("docker", "compose", "version") else ["docker-compose"]


ASKED = "SKILLWING_CONTAINERS_TEST"
pytestmark = [
    pytest.mark.slow,
    pytest.mark.timeout(2400),
    pytest.mark.skipif((reason := unavailable()) is not None, reason=reason or ""),
]


class Stack:
    """The containers of one project on free ports. ports: port numbers by variable of docker-compose.yml."""

    def __init__(self) -> None:
        self.ports = dict(zip(PORTS, free_ports(len(PORTS)), strict=True))
        self._program = [*compose_program(), "--project-name", PROJECT, *PROFILES]
        self._environment = {name: value for name, value in os.environ.items() if name not in CHOSEN}
        self._environment |= {name: str(port) for name, port in self.ports.items()}

    def compose(self, *words: str, check: bool = True, timeout: float = 1200.0) -> subprocess.CompletedProcess[str]:
        done = subprocess.run(
            [*self._program, *words],
            cwd=ROOT,
            env=self._environment,
            capture_output=True,
            text=True,
            check=False,
            timeout=timeout,
        )
        assert not check or done.returncode == 0, f"{shlex.join(words)}:\n{done.stdout}\n{done.stderr}"
        return done

    def run(self, *words: str, robot: str) -> subprocess.CompletedProcess[str]:
        """Run a command of the command line in a container of the project."""
        return self.compose("run", "--rm", "-T", "-e", f"SKILLWING_ROBOT={robot}", "cli", *words, check=False)

    def until(self, service: str, pattern: str) -> re.Match[str]:
        """Read a service's log until a line matches the pattern. Fail at the end of the log, or after `WITHIN`."""
        words = [*self._program, "logs", "--follow", "--no-color", service]
        lines: list[str] = []
        with subprocess.Popen(
            words, cwd=ROOT, env=self._environment, stdout=subprocess.PIPE, text=True, start_new_session=True
        ) as following:
            assert following.stdout is not None
            # Kill its child processes too, which hold the same pipe.
            late = threading.Timer(WITHIN, os.killpg, (following.pid, signal.SIGKILL))
            late.start()
            try:
                for line in following.stdout:
                    lines.append(line)
                    if found := re.search(pattern, line):
                        return found
            finally:
                late.cancel()
                os.killpg(following.pid, signal.SIGKILL)
        pytest.fail(f"{service} has ended, or {WITHIN:.0f} s have, without `{pattern}`:\n{''.join(lines)}")

    def codes(self) -> dict[str, int]:
        """Exit code of each service's container."""
        ids = self.compose("ps", "--all", "--quiet").stdout.split()
        inspected = subprocess.run(["docker", "inspect", *ids], check=True, capture_output=True, text=True)
        states = {each["Config"]["Labels"]["com.docker.compose.service"]: each for each in json.loads(inspected.stdout)}
        assert not [name for name, each in states.items() if each["State"]["Running"]]
        return {name: each["State"]["ExitCode"] for name, each in states.items()}

    def copied_out(self, service: str, path: str, into: Path) -> Path:
        """Files of an ended container, as by `docker compose cp`, which docker-compose 1.29 lacks."""
        (held,) = self.compose("ps", "--all", "--quiet", service).stdout.split()
        subprocess.run(["docker", "cp", f"{held}:{path}", str(into)], check=True, capture_output=True)
        return into / Path(path).name

    def left(self) -> list[str]:
        """Containers, networks and volumes of this project that are still there."""
        label = ["--quiet", "--filter", f"label=com.docker.compose.project={PROJECT}"]
        kinds = (["ps", "--all"], ["network", "ls"], ["volume", "ls"])
        found = (
            subprocess.run(["docker", *kind, *label], check=True, capture_output=True, text=True) for kind in kinds
        )
        return [each for done in found for each in done.stdout.split()]


def free_ports(count: int) -> list[int]:
    with ExitStack() as held:
        probes = [held.enter_context(closing(socket.create_server(("127.0.0.1", 0)))) for _ in range(count)]
        return [probe.getsockname()[1] for probe in probes]


@pytest.fixture(scope="module")
def images() -> Stack:
    """Build every image. Skip if the test was not requested, or the base image or packages are not available."""
    if not os.environ.get(ASKED):
        pytest.skip("builds images and flies in them: `make containers-test`")
    base = os.environ.get("BASE") or "python:3.11-slim"
    if not works("docker", "image", "inspect", base):
        pulled = subprocess.run(["docker", "pull", base], check=False, capture_output=True, text=True, timeout=600)
        if pulled.returncode != 0:
            pytest.skip(f"the engine cannot get {base}: {pulled.stderr.strip()}")
    stack = Stack()
    built = stack.compose("build", *shlex.split(os.environ.get("SKILLWING_BUILD_ARGS", "")), check=False, timeout=2000)
    if built.returncode != 0:
        told = built.stdout + built.stderr
        unreached = re.search(r"^.*No matching distribution found.*$", told, re.MULTILINE)
        if unreached is None:
            pytest.fail(f"build:\n{told}")
        pytest.skip(f"no packages can be had inside of a build (SKILLWING_BUILD_ARGS): {unreached[0].strip()}")
    return stack


@pytest.fixture
def stack(images: Stack) -> Iterator[Stack]:
    try:
        yield images
    finally:
        images.compose("down", "--volumes", "--timeout", "5")


def endpoint(stack: Stack, protocol: str = "tls") -> str:
    return f"{protocol}/127.0.0.1:{stack.ports['ZENOH_PORT']}"


@contextmanager
def connected(stack: Stack) -> Iterator[tuple[Connection, set[str]]]:
    """Connection through the published port, and the current alive tokens of the mocks."""
    alive: set[str] = set()
    target = find_target(endpoint=endpoint(stack), table=MOCKS.name)
    with open_connection(target, client="test") as connection:
        every = Keys(MOCKS.skillset.stem).alive("**")
        connection.bus.watch_alive(every, lambda key, lives: (alive.add if lives else alive.discard)(key))
        yield connection, alive


def test_the_engine_reads_the_file() -> None:
    services = Stack().compose("config", "--services", timeout=60.0).stdout.split()
    assert {"keys", "router", "sim", "mission", "mocks", "recorder", "viewer", "cli"} <= set(services)


@pytest.mark.parametrize("role", ROLES)
def test_an_image_holds_what_its_role_needs_and_runs_as_nobody_in_particular(images: Stack, role: str) -> None:
    asked = [
        "docker",
        "run",
        "--rm",
        "--network",
        "none",
        "--entrypoint",
        "python3",
        f"skillwing-{role}",
        "-c",
        CONTENTS,
    ]
    held = subprocess.run(asked, check=True, capture_output=True, text=True)
    assert held.stdout.split() == ["1000", *HEAVY[role].split()]
    history = subprocess.run(
        ["docker", "history", "--no-trunc", f"skillwing-{role}"], check=True, capture_output=True, text=True
    )
    assert "PIP_" not in history.stdout


def refuse_strangers(stack: Stack, foreign: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Fail if the published port lets in anybody without a key of this site."""
    monkeypatch.delenv("SKILLWING_KEYS", raising=False)
    refused(stack, "tls", KeysError)
    refused(stack, "tcp", NoSystemError)
    mallory = KeyStore.init(foreign, []).add_person("mallory", Role.OPERATOR)
    monkeypatch.setenv("SKILLWING_KEYS", str(mallory))
    refused(stack, "tls", NotKnownError)


def refused(stack: Stack, protocol: str, kind: type[SkillwingError]) -> None:
    with (
        pytest.raises(kind),
        open_connection(find_target(endpoint=endpoint(stack, protocol), table=MOCKS.name), client="stranger"),
    ):
        pass


def let_in(stack: Stack, name: str, into: Path) -> Path:
    """The folder of a new operator, made and copied as docs/containers.md says."""
    stack.compose("run", "--rm", "-T", "keys", "add", name, "--role", "operator")
    stack.compose("restart", "router", timeout=DOWN_WITHIN)
    return stack.copied_out("keys", f"{FOLDER}/people/{name}", into)


def days_left(stack: Stack) -> dict[str, int]:
    """Days of validity of each certificate of the project, negative after its end."""
    holders = json.loads(stack.compose("run", "--rm", "-T", "keys", "list", "--json").stdout)
    return {each["name"]: (datetime.fromisoformat(each["expires"]) - datetime.now(UTC)).days for each in holders}


def test_keys_outlive_the_containers_and_are_renewed(stack: Stack) -> None:
    stack.compose("run", "--rm", "-T", "keys")
    made = days_left(stack)
    assert {"router", "cli", "m600.sim", "m600.viewer", "m600-mocks.mocked_world"} <= made.keys()
    assert min(made.values()) >= 363
    stack.compose("run", "--rm", "-T", "keys", "add", "alice", "--role", "viewer")
    stack.compose("down", timeout=DOWN_WITHIN)
    assert days_left(stack).keys() == made.keys() | {"alice"}

    stack.compose("run", "--rm", "-T", "--entrypoint", "python3", "keys", "-c", EXPIRED)
    aged = days_left(stack)
    assert all(aged[name] < 0 for name in made), aged
    stack.compose("up", "--no-build", "--detach", "router")
    assert stack.compose("ps", "--quiet", "router").stdout.strip()
    renewed = days_left(stack)
    assert all(renewed[name] >= 363 for name in made), renewed


def test_mocks_take_goals_come_back_and_end_well(stack: Stack, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stack.compose("up", "--no-build", "--detach", "mocks")
    refuse_strangers(stack, tmp_path / "foreign", monkeypatch)
    monkeypatch.setenv("SKILLWING_KEYS", str(let_in(stack, "alice", tmp_path)))
    keys = Keys(MOCKS.skillset.stem)
    wanted = {keys.alive(spec.name) for spec in (*MOCKS.functional_layer({}), *MOCKS.managers())}
    hover = keys.alive("skill/hover")
    with connected(stack) as (connection, alive):
        assert connection.bus.run_until(lambda: wanted <= alive, WITHIN), wanted - alive
        interface = connection.make_interface("test")
        assert connection.bus.run_until(lambda: READY.items() <= interface.states.items(), WITHIN), interface.states

        flown = stack.run("start", "takeoff", "height=5", "speed=1", "--follow", robot=MOCKS.name)
        assert flown.returncode == 0, flown.stderr
        assert "AT_ALTITUDE" in flown.stdout
        begun = stack.run("start", "lock_head", "heading=0", robot=MOCKS.name)
        assert begun.returncode == 0, begun.stderr
        stopped = stack.run("interrupt", "lock_head", robot=MOCKS.name)
        assert stopped.returncode == 0, stopped.stderr
        goals = json.loads(stack.run("status", "--json", robot=MOCKS.name).stdout)["goals"]
        assert {goal["skill"]: goal["terminal"]["ending"] for goal in goals} == {"takeoff": "S", "lock_head": "IT"}

        # Kill every process in the container but its init, as a crash or the kernel would.
        stack.compose("exec", "-T", "mock_hover", "sh", "-c", "kill -9 -1", check=False)
        assert connection.bus.run_until(lambda: hover not in alive, WITHIN)
        assert connection.bus.run_until(lambda: hover in alive, WITHIN), "it is not started again"
        again = stack.run("start", "hover", "duration=0.1", "--follow", robot=MOCKS.name)
        assert again.returncode == 0, again.stdout + again.stderr

    stack.compose("stop", timeout=DOWN_WITHIN)
    codes = stack.codes()
    assert set(codes) == {name for name in codes if name in ("keys", "router") or name.startswith("mock")}
    assert codes == dict.fromkeys(codes, 0)
    stack.compose("down", "--volumes", timeout=DOWN_WITHIN)
    assert stack.left() == []


def test_the_mapping_mission_flies_tells_where_to_look_and_lands_when_it_is_stopped(
    stack: Stack, tmp_path: Path
) -> None:
    stack.compose("up", "--no-build", "--detach", "mission")
    page = stack.until("viewer", r"Open (http://\S+)")[1]
    with urlopen(page, timeout=WITHIN) as answer:
        assert answer.status == HTTPStatus.OK
    assert f"127.0.0.1:{stack.ports['PAGE_PORT']}/" in page and str(stack.ports["STREAM_PORT"]) in page
    stack.until("mission", r"\b1/4\b")

    stack.compose("stop", timeout=LANDED_WITHIN)
    codes = stack.codes()
    assert codes.pop("mission") == 1, "it was not flown to its end"
    assert codes == dict.fromkeys(codes, 0)
    told = stack.compose("logs", "--no-color", "mission").stdout
    assert "S_LANDED" in told, told
    (run,) = stack.copied_out("recorder", "/home/skillwing/runs", tmp_path).iterdir()
    ((folder, report),) = write_reports(run, read_facts(run), None)
    assert (report.mission, report.judged_value("collisions")) == ("mapping", 0)
    assert (folder / "report.md").exists()
    stack.compose("down", "--volumes", timeout=DOWN_WITHIN)
    assert stack.left() == []
