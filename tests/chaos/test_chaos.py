"""A handful of cells of the chaos matrix, and what its tables tell. `make chaos` does all of it."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import chaos_run
import pytest
from first_effects import first_effects
from flights_with_faults import FlightCell, FlightResult, Moment, flight_cells
from msgspec.structs import replace as changed
from signs import Fault, Sign, exit_problems
from stand import Cell, Result, Stand
from stand_nodes import STAND
from tables import flight_table, manager_table

from cause_chains import ChainProblem, InjectedFault, bad_chains
from skillwing.dsl import load
from skillwing.dsl.model import Skillset
from skillwing.m600.robot import ROBOT
from skillwing.services.history.history import History
from skillwing.services.protocol import Record, RecordKind

RESULT = Result(Cell("router", Fault.KILL, "RUNNING"), Sign(0.01, "launcher"), "S_DONE", False, 5.0, 5.0, 0.1)
FLIGHT = FlightResult(
    cell=FlightCell("guidance", Fault.KILL, Moment.CRUISE),
    noticed=Sign(0.01, "launcher"),
    lost=("goto ERROR",),
    mission="SUCCEEDED",
    landed=60.0,
    from_home=0.1,
    failsafe=True,
    collisions=0,
    left_fence=False,
    world_ended=False,
)


@pytest.fixture(scope="module")
def stand(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stand]:
    with pytest.MonkeyPatch.context() as patch:
        inherited = os.environ.get("PYTHONPATH", "")
        patch.setenv("PYTHONPATH", os.pathsep.join(filter(None, [str(Path(__file__).parent), inherited])))
        with Stand(tmp_path_factory.mktemp("stand")) as stand:
            yield stand


@pytest.mark.slow
@pytest.mark.parametrize(
    ("process", "fault", "state"),
    [
        ("router", Fault.KILL, "INTERRUPTING"),
        ("resource_manager", Fault.KILL, "DISPATCHING"),
        ("skill/work", Fault.STOP, "RUNNING"),
        ("skill/work", Fault.KILL, "RUNNING"),
        ("mission", Fault.KILL, "RUNNING"),
    ],
)
def test_what_dies_or_freezes_is_noticed_and_everything_is_well_again(
    stand: Stand, process: str, fault: Fault, state: str
) -> None:
    assert stand.make_sound()
    result = stand.suffer(Cell(process, fault, state))
    assert result.as_promised, result
    assert result.noticed is not None


def test_a_cell_is_as_promised_only_with_answer_free_tool_and_a_goal_that_succeeds() -> None:
    assert RESULT.kept
    assert not replace(RESULT, answered=None, answer=None).kept
    assert not replace(RESULT, free=None).kept
    assert not replace(RESULT, again=None).kept
    assert not replace(RESULT, bad_chains=("work LOST at 1.000 s names an unknown cause",)).kept


@pytest.mark.parametrize(
    ("cell", "well", "ill"),
    [
        (Cell("router", Fault.KILL, "RUNNING"), "S_DONE", "LOST by resource_manager"),
        (Cell("router", Fault.STOP, "VALIDATING"), "NR", "IT"),
        (Cell("router", Fault.STOP, "RUNNING"), "S_DONE", "NR"),
        (Cell("resource_manager", Fault.STOP, "VALIDATING"), "NR", "IT"),
        (Cell("resource_manager", Fault.KILL, "VALIDATING"), "S_DONE", "NR"),
        (Cell("skill/other", Fault.KILL, "INTERRUPTING"), "IT", "IT (forced)"),
        (Cell("skill/work", Fault.KILL, "RUNNING"), "LOST by client", "S_DONE"),
        (Cell("skill/work", Fault.KILL, "VALIDATING"), "S_DONE", "IT"),
        (Cell("skill/work", Fault.STOP, "VALIDATING"), "LOST by resource_manager", "S_DONE"),
        (Cell("mission", Fault.STOP, "RUNNING"), "IT", "LOST by client"),
        (Cell("resource_manager", Fault.HANG, "RUNNING"), "IT", "S_DONE"),
    ],
)
def test_a_goal_has_to_end_as_its_cell_promises(cell: Cell, well: str, ill: str) -> None:
    """A router whose restart makes every goal LOST gives each its answer, and breaks its promise."""
    assert replace(RESULT, cell=cell, answer=well).kept
    assert not replace(RESULT, cell=cell, answer=ill).kept


def test_what_is_noticed_or_over_too_late_is_not_as_promised() -> None:
    harmed = replace(RESULT, harmed=True)
    assert harmed.kept
    assert not replace(RESULT, noticed=None).kept
    assert not replace(RESULT, noticed=Sign(5.0, "launcher")).kept
    assert not replace(RESULT, again=11.0).kept
    assert not replace(harmed, answered=11.0).kept
    assert not replace(harmed, free=11.0).kept
    assert replace(harmed, free=11.0, lasted=4.0).kept
    assert replace(RESULT, answered=11.0, free=11.0).kept, "a goal that goes its way takes its time"
    assert "**late**" in "\n".join(manager_table([replace(RESULT, again=11.0)], 60.0))


@pytest.mark.parametrize(("again", "code"), [(0.1, 0), (11.0, 1), (None, 1)])
def test_a_limit_that_is_broken_is_the_exit_code(
    monkeypatch: pytest.MonkeyPatch, again: float | None, code: int
) -> None:
    """Limits are wall time, so that `make chaos` judges them and the cells above do not."""
    monkeypatch.setenv("PYTHONPATH", "")  # main changes it, and this brings it back
    monkeypatch.setattr(chaos_run, "run_managers", lambda *_: iter([RESULT, replace(RESULT, again=again)]))
    assert chaos_run.main(["--managers"]) == code


def test_a_flight_is_as_promised_only_on_the_ground_and_unhurt() -> None:
    assert FLIGHT.kept
    assert not replace(FLIGHT, landed=None).kept
    assert not replace(FLIGHT, collisions=1).kept
    assert not replace(FLIGHT, left_fence=True).kept


def test_of_repeated_cells_the_worst_is_reported() -> None:
    broken = replace(RESULT, again=None)
    table = "\n".join(manager_table([RESULT, broken, RESULT], 60.0))
    assert "**broken**: S_DONE, free 5.0 s, again never" in table
    assert "2 of 3 as promised" in table
    assert "**still flies**" in "\n".join(flight_table([replace(FLIGHT, landed=None)], 60.0))


def record(number: int, subject: str, after: str, cause: str | None = None, **fields: Any) -> Record:
    kind = RecordKind.DATA if after == "STALE" else RecordKind.GOAL
    return Record(
        id=f"p#{number}", t=1.0, source="p", kind=kind, subject=subject, before="", after=after, cause=cause, **fields
    )


def problems(process: str, skillset: Skillset, *records: Record, killed: bool = False) -> set[ChainProblem]:
    fault = InjectedFault(0.5, first_effects(process, skillset, killed=killed))
    return {each.problem for each in bad_chains(History.of(records, skillset=skillset), skillset, fault)}


def test_a_kill_is_in_the_timeline_and_the_cause_of_the_goals_that_are_lost_for_it() -> None:
    exit_ = changed(record(1, "skill/work", "KILLED"), source="launcher")
    lost = changed(record(2, "work", "LOST", "p#1"), source="resource_manager")
    other = changed(record(3, "other", "LOST"), source="resource_manager")
    by_client = changed(record(4, "work", "LOST"), source="client")
    assert exit_problems([exit_, lost, other, by_client], "skill/work") == ()
    assert exit_problems([lost, changed(exit_, source="mission")], "skill/work") == (
        "no record says `skill/work KILLED`",
    )
    assert exit_problems([exit_, changed(lost, cause=None)], "skill/work") == ("work LOST does not come of the exit",)


@pytest.mark.parametrize(
    ("process", "permitted"),
    [
        ("skill/work", {"LOST"}),
        ("skill/other", set[str]()),
        ("router", {"RI", "LOST"}),
        ("resource_manager", {"RI", "IT"}),
        ("mission", {"IT"}),
        ("data_manager", set[str]()),
        ("recorder", set[str]()),
    ],
)
def test_a_failure_must_come_from_the_process_that_was_harmed(process: str, permitted: set[str]) -> None:
    skillset = load(STAND)
    ends = {
        "LOST": [record(1, "work", "LOST")],
        "RI": [record(1, "level", "STALE"), record(2, "work", "RI", "p#1")],
        "IT": [record(1, "work", "INTERRUPTING", goal_id="g"), record(2, "work", "IT", "p#1", goal_id="g")],
    }
    found = {end: problems(process, skillset, *records) for end, records in ends.items()}
    assert found == {end: set() if end in permitted else {ChainProblem.SKIPS_FAULT} for end in ends}


def test_only_a_router_that_stands_still_ends_leases() -> None:
    assert not problems("router", load(STAND), record(1, "work", "LOST"), killed=False)
    assert problems("router", load(STAND), record(1, "work", "LOST"), killed=True) == {ChainProblem.SKIPS_FAULT}


def test_the_exit_of_a_killed_mission_is_the_cause_of_its_interrupted_goals() -> None:
    exit_ = changed(record(1, "mission", "KILLED"), source="launcher")
    rootless = [record(2, "work", "INTERRUPTING", goal_id="g"), record(3, "work", "IT", "p#2", goal_id="g")]
    caused = [exit_, changed(rootless[0], cause="p#1"), rootless[1]]
    assert problems("mission", load(STAND), *rootless, killed=True) == {ChainProblem.SKIPS_FAULT}
    assert not problems("mission", load(STAND), *caused, killed=True)
    assert not problems("mission", load(STAND), *rootless, killed=False)


def test_a_goal_that_its_client_has_lost_is_interrupted_for_that_when_its_manager_wakes_up() -> None:
    chain = [
        record(1, "work", "LOST", goal_id="g"),
        record(2, "work", "INTERRUPTING", "p#1", goal_id="g"),
        record(3, "work", "IT", "p#2", goal_id="g"),
    ]
    assert not problems("skill/work", load(STAND), *chain)
    assert ChainProblem.SKIPS_FAULT in problems("skill/other", load(STAND), *chain)


def test_in_a_flight_only_the_way_of_the_data_makes_them_stale_and_only_what_a_skill_commands_fails_it() -> None:
    m600 = ROBOT.load_skillset()
    stale = [record(1, "position", "STALE"), record(2, "goto", "RI", "p#1")]
    processes = {cell.process for cell in flight_cells()}
    assert {each for each in processes if not problems(each, m600, *stale)} == {
        "sim",
        "bridge",
        "router",
        "resource_manager",
    }
    failed = {
        each: {skill.name for skill in m600.skills if not problems(each, m600, record(1, skill.name, "ERROR"))}
        for each in processes
    }
    assert failed["obstacles"] == {"zed_depthmap", "lidar_depthmap"}
    assert failed["mapping"] == {"lidar_mapping"}
    assert "inspect" in failed["guidance"]
    assert not any(failed[each] for each in processes - {"guidance", "obstacles", "mapping"})
