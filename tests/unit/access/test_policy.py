"""The policy: what each role may do, written down by hand, and laws between its parts."""

from __future__ import annotations

from dataclasses import replace

import pytest

from skillwing.m600.robot import ROBOT
from skillwing.services.access.policy import (
    Grants,
    RobotAccess,
    SiteAccess,
    certificate_name,
    denial,
    guest_grants,
    person_grants,
    process_grants,
    refusal,
    role_at,
)
from skillwing.services.access.robots import robot_access
from skillwing.services.access.zenoh_rules import access_control
from skillwing.services.bus.keys import matches
from skillwing.services.protocol import ErrorCode, Keys
from skillwing.services.wire.channel import PEOPLE, Kind, Role
from skillwing.services.wire.channels import CHANNELS, keys_in

M600 = robot_access(ROBOT)
SKILLSET = ROBOT.load_skillset()
READS = {
    *("m600/skill/*/goal", "m600/resource/state", "m600/resource/ready", "m600/resource/robot", "m600/data/*"),
    "m600/mission/status",
}
STARTS = {"m600/skill/*/start", "m600/skill/*/interrupt", "m600/skill/*/modify"}
MISSIONS = {"m600/mission/abort", "m600/mission/pause", "m600/mission/resume"}
ON_BOARD = {"m600/mission/start"}
CHANGES = {"m600/resource/extern", "m600/event/*"}
MOCKS = {"m600/mock/skill/*", "m600/mock/world"}
TRIALS = {"fl/fault", "fl/fault/all", "fl/link/fault", "fl/pilot"}


def offered(grants: Grants) -> set[str]:
    return {*grants.streams, *grants.events, *grants.serves}


@pytest.mark.parametrize(
    ("role", "asks"),
    [
        (Role.VIEWER, READS),
        (Role.CLIENT, READS | STARTS | MISSIONS | ON_BOARD),
        (Role.OPERATOR, READS | STARTS | MISSIONS | ON_BOARD | CHANGES | MOCKS | TRIALS),
    ],
)
def test_a_person_may_ask_what_the_role_says(role: Role, asks: set[str]) -> None:
    assert person_grants(M600, role, "alice").asks == asks


def test_a_viewer_offers_nothing_and_a_client_its_mission() -> None:
    viewer, client = (person_grants(M600, role, "alice") for role in (Role.VIEWER, Role.CLIENT))
    assert offered(viewer) == viewer.tokens == set()
    assert client.tokens == {
        *("m600/alive/client/alice", "m600/alive/client/alice~$*", "m600/alive/mission", "fl/clock/done/alice~$*")
    }
    assert offered(client) == {
        *MISSIONS,
        *("m600/mission/status", "m600/mission/tree", "m600/timeline/by/alice", "fl/clock/done/alice~$*"),
    }


def test_a_skill_manager_offers_its_own_keys_only() -> None:
    land = process_grants(M600, "skill/land")
    own = {f"m600/skill/land/{end}" for end in ("start", "interrupt", "modify", "goal", "status", "progress")}
    shared = {"m600/timeline/by/m600.skill.land", "fl/clock/done/skill/land"}
    assert offered(land) == own | shared | {"m600/mock/skill/land", "m600/mock/goal/land"}
    assert {token for token in land.tokens if "client" not in token} == {
        *("m600/alive/skill/land", "fl/clock/done/skill/land")
    }


def test_only_the_resource_manager_offers_resources() -> None:
    for process in M600.processes:
        offers = {key for key in offered(process_grants(M600, process)) if "/resource/" in key}
        assert bool(offers) == (process == "resource_manager")


def test_a_process_of_the_layer_offers_its_own_topics_only() -> None:
    guidance = process_grants(M600, "guidance")
    assert {key for key in offered(guidance) if key.startswith("fl/")} == {
        *("fl/autopilot/setpoint", "fl/guidance/status", "fl/geofence", "fl/guidance/command"),
        "fl/clock/done/guidance",
    }
    assert "fl/clock" in process_grants(M600, "sim").streams
    assert "fl/guidance/command" in process_grants(M600, "skill/land").asks
    assert not {key for key in process_grants(M600, "data_manager").asks if key.startswith("fl/")}


def test_processes_of_a_layer_without_a_table_share_its_keys() -> None:
    robot = replace(M600, topics=())
    assert "fl/**" in process_grants(robot, "guidance").serves
    assert "fl/**" not in offered(process_grants(robot, "skill/land"))


