"""The cause chains of whole missions: every failure leads to the fault that was injected, and never back in time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from typing import NamedTuple

import pytest
from flights import AWAY, M600, Flight
from msgspec.structs import replace

from cause_chains import BadChain, ChainProblem, InjectedFault, bad_chains, failures
from skillwing.bt_missions.missions.inspection import MISSION as INSPECTION
from skillwing.bt_missions.missions.mapping import MISSION as MAPPING
from skillwing.services.history.history import History
from skillwing.services.protocol import Record

BUILDING = {"center": (9.0, 0.0, 0.0), "radius": 5.0, "height": 4.0, "laps": 0.5, "return_height": 4.0, "hover": 2.0}


class Fault(NamedTuple):
    """A fault of the toy drone or of a process, and the headlines of the records that its chains may begin with."""

    inject: Callable[[Flight], None]
    roots: tuple[str, ...]


def state_fault(resource: str, state: str) -> Fault:
    return Fault(lambda flight: flight.drone.set(resource, state), (f"{resource} {state}",))


def killed(skill: str) -> Fault:
    return Fault(lambda flight: flight.buses[f"skill/{skill}"].close(), (f"{skill} LOST",))


FAULTS = {
    "camera": state_fault("zed_status", "FAILED"),
    "lidar": state_fault("lidar_status", "FAILED"),
    "link": Fault(lambda flight: setattr(flight.drone, "bandwidth", 0.0), ("video BAD",)),
    "pilot": state_fault(*AWAY),
    "battery": state_fault("battery_status", "CRITICAL"),
    "manager of goto_straight": killed("goto_straight"),
    "manager of inspect": killed("inspect"),
}
MISSIONS: dict[str, Callable[[int], Flight]] = {
    "mapping": lambda seed: Flight(seed=seed, mission=MAPPING, pilot_patience=4.0),
    "inspection": lambda seed: Flight(seed=seed, mission=INSPECTION, pilot_patience=4.0, **BUILDING),
}
HARMLESS = {
    ("mapping", "link"),
    ("mapping", "manager of inspect"),
    ("inspection", "camera"),
    ("inspection", "manager of goto_straight"),
}
"""Faults of things that the mission does not need."""


def audit(records: Sequence[Record], fault: InjectedFault | None) -> tuple[BadChain, ...]:
    return bad_chains(History.of(records, skillset=M600), M600, fault)


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("mission", MISSIONS)
def test_every_failure_leads_to_the_fault(mission: str, fault: str) -> None:
    for seed, moment in ((1, 9.0), (2, 12.5)):
        flight = MISSIONS[mission](seed)
        flight.at(moment, lambda flight=flight: FAULTS[fault].inject(flight))
        flight.fly()
        bad = audit(flight.records, InjectedFault(moment, frozenset(FAULTS[fault].roots)))
        assert not bad, "\n".join(map(str, bad))
        has_failed = bool(failures(History.of(flight.records, skillset=M600), M600))
        assert has_failed is ((mission, fault) not in HARMLESS)


@pytest.mark.parametrize("mission", MISSIONS)
def test_a_flight_without_faults_has_no_bad_chain(mission: str) -> None:
    flight = MISSIONS[mission](0)
    flight.fly()
    bad = audit(flight.records, None)
    assert not bad, "\n".join(map(str, bad))


# --- the audit finds mistakes ----------------------------------------------------------------------------------------

CAMERA = InjectedFault(9.0, frozenset(FAULTS["camera"].roots))


@cache
def camera_fails() -> tuple[Record, ...]:
    flight = MISSIONS["mapping"](1)
    flight.at(CAMERA.t, lambda: FAULTS["camera"].inject(flight))
    flight.fly()
    return tuple(flight.records)


def planted(after: str, mistake: Callable[[Record], Record]) -> set[ChainProblem]:
    """The problems that the audit finds when the first record of that state after the fault is changed."""
    records = list(camera_fails())
    number = next(k for k, each in enumerate(records) if each.after == after and each.t >= CAMERA.t)
    records[number] = mistake(records[number])
    return {bad.problem for bad in audit(records, CAMERA)}


def start_of(record: Record) -> str:
    return next(each.id for each in camera_fails() if each.goal_id == record.goal_id)


def test_the_audit_finds_a_cause_that_was_dropped() -> None:
    assert ChainProblem.SKIPS_FAULT in planted("RI", lambda record: replace(record, cause=None))
    assert ChainProblem.SKIPS_FAULT in planted("VIOLATED", lambda record: replace(record, cause=None))


def test_the_audit_finds_a_failure_that_is_put_down_to_the_start_of_its_goal() -> None:
    assert ChainProblem.SKIPS_FAULT in planted("RI", lambda record: replace(record, cause=start_of(record)))


def test_the_audit_finds_a_cause_from_the_future() -> None:
    last = camera_fails()[-1]
    assert ChainProblem.BACKWARDS in planted("RI", lambda record: replace(record, cause=last.id))
    assert ChainProblem.BACKWARDS in planted("FAILED", lambda record: replace(record, t=record.t + 5.0))


def test_the_audit_finds_a_cause_that_nobody_has_recorded() -> None:
    assert ChainProblem.CUT in planted("VIOLATED", lambda record: replace(record, cause="nobody#1"))


def test_the_audit_finds_an_interruption_that_does_not_lead_to_the_failure() -> None:
    """The mission stops its other skills because of the failure."""
    for state in ("INTERRUPTING", "IT"):
        assert ChainProblem.SKIPS_FAULT in planted(state, lambda record: replace(record, cause=None))
        assert ChainProblem.SKIPS_FAULT in planted(state, lambda record: replace(record, cause=start_of(record)))


def test_the_audit_finds_an_interruption_without_a_cause_also_where_nothing_has_failed() -> None:
    flight = MISSIONS["mapping"](1)
    flight.fly()
    stop = max((each for each in flight.records if each.after == "INTERRUPTING"), key=lambda record: record.t)
    fault = InjectedFault(stop.t - 1.0, frozenset())
    assert audit(flight.records, fault) == ()
    records = [replace(each, cause=None) if each is stop else each for each in flight.records]
    bad = audit(records, fault)
    assert {(each.record.after, each.problem) for each in bad} == {
        ("INTERRUPTING", ChainProblem.SKIPS_FAULT),
        ("IT", ChainProblem.SKIPS_FAULT),
    }


def test_the_audit_finds_a_change_of_a_resource_whose_cause_is_unknown_or_later() -> None:
    last = camera_fails()[-1]
    assert planted("NONE", lambda record: replace(record, cause="nobody#1")) == {ChainProblem.CUT}
    assert ChainProblem.BACKWARDS in planted("NONE", lambda record: replace(record, cause=last.id))


def test_the_audit_finds_a_chain_that_leads_back_to_itself() -> None:
    assert ChainProblem.LOOP in planted("RI", lambda record: replace(record, cause=record.id))


def test_the_audit_finds_an_unrelated_root_also_without_a_known_fault() -> None:
    records = [replace(each, cause=start_of(each)) if each.after == "RI" else each for each in camera_fails()]
    assert ChainProblem.UNRELATED in {bad.problem for bad in audit(records, None)}
