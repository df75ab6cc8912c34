"""The mocks of docker-compose.yml on a real engine, with SKILLWING_CONTAINERS=1 only.

The image that is there is used, as it is; without one it is built, which takes minutes.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from skillwing.m600.mocked import ROBOT
from skillwing.services.client.connection import find_target, open_connection
from skillwing.services.names import RESOURCE_MANAGER
from skillwing.services.protocol import Keys

ROOT = Path(__file__).parents[2]
ENDPOINT = "tcp/127.0.0.1:7447"
IMAGE = "skillwing-manager"
UP_WITHIN = 120.0
READY = {"flight_status": "ON_GROUND", "homepoint_status": "VALID", "battery_status": "NORMAL"}
"""What the mocked world brings about, which comes up among the others."""


def works(*command: str) -> bool:
    return subprocess.run(command, check=False, capture_output=True).returncode == 0


def unavailable() -> str | None:
    """Why there is nothing to try here; None where an engine answers."""
    if os.environ.get("SKILLWING_CONTAINERS") != "1":
        return "containers are tried with SKILLWING_CONTAINERS=1 only"
    if shutil.which("docker") is None or not works("docker", "info"):
        return "no container engine answers (`docker info`)"
    return None


pytestmark = [
    pytest.mark.slow,
    pytest.mark.timeout(1800),
    pytest.mark.skipif((reason := unavailable()) is not None, reason=reason or ""),
]


def compose(*words: str) -> None:
    command = ["docker", "compose"] if works("docker", "compose", "version") else ["docker-compose"]
    subprocess.run([*command, "--project-name", "skillwing-test", *words], cwd=ROOT, check=True)


@pytest.fixture(scope="module")
def mocks() -> Iterator[None]:
    if not works("docker", "image", "inspect", IMAGE):
        compose("--profile", "mocks", "build", "router")
    try:
        compose("--profile", "mocks", "up", "--no-build", "-d", "mocks")
        yield
    finally:
        compose("--profile", "mocks", "down", "--volumes")


def test_mocks_in_containers_take_a_goal_through_the_published_port(mocks: None) -> None:
    target = find_target(endpoint=ENDPOINT, table=ROBOT.name)
    keys = Keys(ROBOT.skillset.stem)
    with open_connection(target, client="test") as connection:
        alive: set[str] = set()
        connection.bus.watch_alive(keys.alive("**"), lambda key, lives: (alive.add if lives else alive.discard)(key))
        wanted = {keys.alive(spec.name) for spec in ROBOT.managers()}
        assert keys.alive(RESOURCE_MANAGER) in wanted
        assert connection.bus.run_until(lambda: wanted <= alive, UP_WITHIN), wanted - alive
        interface = connection.make_interface("test")
        assert connection.bus.run_until(lambda: READY.items() <= interface.states.items(), UP_WITHIN), interface.states
        goal = interface.start("takeoff", {"height": 5.0, "speed": 1.0})
        assert connection.bus.run_until(lambda: goal.terminal is not None, UP_WITHIN)
        assert goal.terminal is not None
        assert goal.terminal.label == "S_AT_ALTITUDE", goal.terminal
