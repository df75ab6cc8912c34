"""`compose.yml`: the managers as containers, one each, and their router."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from skillwing.dsl.model import Skillset

_FRAME = """\
#
# The managers of `{robot}` as containers, one each, joined by the Zenoh router:
#
#   docker compose -f {package}/generated/compose.yml up
#
# The image is Skillwing's own (`docker build --target manager -t skillwing-manager .` in its sources). This package is
# mounted into it. Processes below the managers go into a second file, given with another -f. The only open port is
# 7447 for Zenoh, on loopback of the host. Valid for Compose v2 and for docker-compose 1.29.

x-process: &process
  init: true
  # Restarted after a crash, not after a normal end.
  restart: on-failure
  stop_grace_period: 10s
  cap_drop: [ALL]
  security_opt: ["no-new-privileges:true"]
  mem_limit: 256m
  pids_limit: 128
  logging: {{driver: json-file, options: {{max-size: 10m, max-file: "3"}}}}
  environment: &environment
    SKILLWING_CONNECT: tcp/router:7447
    SKILLWING_ROBOT: /robot/{package}
    SKILLWING_HEARTBEAT: /tmp/heartbeat
  depends_on:
    router: {{condition: service_healthy}}
  # The process touches this file from its node thread once a second, so an old file means a crash or a hang. The
  # interval is long because the engine starts a process for each check.
  healthcheck: &heartbeat
    test: ["CMD-SHELL", "test $$(( $$(date +%s) - $$(stat -c %Y /tmp/heartbeat) )) -lt 20"]
    interval: 30s
    timeout: 10s
    retries: 3
    start_period: 30s

x-manager: &manager
  <<: *process
  image: skillwing-manager
  volumes: ["..:/robot/{package}:ro"]

services:
  router:
    <<: *process
    image: skillwing-manager
    entrypoint: ["python3", "-m", "skillwing.services.processes.router"]
    command: ["--listen", "tcp/0.0.0.0:7447"]
    ports: ["127.0.0.1:${{ZENOH_PORT:-7447}}:7447"]
    # Without keys. Only the other containers and the host's loopback reach it.
    environment: {{SKILLWING_INSECURE: "1"}}
    depends_on: []
    healthcheck:
      test: ["CMD", "bash", "-c", ": < /dev/tcp/127.0.0.1/7447"]
      interval: 5s
      timeout: 10s
      retries: 6
"""


def lines(skillset: Skillset, package: str, managed: Collection[str]) -> Iterator[str]:
    """The lines of the file. package: name of the robot's folder. managed: the skills that have a manager."""
    yield from _FRAME.format(package=package, robot=skillset.name).splitlines()
    yield ""
    yield from manager_services(skillset, managed)


def manager_services(skillset: Skillset, managed: Collection[str]) -> Iterator[str]:
    """The services of the managers, as every compose file of the robot has them."""
    skills = [skill.name for skill in skillset.skills if skill.name in managed]
    services = ["data_manager", "resource_manager", *(f"skill/{skill}" for skill in skills)]
    for process in services:
        yield f"  {process.replace('/', '_')}: {{<<: *manager, command: [--process, {process}]}}"
