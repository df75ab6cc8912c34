"""Test files that share a worker, so that waiting tests leave the cores to others."""

from __future__ import annotations

BUSY = (
    # Systems of many processes, flights, commands by the dozen: any two of these files at once would share the cores.
    "fuzz/test_fuzz_processes.py",
    "history/test_resource_history.py",
    "integration/test_campaign_cluster.py",
    "integration/test_cli_processes.py",
    "integration/test_containers.py",
    "integration/test_demo.py",
    "integration/test_forklift_day.py",
    "integration/test_layouts.py",
    "integration/test_lockstep_flight.py",
    "integration/test_mission_on_board.py",
    "integration/test_mission_on_board_of_several.py",
    "integration/test_mock_command.py",
    "integration/test_plain_client.py",
    "integration/test_point_drone.py",
    "integration/test_several_robots.py",
    "integration/test_skillset_processes.py",
    "integration/test_system_ends.py",
    "integration/test_two_robots_in_one_world.py",
    "integration/test_typed_clients_zenoh.py",
    "integration/test_yard_on_mocks.py",
)
WAITING = (
    # Small systems, and waits for leases, keys, links, restarts and disks.
    "chaos/test_chaos.py",
    "integration/test_access_attacks.py",
    "integration/test_cli_commands.py",
    "integration/test_crashes_are_seen.py",
    "integration/test_frozen_reader.py",
    "integration/test_full_disk.py",
    "integration/test_keys_router.py",
    "integration/test_keys_system.py",
    "integration/test_keys_yard.py",
    "integration/test_leases_zenoh.py",
    "integration/test_m600_fault_command.py",
    "integration/test_operations.py",
    "integration/test_resource_manager_killed.py",
    "integration/test_router_command.py",
    "integration/test_router_tree.py",
    "links/test_absent_link.py",
    "links/test_links.py",
    "soak/test_full_disk_trial.py",
    "unit/recording/test_viewer.py",
)
GROUPS = {"busy": BUSY, "waiting": WAITING}
"""Files that start processes, by the name of their scope. A worker runs a group one test after the other.

Waiting tests use a third of a core, and run beside the busy ones, of which one at a time starts its processes. All
other workers calculate meanwhile, at a lower priority (conftest.py).
"""
CONFORMANCE = "conformance"
"""Scope of all files of this folder: their cases share a system of processes (conformance/conftest.py)."""
_SCOPES = {file: name for name, files in GROUPS.items() for file in files}


def scope_of(nodeid: str) -> str:
    """The group of a test's file, or else the file: a worker runs all that has the same."""
    file = nodeid.partition("::")[0].removeprefix("tests/")
    if file.startswith(f"{CONFORMANCE}/"):
        return CONFORMANCE
    return _SCOPES.get(file, file)


def starts_processes(nodeid: str) -> bool:
    """True for a test of a group or of conformance."""
    return scope_of(nodeid) in (*GROUPS, CONFORMANCE)
