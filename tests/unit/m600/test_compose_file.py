"""docker-compose.yml starts what the robot's table says: every process once, in an image that has what it needs."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
import yaml

from skillwing.bt_missions.running.library import installed_missions
from skillwing.m600.mocked import ROBOT as MOCKS
from skillwing.m600.robot import ROBOT
from skillwing.services.processes.run_options import RUN_OPTIONS
from skillwing.services.robot import ProcessSpec, Robot

ROOT = Path(__file__).parents[3]
SERVICES: dict[str, dict[str, Any]] = yaml.safe_load((ROOT / "docker-compose.yml").read_text())["services"]
HOSTED = {name: service for name, service in SERVICES.items() if "--process" in service.get("command", ())}
RUN = {"run_dir": "/home/skillwing/runs/containers"}
FOR_EVERY_PROCESS = {"CONNECT", "ROBOT", "HEARTBEAT"}


def table(robot: Robot) -> dict[str, ProcessSpec]:
    """What runs in containers; mocks are not recorded there, and do with the small image."""
    observers = robot.observers(RUN) if robot is ROBOT else ()
    specs = (*robot.functional_layer(RUN), *robot.managers(RUN), *observers)
    return {spec.name: spec for spec in specs}


def hosted(robot: Robot) -> dict[str, dict[str, Any]]:
    """The services of a robot, by the process that they host."""
    found = [service for service in HOSTED.values() if service["environment"]["SKILLWING_ROBOT"] == robot.name]
    assert len({service["command"][-1] for service in found}) == len(found), "two containers host the same process"
    return {service["command"][-1]: service for service in found}


@pytest.mark.parametrize("robot", [ROBOT, MOCKS], ids=lambda robot: robot.name)
def test_every_process_of_the_table_has_a_container_with_the_image_that_it_needs(robot: Robot) -> None:
    processes, services = table(robot), hosted(robot)
    assert services.keys() == processes.keys()
    for name, spec in processes.items():
        assert services[name]["image"] == ("skillwing-manager" if spec.extra is None else "skillwing"), name


def test_what_starts_by_itself_is_the_robot_and_mocks_and_missions_start_when_they_are_asked_for() -> None:
    by_itself = {name for name, service in SERVICES.items() if not service.get("profiles")}
    assert by_itself == {name.replace("/", "_") for name in table(ROBOT)} | {"router", "viewer"}
    profiles = {profile for service in SERVICES.values() for profile in service.get("profiles", ())}
    assert profiles == {"mapping", "inspection", "mocks"}
    flown = [service["command"][0] for service in SERVICES.values() if service.get("entrypoint", ("",))[-1] == "run"]
    assert sorted(flown) == sorted(installed_missions())


def test_who_asks_for_the_mocks_gets_all_of_them_and_nothing_else() -> None:
    mocks = {name for name, service in SERVICES.items() if service.get("profiles") == ["mocks"]}
    assert {"mocks", *SERVICES["mocks"]["depends_on"]} == mocks | {"router"}


@pytest.mark.parametrize("name", HOSTED)
def test_a_process_is_watched_over_and_ended_well(name: str) -> None:
    service = SERVICES[name]
    assert service["init"] is True
    assert service["environment"]["SKILLWING_HEARTBEAT"] in service["healthcheck"]["test"][-1]
    assert service["depends_on"]["router"] == {"condition": "service_healthy"}


def test_only_loopback_of_the_host_is_opened_and_nobody_has_rights_of_the_engine() -> None:
    ports = [port for service in SERVICES.values() for port in service.get("ports", ())]
    assert ports
    assert all(re.fullmatch(r"127\.0\.0\.1:\d+:\d+", port) for port in ports)
    for service in SERVICES.values():
        assert service.keys().isdisjoint({"privileged", "network_mode", "cap_add", "pid", "user"})


def test_variables_are_those_that_processes_read() -> None:
    known = {f"SKILLWING_{name}" for name in FOR_EVERY_PROCESS | {option.upper() for option in RUN_OPTIONS}}
    for name, service in HOSTED.items():
        assert service["environment"].keys() <= known, name


def test_both_images_run_as_a_user_without_rights() -> None:
    stages = re.split(r"^FROM ", (ROOT / "Dockerfile").read_text(), flags=re.MULTILINE)
    for target in ("manager", "full"):
        (stage,) = (stage for stage in stages if re.match(rf"\S+ AS {target}\n", stage))
        assert re.findall(r"^USER (\S+)$", stage, flags=re.MULTILINE) == ["skillwing"]