def test_a_process_that_is_called_like_a_role_gets_nothing_from_that() -> None:
    robot = RobotAccess("r", "s", {"operator": Role.DATA_MANAGER, "resource manager": Role.RECORDER})
    assert "s/resource/extern" not in process_grants(robot, "operator").asks
    assert "s/resource/extern" not in process_grants(robot, "resource manager").serves


@pytest.mark.parametrize("role", PEOPLE)
@pytest.mark.parametrize("row", [row for row in CHANNELS if row.kind is Kind.QUERY], ids=lambda row: row.pattern)
def test_the_words_of_a_denial_agree_with_the_rules(role: Role, row: object) -> None:
    grants = person_grants(M600, role, "alice")
    for key in keys_in(SKILLSET, row):  # pyright: ignore[reportArgumentType]
        allowed = any(matches(each, key) for each in grants.asks)
        assert (refusal(role, "alice", key) is None) == allowed


def test_a_denial_names_the_role_that_would_do() -> None:
    denied = refusal(Role.VIEWER, "alice", Keys("m600").start("land"))
    assert denied is not None
    assert denied.code is ErrorCode.DENIED
    assert denied.message == "`alice` is a viewer and may not start skills."
    assert denied.help == "Ask for a certificate of role client."
    extern = refusal(Role.CLIENT, "bob", Keys("m600").resource_extern)
    assert extern is not None
    assert extern.help == "Ask for a certificate of role operator."
    fault = refusal(Role.CLIENT, "bob", "fl/fault")
    assert fault is not None
    assert fault.message == "`bob` is a client and may not ask or command the functional layer."
    mocks = refusal(Role.CLIENT, "bob", "m600/mock/skill/goto")
    assert mocks is not None
    assert mocks.message == "`bob` is a client and may not direct mocks."
    attach = refusal(Role.OPERATOR, "olga", Keys("m600").resource_attach)
    assert attach is not None
    assert attach.message == "`olga` is an operator and may not ask at `m600/resource/attach`."


def test_the_role_of_a_name_is_that_of_its_rules() -> None:
    yard = replace(YARD, works_at=("right",))
    site = SiteAccess((yard, LEFT, RIGHT), {"alice": Role.CLIENT})
    roles = {
        ("alice", "left"): Role.CLIENT,
        ("left.skill.land", "left"): Role.SKILL_MANAGER,
        ("left.skill.land", "right"): Role.VIEWER,
        ("left.sim", "right"): Role.FUNCTIONAL_LAYER,
        ("right.sim", "left"): None,
        ("yard.mission", "right"): Role.MISSION,
        ("yard.places", "right"): Role.VIEWER,
        ("left.mission", "elsewhere"): None,
        ("nobody", "left"): None,
    }
    assert {(name, robot): role_at(site, robot, name) for name, robot in roles} == roles


@pytest.mark.parametrize("process", ["resource_manager", "data_manager", "skill/land", "sim", "mission", "recorder"])
def test_a_process_is_denied_by_word_what_the_rules_deny(process: str) -> None:
    asks = process_grants(M600, process).asks
    for row in CHANNELS:
        for key in keys_in(SKILLSET, row) if row.kind is Kind.QUERY else ():
            denied = denial(M600.processes[process], "m600.x", key) is not None
            assert denied == (not any(matches(each, key) for each in asks)), key
    assert denial(M600.processes[process], "m600.x", "fl/guidance/command") is None
    assert denial("", "x", Keys("m600").start("land")) is None


def test_every_rule_is_within_one_robot_and_names_one_asker() -> None:
    second = replace(M600, name="second")
    rules = access_control(SiteAccess((M600, second), {"alice": Role.CLIENT}))
    assert rules["default_permission"] == "deny"
    assert len({rule["id"] for rule in rules["rules"]}) == len(rules["rules"])
    for rule in rules["rules"]:
        robot = rule["id"].partition(":")[0]
        assert all(key.startswith(f"robot/{robot}/") for key in rule["key_exprs"])
    asks = {
        key
        for rule in rules["rules"]
        if rule["messages"] == ["query"] and "alice" in rule["id"]
        for key in rule["key_exprs"]
    }
    assert asks
    assert all(key.endswith(("/by/alice", "/access/alice")) for key in asks)


