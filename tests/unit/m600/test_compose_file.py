"""docker-compose.yml starts the processes of the robot's table: each once, in an image with all that it needs."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

import image_imports
import pytest
import yaml
from compose_services import COMPOSE_FILE, renewed

from skillwing.bt_missions.library import installed_missions
from skillwing.m600.mocked import ROBOT as MOCKS
from skillwing.m600.robot import ROBOT
from skillwing.services.processes.run_options import RUN_OPTIONS, run_options
from skillwing.services.robot import ProcessSpec, Robot

ROOT = Path(__file__).parents[3]
SERVICES: dict[str, dict[str, Any]] = yaml.safe_load(COMPOSE_FILE.read_text())["services"]
HOSTED = {name: service for name, service in SERVICES.items() if "--process" in service.get("command", ())}
IMAGES = {
    None: "skillwing-manager",
    "onboard": "skillwing-onboard",
    "sim": "skillwing-sim",
    "viewer": "skillwing-recorder",
}
"""Image of a process, by the extra that the process needs."""
RUN = {"run_dir": "/home/skillwing/runs/containers"}
FOR_EVERY_PROCESS = {"CONNECT", "KEYS", "ROBOT", "HEARTBEAT"}
FOLDER = "/home/skillwing/keys"
KEYS_OF = {
    "keys": {
        "site_keys": "",
        "authority": "/authority",
        "robot_keys": "/robots/m600",
        "mock_keys": "/robots/m600-mocks",
        "people_keys": "/people",
        "cli_keys": "/people/cli",
    },
    "router": {"site_keys": ""},
    "cli": {"cli_keys": ""},
}
"""Places of volumes in the folder of keys, by service. All other services have the volume of their robot."""
FACTORY = re.compile(r"skillwing[\w.]*:\w+")


def table(robot: Robot) -> dict[str, ProcessSpec]:
    """Services in containers; mocks are not recorded and need only the small image."""
    observers = robot.observers(RUN) if robot is ROBOT else ()
    specs = (*robot.functional_layer(RUN), *robot.managers(RUN), *observers)
    return {spec.name: spec for spec in specs}


def hosted(robot: Robot) -> dict[str, dict[str, Any]]:
    """The services of a robot, by the process that they host."""
    found = [service for service in HOSTED.values() if service["environment"]["SKILLWING_ROBOT"] == robot.name]
    assert len({service["command"][-1] for service in found}) == len(found), "two containers host the same process"
    return {service["command"][-1]: service for service in found}


def test_the_services_of_skills_follow_the_skillset() -> None:
    text = COMPOSE_FILE.read_text("utf-8")
    assert renewed(text, [skill.name for skill in ROBOT.load_skillset().skills]) == text, "run `make generate`"
    assert "skill_wave: {<<: *manager, command: [--process, skill/wave]}" in renewed(text, ["wave"])


@pytest.mark.parametrize("robot", [ROBOT, MOCKS], ids=lambda robot: robot.name)
def test_every_process_of_the_table_has_a_container_with_the_image_that_it_needs(robot: Robot) -> None:
    processes, services = table(robot), hosted(robot)
    assert services.keys() == processes.keys(), "run `make generate`; what is no skill is written by hand"
    for name, spec in processes.items():
        assert services[name]["image"] == IMAGES[spec.extra], name


def imported_in(image: str) -> set[str]:
    """Modules and functions that the processes of an image import by name."""
    specs = [spec for robot in (ROBOT, MOCKS) for spec in table(robot).values() if IMAGES[spec.extra] == image]
    found = {each for spec in specs for each in FACTORY.findall(json.dumps(asdict(spec), default=str))}
    if image == "skillwing-viewer":
        found.add("skillwing.services.viewer.web_viewer:make_web_viewer")
    if image == "skillwing-mission":
        found |= {"skillwing.services.terminal.cli"} | {entry.value for entry in installed_missions().values()}
    return found


@pytest.mark.parametrize("image", sorted({service["image"] for service in SERVICES.values()}))
def test_an_image_has_the_packages_that_its_processes_import(image: str) -> None:
    lock = ROOT / "locks" / f"{image.removeprefix('skillwing-')}.lock"
    # The viewer's image has Rerun as a program, and no packages beyond the manager's.
    lock = lock if lock.exists() else ROOT / "locks" / "manager.lock"
    wanted = imported_in(image)
    assert wanted
    words = [sys.executable, str(Path(image_imports.__file__)), str(lock), *sorted(wanted)]
    done = subprocess.run(words, check=False, capture_output=True, text=True, timeout=120)
    assert (done.stdout, done.returncode) == ("", 0), done.stderr


def test_what_starts_by_itself_is_the_robot_and_mocks_and_missions_start_when_they_are_asked_for() -> None:
    by_itself = {name for name, service in SERVICES.items() if not service.get("profiles")}
    assert by_itself == {name.replace("/", "_") for name in table(ROBOT)} | {"keys", "router", "viewer"}
    profiles = {profile for service in SERVICES.values() for profile in service.get("profiles", ())}
    assert profiles == {"mapping", "inspection", "mocks", "cli"}
    flown = [service["command"][0] for service in SERVICES.values() if service["image"] == "skillwing-mission"]
    assert sorted(flown) == sorted(installed_missions())


@pytest.mark.parametrize("name", SERVICES)
def test_no_image_is_looked_for_in_a_registry(name: str) -> None:
    """All images are built here. A registry may hold a foreign image of the same name."""
    assert SERVICES[name]["pull_policy"] == "never"


def test_who_asks_for_the_mocks_gets_all_of_them_and_nothing_else() -> None:
    mocks = {name for name, service in SERVICES.items() if service.get("profiles") == ["mocks"]}
    assert {"mocks", *SERVICES["mocks"]["depends_on"]} == mocks | {"router"}
    assert SERVICES["router"]["depends_on"].keys() == {"keys"}


def key_volumes(name: str) -> dict[str, tuple[str, str]]:
    """The volumes with keys of a service: place and mode by name."""
    found = [volume.split(":") for volume in SERVICES[name]["volumes"] if isinstance(volume, str)]
    return {volume: (place, (*mode, "rw")[0]) for volume, place, *mode in found if volume != "runs"}


@pytest.mark.parametrize("name", SERVICES)
def test_a_container_has_the_keys_that_it_needs_and_no_others(name: str) -> None:
    """The authority lets in anybody. `keys` alone has it, writes, and has no network."""
    robot = "mock_keys" if SERVICES[name].get("profiles") == ["mocks"] else "robot_keys"
    mode = "rw" if name == "keys" else "ro"
    wanted = KEYS_OF.get(name, {robot: ""})
    assert key_volumes(name) == {volume: (f"{FOLDER}{place}", mode) for volume, place in wanted.items()}
    assert SERVICES[name].get("network_mode") == ("none" if name == "keys" else None)


def test_nobody_reaches_the_router_without_keys() -> None:
    assert SERVICES["router"]["command"] == ["--listen", "tls/0.0.0.0:7447", "--keys", FOLDER]
    assert SERVICES["router"]["depends_on"]["keys"] == {"condition": "service_completed_successfully"}
    for service in SERVICES.values():
        assert "SKILLWING_INSECURE" not in service["environment"]
        assert service["environment"].get("SKILLWING_CONNECT", "tls/router:7447") == "tls/router:7447"


def test_the_keys_are_those_of_both_robots_the_command_line_and_the_router_s_hosts() -> None:
    action, *words = SERVICES["keys"]["command"]
    assert action == "prepare"
    assert set(words) == {
        f"--robot={ROBOT.name}",
        f"--robot={MOCKS.name}",
        "--host=router",
        "--host=${HOST_ADDRESS:-127.0.0.1}",
        "--operator=cli",
    }


@pytest.mark.parametrize("name", HOSTED)
def test_a_process_is_watched_over_and_ended_well(name: str) -> None:
    service = SERVICES[name]
    assert service["init"] is True
    assert service["environment"]["SKILLWING_HEARTBEAT"] in service["healthcheck"]["test"][-1]
    assert service["depends_on"]["router"] == {"condition": "service_healthy"}


@pytest.mark.parametrize("name", SERVICES)
def test_a_container_has_bounds_and_no_rights_beyond_its_own(name: str) -> None:
    service = SERVICES[name]
    assert service.keys().isdisjoint({"privileged", "cap_add", "pid", "user"})
    assert service["cap_drop"] == ["ALL"]
    assert service["security_opt"] == ["no-new-privileges"]
    assert service["mem_limit"] and service["pids_limit"]
    assert service["read_only"] or name in ("resource_manager", "recorder"), "these two write things down"


def test_what_dies_is_started_again_as_the_table_says() -> None:
    for robot in (ROBOT, MOCKS):
        for name, spec in table(robot).items():
            wanted = "on-failure" if spec.restart == "always" else "no"
            assert hosted(robot)[name]["restart"] == wanted, name
    assert SERVICES["router"]["restart"] == SERVICES["viewer"]["restart"] == "on-failure"


def test_a_mission_stops_before_the_robot_does() -> None:
    robot = {name.replace("/", "_") for name in table(ROBOT)} | {"router"}
    for mission in installed_missions():
        (service,) = (each for each in SERVICES.values() if each.get("command") == [mission])
        assert service["depends_on"].keys() == robot
        assert service["stop_signal"] == "SIGINT", "SIGTERM would leave the drone to itself"


def test_the_viewer_tells_the_addresses_that_are_opened() -> None:
    (word,) = (word for word in SERVICES["viewer"]["command"] if word.startswith("--options="))
    told = json.loads(word.removeprefix("--options="))
    ports = [port.rpartition(":")[0] for port in SERVICES["viewer"]["ports"]]
    assert ports == [told["page"], told["stream"]]


def test_only_loopback_of_the_host_is_opened_and_another_address_with_keys() -> None:
    opened = {name: service["ports"] for name, service in SERVICES.items() if "ports" in service}
    assert opened.pop("router") == ["${HOST_ADDRESS:-127.0.0.1}:${ZENOH_PORT:-7447}:7447"]
    # A viewer asks nobody for keys.
    assert opened.keys() == {"viewer"}
    assert all(re.fullmatch(r"127\.0\.0\.1:\$\{[A-Z_]+:-(\d+)\}:\1", port) for port in opened["viewer"])


def test_variables_are_those_that_processes_read() -> None:
    known = {f"SKILLWING_{name}" for name in FOR_EVERY_PROCESS | {option.upper() for option in RUN_OPTIONS}}
    for name, service in HOSTED.items():
        assert service["environment"].keys() <= known, name


def test_the_recorder_alone_takes_the_size_of_a_run() -> None:
    keeps = {name: service["environment"].get("SKILLWING_KEEP") for name, service in HOSTED.items()}
    assert {name: value for name, value in keeps.items() if value is not None} == {"recorder": "${KEEP:-}"}
    options = run_options({"SKILLWING_KEEP": "2GB", "SKILLWING_RUN_DIR": "runs/one"})
    assert ROBOT.process("recorder", options).options["keep"] == 2_000_000_000
    assert run_options({"SKILLWING_KEEP": ""}) == {}, "as the file passes it by default"


PIP_ARGUMENTS = {"PIP_INDEX_URL", "PIP_EXTRA_INDEX_URL", "PIP_TRUSTED_HOST", "PIP_CERT"}


def stages() -> dict[str, str]:
    """The stages of the Dockerfile by name."""
    parts = re.split(r"^FROM (?=\S+ AS )", (ROOT / "Dockerfile").read_text(), flags=re.MULTILINE)[1:]
    return {part.split()[2]: part for part in parts}


def test_each_image_is_built_by_one_service_and_runs_as_a_user_without_rights() -> None:
    """Compose v2 builds an image as often as services ask for it."""
    builds: dict[str, list[str]] = {}
    for name, service in SERVICES.items():
        target = service["build"]["target"] if "build" in service else None
        assert target is None or service["image"] == f"skillwing-{target}", name
        builds.setdefault(service["image"].removeprefix("skillwing-"), []).extend([target] if target else [])
    # Only one of the missions is flown at a time.
    assert {role: len(targets) for role, targets in builds.items()} == {
        "manager": 1,
        "onboard": 1,
        "sim": 1,
        "recorder": 1,
        "viewer": 1,
        "mission": 2,
    }
    for role in builds:
        assert re.findall(r"^USER (\S+)$", stages()[role], flags=re.MULTILINE) == ["skillwing"]


def test_everything_is_installed_by_hash_and_nothing_of_how_stays_in_an_image() -> None:
    """Build arguments, which may hold a password, are in the history of the stage that declares them."""
    (installed,) = re.findall(r"pip\b.* install .*", (ROOT / "locks" / "install.sh").read_text())
    assert "--require-hashes" in installed
    for name, stage in stages().items():
        for line in re.findall(r"pip\b.* install .*", stage):
            assert "--require-hashes -r locks/" in line or line.rstrip().endswith("/wheel/*.whl"), line
        built_on = stage.split()[0]
        # The classic builder passes arguments on to no stage that does not declare them.
        told = re.findall(r"^ARG (PIP_\w+)$", stage, flags=re.MULTILINE)
        assert set(told) == (PIP_ARGUMENTS if built_on == "packages" or name == "packages" else set()), name
        if name in {service["image"].removeprefix("skillwing-") for service in SERVICES.values()}:
            assert built_on == "runtime"


@pytest.mark.parametrize("role", ["onboard", "sim", "mission", "recorder"])
def test_all_images_have_the_same_versions(role: str) -> None:
    """Packages of the environment are not installed again, because another version would remain there."""
    pins = {name: pinned(ROOT / "locks" / f"{name}.lock") for name in ("manager", role)}
    assert pins["manager"] <= pins[role]
    assert pins[role] <= pinned(ROOT / "requirements.lock")


def pinned(lock: Path) -> set[str]:
    return set(re.findall(r"^[a-z0-9._-]+==[^\\\n]*", lock.read_text(), flags=re.MULTILINE))
