"""A handful of cells of the chaos matrix, and what its tables tell. `make chaos` does all of it."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import chaos_run
import pytest
from first_effects import first_effects
from flights_with_faults import FlightCell, FlightResult, Moment
from signs import Fault, Sign
from stand import Cell, Result, Stand
from stand_nodes import STAND
from tables import flight_table, manager_table

from cause_chains import ChainProblem, InjectedFault, bad_chains
from skillwing.dsl import load
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


def test_a_failure_must_come_from_the_process_that_was_harmed() -> None:
    skillset = load(STAND)
    lost = Record(id="rm/1", t=1.0, source="rm", kind=RecordKind.GOAL, subject="work", before="RUNNING", after="LOST")
    for process, problems in (("skill/work", []), ("skill/other", [ChainProblem.SKIPS_FAULT])):
        fault = InjectedFault(0.5, first_effects(process, skillset))
        found = bad_chains(History.of([lost], skillset=skillset), skillset, fault)
        assert [each.problem for each in found] == problems
