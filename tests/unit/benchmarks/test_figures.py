"""Tables of the latency benchmark and of the comparison with an earlier version."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from benchmark_scripts import script

checkouts = script("checkouts")
script("peer_process")
page = script("performance_page")
latency = script("latency")
recovery = script("recovery")
script("core_step")
script("message_costs")
against = script("bench_against")

CPU = {"client": 0.001, "skill/act": 0.0005, "resource_manager": 0.0005, "router": 0.0002, "mission": 0.004}


def block(slowness: float, actionlib: float | None = None) -> latency.Block:
    """A block of two calls of each kind on a machine that is slowed down by other load."""
    times = {"query": 0.0005, "hop": 0.00025, "dispatched": 0.001, "result": 0.002, "seen": 0.001}
    found = {kind: [slowness * each] * 2 for kind, each in times.items()}
    return latency.Block(**found, actionlib=[slowness * actionlib] * 2 if actionlib else [], cpu=CPU)


def rows_of(section: str) -> dict[str, list[str]]:
    lines = [line.strip("| ").split(" | ") for line in section.splitlines() if line.startswith("| ")]
    return {line[0]: line for line in lines}


def test_a_ratio_is_the_median_of_the_ratios_of_the_blocks() -> None:
    """One block under load changes times, and no ratio, if both series were slowed down."""
    blocks = [([1.0], [2.0]), ([10.0], [20.0]), ([1.0], [1.0])]
    assert page.block_ratio(blocks) == 0.5
    assert page.ratio(blocks) == "0.50 (0.50 to 1.00)"


def test_a_percentile_is_never_beyond_the_largest_value() -> None:
    assert page.percentile_99([1.0, 2.0, 3.0]) <= 3.0


def test_missed_targets_and_budgets_are_on_the_page() -> None:
    rows = rows_of(
        latency.section([block(1.0), block(1.0), block(4.0)], [block(2.0)] * 3, "ROS 1 is not installed here.")
    )
    dispatched = rows["start of a skill, until `on_dispatch`"]
    assert dispatched[3:] == ["p50 1.6: kept", "", "2.00 (2.00 to 2.00); budget 2.5: kept"]
    result = rows["start of a skill, until its result"]
    assert result[3:] == ["p50 2.7: kept; p99 6: **missed**", "2.2", "4.00 (4.00 to 4.00)"]
    assert rows["extern transition, until the mission's tree has seen `RI`"][-1].endswith("budget 2.5: **missed**")


def test_the_processor_time_of_a_start_is_that_of_the_processes_that_it_goes_through() -> None:
    rows = rows_of(latency.section([block(1.0)] * 2, [block(1.0)] * 2, ""))
    assert rows["**sum**"] == ["**sum**", "2.20"]
    assert rows["processes that listen"] == ["processes that listen", "4.00"]


def test_a_recorder_is_compared_in_the_same_blocks() -> None:
    rows = rows_of(latency.section([block(1.0), block(4.0)], [block(2.0), block(8.0)], ""))
    assert rows["with a recorder: start of a skill, until its result"][-1] == "2.00 (2.00 to 2.00)"


def test_actions_that_the_client_of_actionlib_notices_late_count_apart() -> None:
    section = latency.section([block(1.0, 0.001), block(1.0, 0.1)], [block(1.0)] * 2, "")
    row = rows_of(section)["rospy + actionlib: start of an action, until its result"]
    assert row[-1] == "50% of the calls took more than 50 ms; ours to the others: 2.00"


def test_an_actionlib_without_a_quick_call_has_no_ratio() -> None:
    section = latency.section([block(1.0, 0.1)], [block(1.0)], "")
    assert "| 100% of the calls took more than 50 ms |" in section


def test_a_target_is_held_to_the_figure_before_it_is_rounded() -> None:
    rows = rows_of(latency.section([block(2.701 / 2)], [block(1.0)], ""))
    assert rows["start of a skill, until its result"][1:4] == ["2.70", "2.70", "p50 2.7: **missed**; p99 6: kept"]


def test_an_actionlib_that_fell_silent_has_no_row() -> None:
    section = latency.section([block(1.0, 0.001), block(1.0)], [block(1.0)] * 2, "")
    assert "rospy" not in section
    assert "ROS 1 did not answer in time." in section


def test_a_mesh_is_compared_with_the_router_in_the_same_blocks() -> None:
    rows = rows_of(latency.mesh_section([block(1.0), block(8.0)], [block(0.5), block(4.0)]))
    assert rows["start of a skill, until its result"][3] == "0.50 (0.50 to 0.50)"


def test_a_missed_recovery_target_is_on_the_page() -> None:
    assert "| p50 10: **missed** | 200 |" in recovery.section([0.21, 0.22], 0.2)


def test_a_line_has_both_versions_and_the_median_of_their_ratios() -> None:
    line = against.Line("start", [1.0, 8.0, 1.0], [2.0, 16.0, 1.0])
    assert line.cells() == ["start", "1.00", "2.00", "0.50 (0.50 to 1.00)"]


def test_what_the_other_version_lacks_is_said_in_its_cell() -> None:
    assert against.by_name("start", {"now": [1.0]}).cells() == ["start", "1.00", "not there", ""]


def test_a_benchmark_that_fails_with_the_other_version_is_measured_with_this_one() -> None:
    def run(tree: Path) -> int:
        if tree == Path("then"):
            raise subprocess.CalledProcessError(1, "benchmark")
        return 1

    assert against.in_turns({"now": Path("now"), "then": Path("then")}, run, 2) == {"now": [1, 1]}
    with pytest.raises(subprocess.CalledProcessError):
        against.in_turns({"now": Path("then")}, run, 1)


def test_a_temporary_checkout_is_removed_and_its_code_is_imported() -> None:
    with checkouts.worktree("HEAD") as (name, tree):
        assert name
        command = [sys.executable, "-P", "-c", "import skillwing.services as found; print(found.__file__)"]
        found = subprocess.run(command, env=checkouts.code_of(tree), stdout=subprocess.PIPE, text=True, check=True)
        assert Path(found.stdout.strip()).is_relative_to(tree)
    assert not tree.exists()
    command = ["git", "worktree", "list", "--porcelain"]
    known = subprocess.run(command, cwd=checkouts.ROOT, stdout=subprocess.PIPE, text=True, check=True)
    assert str(tree) not in known.stdout


def test_an_unknown_revision_is_an_error() -> None:
    with pytest.raises(ValueError, match="There is no revision `nowhere`"), checkouts.worktree("nowhere"):
        pass
