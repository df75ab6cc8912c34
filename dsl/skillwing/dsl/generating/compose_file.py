"""`compose.yml`: the managers as containers, one each, their router, and the keys of all."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from skillwing.dsl.model import Skillset

_FRAME = """\
#
# The managers of `{robot}` as containers, one each, joined by the Zenoh router:
#
#   docker compose -p {package} -f {package}/generated/compose.yml up
#   docker compose -p {package} -f {package}/generated/compose.yml run --rm cli status
#
# The image is Skillwing's own (`docker build --target manager -t skillwing-manager .` in its sources). This package is
# mounted into it. Processes below the managers go into a second file, given with another -f. The only open port is
# 7447 for Zenoh, on loopback of the host. Valid for Compose v2 and for docker-compose 1.29.
#
# The service `keys` makes certificates for all of them in volumes, before the router starts. Nobody else reaches the
# robot. For yourself: `... run --rm keys add NAME --role operator`, then restart the router. HOST_ADDRESS opens an IPv4
# address of the host, for other machines; by default it is loopback.

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
    SKILLWING_CONNECT: tls/router:7447
    SKILLWING_KEYS: /home/skillwing/keys
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
  volumes:
    - &package "..:/robot/{package}:ro"
    # The keys of the robot's processes. Only `keys` has the authority, which could let in anybody.
    - robot_keys:/home/skillwing/keys/robots:ro

services:
  # Makes the keys at the first start, and renews them at others. It has no network.
  keys:
    <<: *process
    image: skillwing-manager
    entrypoint: ["skillwing", "keys"]
    command:
      [prepare, --robot=/robot/{package}, --host=router, "--host=${{HOST_ADDRESS:-127.0.0.1}}", --operator=cli]
    network_mode: none
    restart: "no"
    healthcheck: {{disable: true}}
    environment: {{}}
    depends_on: []
    volumes:
      - *package
      - site_keys:/home/skillwing/keys
      - authority:/home/skillwing/keys/authority
      - robot_keys:/home/skillwing/keys/robots
      - people_keys:/home/skillwing/keys/people
      - cli_keys:/home/skillwing/keys/people/cli

  router:
    <<: *process
    image: skillwing-manager
    entrypoint: ["python3", "-m", "skillwing.services.processes.router"]
    command: ["--listen", "tls/0.0.0.0:7447", "--keys", "/home/skillwing/keys"]
    ports: ["${{HOST_ADDRESS:-127.0.0.1}}:${{ZENOH_PORT:-7447}}:7447"]
    environment: {{}}
    depends_on:
      keys: {{condition: service_completed_successfully}}
    # Its certificate, and the names that it lets in.
    volumes: ["site_keys:/home/skillwing/keys:ro"]
    healthcheck:
      test: ["CMD", "bash", "-c", ": < /dev/tcp/127.0.0.1/7447"]
      interval: 5s
      timeout: 10s
      retries: 6

  cli:
    <<: *process
    image: skillwing-manager
    profiles: ["cli"]
    entrypoint: ["skillwing"]
    command: ["status"]
    restart: "no"
    healthcheck: {{disable: true}}
    volumes: [*package, "cli_keys:/home/skillwing/keys:ro"]

"""
_VOLUMES = """
volumes:
  # Keys: the router's and all names; the authority; the robot's processes; people; the command line's.
  site_keys:
  authority:
  robot_keys:
  people_keys:
  cli_keys:
"""


def lines(skillset: Skillset, package: str, managed: Collection[str]) -> Iterator[str]:
    """The lines of the file. package: name of the robot's folder. managed: the skills that have a manager."""
    yield from _FRAME.format(package=package, robot=skillset.name).splitlines()
    yield from manager_services(skillset, managed)
    yield from _VOLUMES.splitlines()


def manager_services(skillset: Skillset, managed: Collection[str]) -> Iterator[str]:
    """The services of the managers, as every compose file of the robot has them."""
    skills = [skill.name for skill in skillset.skills if skill.name in managed]
    services = ["data_manager", "resource_manager", *(f"skill/{skill}" for skill in skills)]
    for process in services:
        yield f"  {process.replace('/', '_')}: {{<<: *manager, command: [--process, {process}]}}"
