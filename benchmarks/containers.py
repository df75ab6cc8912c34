"""Size of the images, and start, idle load and stop of the system in docker-compose.yml.

python benchmarks/containers.py [--write]

Needs a container engine that answers. The images are built first, by SKILLWING_BUILD_ARGS such as
`--build-arg PIP_INDEX_URL=...`; the system gets ports and a name of its own.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from statistics import median

from performance_page import machine, table, write_section

from skillwing.services.viewer.viewer import free_port

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "containers.md"
BASE = os.environ.get("BASE") or "python:3.11-slim"
PROJECT = f"skillwing-measured-{os.getpid()}"
COMPOSE = ["--project-name", PROJECT]
EVERY_IMAGE = ["--profile", "mapping"]
"""Options that include the image of missions: without a profile it is left out."""
WITHIN = 300.0
"""Seconds for the system to come up."""
PACKAGES = "cd /opt/skillwing/lib/python3*/site-packages && du --summarize --block-size=1M *"
ROLES = {
    "manager": "router, bridge, managers, mocks, command line",
    "onboard": "guidance, obstacles, mapping, video",
    "sim": "the simulated drone and its radio link",
    "mission": "missions",
    "recorder": "the recorder",
    "viewer": "the web viewer",
}
LOOKS = 5


def _run(words: Sequence[str], environment: Mapping[str, str] | None = None) -> str:
    """Output of a command. A failure ends the measurement with its error output."""
    done = subprocess.run(words, cwd=ROOT, env=environment, check=False, capture_output=True, text=True)
    if done.returncode != 0:
        # Printed at once, because the removal of the containers may fail as well.
        sys.stderr.write(f"`{shlex.join(words)}` failed:\n{done.stderr.strip()}\n")
        sys.exit(1)
    return done.stdout


def _docker(*words: str) -> str:
    return _run(["docker", *words])


@cache
def _compose_program() -> tuple[str, ...]:
    """Compose v2, or docker-compose where the engine does not have it."""
    asked = subprocess.run(["docker", "compose", "version"], check=False, capture_output=True)
    return ("docker", "compose") if asked.returncode == 0 else ("docker-compose",)


def _compose(*words: str) -> float:
    """Run Compose; return the duration [s]."""
    begun = time.monotonic()
    ports = {name: str(free_port()) for name in ("ZENOH_PORT", "PAGE_PORT", "STREAM_PORT")}
    _run([*_compose_program(), *COMPOSE, *words], {**os.environ, **ports})
    return time.monotonic() - begun


def sizes() -> str:
    """Table of the images: size beyond the base image, and the largest packages."""
    base = _size(BASE)
    rows: list[list[str]] = []
    for role, use in ROLES.items():
        image = f"skillwing-{role}"
        listed = _docker("run", "--rm", "--network", "none", "--entrypoint", "sh", image, "-c", PACKAGES)
        packages = [line.split() for line in listed.splitlines()]
        largest = sorted(((int(size), name) for size, name in packages), reverse=True)[:4]
        told = ", ".join(f"{name} {size}" for size, name in largest)
        rows.append([f"`{image}`", use, f"{(_size(image) - base) / 1e6:.0f}", told])
    heads = ("image", "for", "adds to its base, MB", "largest folders of packages, MiB")
    return f"The base image has {base / 1e6:.0f} MB here.\n\n{table(heads, rows)}"


def _size(image: str) -> int:
    return int(_docker("image", "inspect", image, "--format", "{{.Size}}"))


@contextmanager
def _cleared_away() -> Iterator[None]:
    try:
        yield
    finally:
        _compose("down", "--volumes")


def life() -> str:
    """Table of the system without a mission: time to start, time to stop, and memory in between."""
    begun = time.monotonic()
    started = _compose("up", "--no-build", "--detach")
    _follow("viewer", "all .* run")
    complete = time.monotonic() - begun
    used = [_memory() for _ in range(LOOKS)]
    stopped = _compose("stop")
    names = _docker("ps", "--all", "--quiet", "--filter", f"label=com.docker.compose.project={PROJECT}").split()
    codes = _docker("inspect", *names, "--format", "{{.State.ExitCode}}").split()
    memory = {name: median(look[name] for look in used) for name in used[0]}
    managers = [memory.pop(name) for name in list(memory) if name.startswith("skill_")]
    others = sorted(memory.items(), key=lambda each: -each[1])
    rows = [
        ["`docker compose up -d` returns after", f"{started:.0f} s"],
        ["every process runs, and the viewer says so, after", f"{complete:.0f} s"],
        [f"containers, of which {codes.count('0')} ended with 0", str(len(codes))],
        ["`docker compose stop` takes", f"{stopped:.1f} s"],
        ["memory of a skill's manager, at most", f"{max(managers):.0f} MiB"],
        *([f"memory of `{name}`", f"{size:.0f} MiB"] for name, size in others),
    ]
    return f"The drone stands on its pad. Memory is the median of {LOOKS} looks.\n\n{table(('what', 'seen'), rows)}"


def _follow(service: str, pattern: str) -> None:
    """Wait for a line with the pattern in the service's log. End the measurement if none comes in time."""
    words = [*_compose_program(), *COMPOSE, "logs", "--follow", "--no-color", service]
    lines: list[str] = []
    found = None
    with subprocess.Popen(words, cwd=ROOT, stdout=subprocess.PIPE, text=True, start_new_session=True) as following:
        assert following.stdout is not None
        # The whole process group, because child processes hold the same pipe.
        late = threading.Timer(WITHIN, os.killpg, (following.pid, signal.SIGKILL))
        late.start()
        for line in following.stdout:
            lines.append(line)
            if found := re.search(pattern, line):
                break
        late.cancel()
        os.killpg(following.pid, signal.SIGKILL)
    if not found:
        told = "".join(lines)
        sys.exit(f"{told}{service} has ended, or {WITHIN:.0f} s have, before it said `{pattern}`. Above is its log.")


def _memory() -> dict[str, float]:
    """Memory by service [MiB], without the page cache."""
    lines = _docker("stats", "--no-stream", "--format", "{{json .}}").splitlines()
    found: dict[str, float] = {}
    for each in map(json.loads, lines):
        if each["Name"].startswith(PROJECT):
            amount, unit = re.fullmatch(r"([\d.]+)(KiB|MiB|GiB)", each["MemUsage"].split(" / ")[0]).groups()  # pyright: ignore[reportOptionalMemberAccess]
            service = each["Name"].removeprefix(f"{PROJECT}-").rpartition("-")[0]
            found[service] = float(amount) * {"KiB": 1 / 1024, "MiB": 1.0, "GiB": 1024.0}[unit]
    return found


def main() -> None:
    options = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    options.add_argument("--write", action="store_true", help="put the figures into docs/containers.md")
    given = options.parse_args()
    if shutil.which("docker") is None:
        sys.exit("There is no `docker` here. Install a container engine, and start it.")
    engine = _docker("version", "--format", "{{.Server.Version}}").strip()
    _compose(*EVERY_IMAGE, "build", *shlex.split(os.environ.get("SKILLWING_BUILD_ARGS", "")))
    with _cleared_away():
        body = f"{machine()}. Docker {engine}.\n\n{sizes()}\n\n{life()}"
        write_section("containers.py", "Measured", body, write=given.write, file=PAGE)


if __name__ == "__main__":
    main()