def test_a_process_of_one_robot_has_no_rule_in_another_one() -> None:
    second = replace(M600, name="second")
    rules = access_control(SiteAccess((M600, second)))
    name = certificate_name("m600", "bridge")
    (policy,) = [policy for policy in rules["policies"] if policy["subjects"] == [name]]
    assert {rule.partition(":")[0] for rule in policy["rules"]} == {"m600", "*"}


def test_rules_for_all_robots_let_nobody_offer_anything() -> None:
    """Rules for all robots are for finding the robots at a router, and for asking whether the own name is known."""
    rules = access_control(SiteAccess((M600,), {"alice": Role.OPERATOR}))
    common = {(*rule["messages"], *rule["flows"]) for rule in rules["rules"] if rule["id"].startswith("*:")}
    assert common == {
        ("liveliness_query", "ingress"),
        ("liveliness_token", "egress"),
        ("query", "ingress"),
        ("reply", "egress"),
    }


# --- several robots --------------------------------------------------------------------------------------------------

YARD = RobotAccess("yard", "yard", {"places": Role.FUNCTIONAL_LAYER, "mission": Role.MISSION}, shared=("mission",))
LEFT = replace(M600, name="left", works_at=("right",))
RIGHT = replace(M600, name="right")


def rules_at(site: SiteAccess, robot: str, name: str) -> dict[str, set[str]]:
    """Keys of the rules for a certificate in a robot, by the last word of the rule."""
    rules = {rule["id"]: rule["key_exprs"] for rule in access_control(site)["rules"]}
    own = f"{robot}:{name}:"
    return {
        rule.removeprefix(own): {key.removeprefix(f"robot/{robot}/") for key in keys}
        for rule, keys in rules.items()
        if rule.startswith(own)
    }


def test_the_simulator_of_a_shared_world_offers_what_the_other_robots_own_one_would() -> None:
    site = SiteAccess((LEFT, RIGHT))
    granted = rules_at(site, "right", "left.sim")
    own = process_grants(RIGHT, "sim")
    ticks = {"fl/clock/done/sim", "fl/clock/done/sim@left"}
    assert {"fl/clock", "fl/imu", "fl/truth"} <= granted["publishes"]
    assert granted["publishes"] - ticks >= own.streams - ticks - {"m600/timeline/by/right.sim"}
    assert granted["answers"] >= {f"{key}/by/*" for key in own.serves}
    assert rules_at(site, "left", "right.sim") == {}, "only one of them flies both"


def test_a_mission_on_board_commands_the_other_robot_under_its_own_name() -> None:
    granted = guest_grants(RIGHT, LEFT, "mission")
    assert granted.asks == process_grants(RIGHT, "mission").asks >= STARTS
    assert "m600/alive/client/left.mission~$*" in granted.tokens
    assert "m600/alive/mission" in granted.tokens
    assert "m600/timeline/by/left.mission" in granted.events
    assert not {key for key in granted.tokens | offered(granted) if "right.mission" in key}


@pytest.mark.parametrize("process", ["resource_manager", "skill/land", "bridge", "guidance", "recorder", "launcher"])
def test_other_processes_only_read_the_other_robot(process: str) -> None:
    viewer = person_grants(RIGHT, Role.VIEWER, f"left.{process.replace('/', '.')}")
    assert guest_grants(RIGHT, LEFT, process) == viewer


def test_the_watch_of_a_yard_only_reads_a_drone() -> None:
    yard = replace(YARD, works_at=("right",))
    assert guest_grants(RIGHT, yard, "places").asks == READS
    assert not guest_grants(RIGHT, yard, "places").serves
    site = SiteAccess((yard, RIGHT))
    policy = next(each for each in access_control(site)["policies"] if each["subjects"] == ["yard.places"])
    assert {"right:listens", "right:hears", "right:recovers"} <= set(policy["rules"])


def test_nobody_reaches_a_robot_at_which_it_does_not_work() -> None:
    site = SiteAccess((YARD, LEFT, RIGHT))
    for policy in access_control(site)["policies"]:
        (name,) = policy["subjects"]
        robots = {rule.partition(":")[0] for rule in policy["rules"]} - {"*"}
        expected = {"left", "right"} if name.startswith("left.") else {name.partition(".")[0]}
        assert robots == expected, name
