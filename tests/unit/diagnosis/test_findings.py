"""Each thing that can be wrong with a system is found, and a system that is well is left in peace."""

from __future__ import annotations

import inspect
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from skillwing.services.diagnosis import findings
from skillwing.services.diagnosis.evidence import ClockSeen, Disk, Examination, Probe, ProbeReply, SystemSeen
from skillwing.services.diagnosis.findings import LITTLE_ROOM, RULES, SYSTEM_RULES, conclusion, diagnose
from skillwing.services.diagnosis.unattended import Unattended
from skillwing.services.processes.proc_files import Listener, Usage
from skillwing.services.processes.process_monitor import ProcessStatus
from skillwing.services.processes.process_state import ProcessCondition, ProcessState
from skillwing.services.protocol import (
    PROTOCOL_VERSION,
    DataReading,
    Ending,
    ErrorCode,
    ErrorReply,
    GoalStatus,
    State,
    Terminal,
)

USED = Usage(cpu=1.0, memory=1, uptime=100.0, stopped=False)
WELL = SystemSeen(
    robot="m600",
    endpoint="tcp/127.0.0.1:7447",
    skillset=Path("m600.skillset"),
    clock="robot",
    local=True,
    router=True,
    processes=(ProcessStatus(ProcessState(name="skill/goto", pid=7), ProcessCondition.RUNS, USED),),
    probes=(Probe("skill/goto", (ProbeReply("zid-1", PROTOCOL_VERSION, b""),)),),
    clock_seen=ClockSeen(watched=1.0, ticks=100, elapsed=1.0, between=1.0, factor=1.0),
    data=(DataReading(name="battery", value=80.0, t=1.0, age=0.1, stale=False),),
    states={"axes_authority": "AVAILABLE"},
    resources=frozenset({"axes_authority"}),
    goals=(GoalStatus(goal_id="g", skill="goto", state=State.RUNNING, t=1.0),),
    clients=frozenset({"client/mission-1"}),
    disk=Disk(Path("runs/x"), 10 * LITTLE_ROOM, writable=True),
)
LOST = GoalStatus(
    goal_id="g",
    skill="goto",
    state=State.TERMINATED,
    t=1.0,
    terminal=Terminal(ending=Ending.LOST, reason="The manager `skill/goto` was lost: silent."),
)
IN_AIR = Unattended(robot="m600", resource="flight_status", state="IN_AIR", where="in the air", ends_with="land")


def process(
    condition: ProcessCondition, *, stopped: bool = False, words: str = "", name: str = "skill/goto"
) -> SystemSeen:
    """A system with a process in that condition."""
    used = None if condition in (ProcessCondition.DOWN, ProcessCondition.RESTARTS) else replace(USED, stopped=stopped)
    return replace(WELL, processes=(ProcessStatus(ProcessState(name=name, pid=7, last_words=words), condition, used),))


def cut_off(endpoint: str) -> SystemSeen:
    """A system none of whose processes is at its router."""
    silent = [
        ProcessStatus(ProcessState(name=name, pid=7), ProcessCondition.SILENT, USED)
        for name in ("resource_manager", "skill/goto")
    ]
    router = ProcessStatus(ProcessState(name="router", pid=8), ProcessCondition.RUNS, USED)
    young = ProcessStatus(ProcessState(name="skill/land", pid=9), ProcessCondition.STARTS, USED)
    nothing = ClockSeen(watched=1.0)
    processes = (router, *silent, young)
    return replace(WELL, endpoint=endpoint, processes=processes, probes=(), states=None, clock_seen=nothing)


def replies(*given: ProbeReply, process: str = "skill/goto") -> SystemSeen:
    return replace(WELL, probes=(Probe(process, given),))


def refused(code: ErrorCode, message: str = "No.", help_text: str = "") -> SystemSeen:
    refusal = ErrorReply(code=code, message=message, help=help_text)
    return replies(ProbeReply("zid-1", PROTOCOL_VERSION, b"", refusal))


def clock(elapsed: float, factor: float = 1.0, ticks: int = 100) -> SystemSeen:
    return replace(WELL, clock_seen=ClockSeen(watched=1.0, ticks=ticks, elapsed=elapsed, between=1.0, factor=factor))


@pytest.mark.parametrize(
    ("seen", "about", "serious", "words"),
    [
        (replace(WELL, router=False), "no_router", True, "does not answer at tcp/127.0.0.1:7447"),
        (replace(WELL, router=False, local=False), "no_router", True, "SKILLWING_CONNECT"),
        (
            replace(WELL, router=False, listener=Listener(7447, 99, "skillwing router", stopped=True)),
            "process_stopped",
            True,
            "kill -CONT 99",
        ),
        (
            replace(WELL, router=False, listener=Listener(7447, 99, "python -m http.server")),
            "port_taken",
            True,
            "process 99 (`python -m http.server`) listens there",
        ),
        (
            replace(WELL, router=False, objection="You are not known here: it expired. Ask for new keys."),
            "not_known",
            True,
            "You are not known here: it expired. Ask for new keys.",
        ),
        (replace(WELL, exposed="tcp/0.0.0.0:7447"), "exposed", True, "Everybody who reaches tcp/0.0.0.0:7447"),
        (process(ProcessCondition.DOWN, words="It died 5 times."), "process_down", True, "It died 5 times."),
        (process(ProcessCondition.RESTARTS), "process_starting", False, "skill/goto is being started."),
        (process(ProcessCondition.RESTARTS, name="resource_manager"), "process_starting", True, "resource_manager"),
        (process(ProcessCondition.SILENT, stopped=True), "process_stopped", True, "kill -CONT 7"),
        (process(ProcessCondition.SILENT), "process_silent", True, "kill -9 7"),
        (cut_off("tls/127.0.0.1:7447"), "cut_off", True, "`skillwing keys list`"),
        (cut_off("tcp/127.0.0.1:7447"), "cut_off", True, "none of them is at the router tcp/127.0.0.1:7447"),
        (replies(), "process_hangs", True, "answers no question"),
        (
            replies(ProbeReply("zid-1", PROTOCOL_VERSION, b""), ProbeReply("zid-2", PROTOCOL_VERSION, b"")),
            "two_of_a_name",
            True,
            "2 processes are skill/goto",
        ),
        (
            replies(
                ProbeReply("zid-1", PROTOCOL_VERSION, b""),
                ProbeReply("zid-2", PROTOCOL_VERSION, b""),
                process="resource_manager",
            ),
            "two_of_a_name",
            True,
            "Start no skill, and look again",
        ),
        (replies(ProbeReply("zid-1", 99, b"")), "protocol_version", True, "uses protocol 99"),
        (replies(ProbeReply("zid-1", None, b"")), "protocol_version", True, "uses another protocol"),
        (
            refused(ErrorCode.SCHEMA_MISMATCH),
            "schema_mismatch",
            True,
            "`skill/goto` run another version of the skillset",
        ),
        (
            replace(WELL, states={"old": "X"}),
            "schema_mismatch",
            True,
            "`resource_manager` run another version of the skillset",
        ),
        (refused(ErrorCode.UNAVAILABLE, "It resumes.", "Wait."), "unavailable", True, "It resumes."),
        (clock(0.0), "clock_stopped", True, "no tick for 1.0 s"),
        (clock(0.0, ticks=0), "clock_stopped", True, "no tick for 1.0 s"),
        (clock(0.5), "clock_slow", False, "0.50 robot seconds per second, not at the requested 1."),
        (clock(1.0, factor=2.0), "clock_slow", False, "not at the requested 2."),
        (
            replace(WELL, data=(DataReading(name="battery", value=1.0, t=1.0, age=9.0, stale=True),)),
            "stale_data",
            False,
            "`battery` is stale, 9.0 s old",
        ),
        (
            replace(WELL, data=(DataReading(name="battery", value=None, t=None, age=None, stale=True),)),
            "no_data",
            False,
            "`battery`: never published",
        ),
        (
            replace(WELL, lost=(LOST,)),
            "goal_lost",
            False,
            "`goto` ended LOST. The manager `skill/goto` was lost: silent.",
        ),
        (replace(WELL, clients=frozenset()), "goal_of_nobody", False, "skillwing interrupt goto"),
        (
            replace(WELL, unattended=IN_AIR),
            "unattended",
            True,
            "m600 is in the air, and nobody commands it. End that with `skillwing start land`",
        ),
        (replace(WELL, disk=Disk(Path("runs/x"), 0, writable=False)), "disk_not_writable", True, "runs/x"),
        (replace(WELL, disk=Disk(Path("runs/x"), 5 << 20, writable=True)), "disk_full", True, "5 MB left"),
    ],
)
def test_what_is_wrong_with_a_system_is_found(seen: SystemSeen, about: str, serious: bool, words: str) -> None:
    (finding,) = diagnose(Examination(system=seen))
    assert (finding.about, finding.serious) == (about, serious)
    assert words in f"{finding.what} {finding.remedy}"


@pytest.mark.parametrize(
    ("evidence", "about", "serious", "words"),
    [
        (Examination(), "no_system", True, "skillwing up"),
        (Examination(robot="right"), "no_system", True, "No system of `right` is running"),
        (
            Examination(malformed="`a. b`, given by `X`, is no address of a router. Write tcp/HOST:PORT."),
            "malformed_address",
            True,
            "`a. b`, given by `X`, is no address of a router. Write tcp/HOST:PORT.",
        ),
        (Examination(system=WELL, stale=("boat",)), "stale_run_state", False, "`boat` was killed"),
        (Examination(system=WELL, load=9.0, cores=2), "overload", False, "9.0 processes want to run on 2 cores"),
        (
            Examination(system=WELL, missing={"viewer": ("rerun", "matplotlib")}),
            "missing_extra",
            False,
            "pip install 'skillwing[viewer]'",
        ),
    ],
)
def test_what_is_wrong_with_the_machine_is_found(evidence: Examination, about: str, serious: bool, words: str) -> None:
    (finding,) = diagnose(evidence)
    assert (finding.about, finding.serious) == (about, serious)
    assert words in f"{finding.what} {finding.remedy}"


@pytest.mark.parametrize(
    "seen",
    [
        WELL,
        clock(0.9),
        # As fast as possible promises no pace.
        clock(0.1, factor=0.0),
        replace(clock(0.0), clock="wall"),
        # A skill that stays away because its process is down is not reported as hanging, too.
        replace(WELL, processes=(), probes=(Probe("skill/goto", ()),)),
        refused(ErrorCode.TOO_LATE),
        replace(WELL, goals=(), clients=frozenset()),
    ],
)
def test_a_system_that_is_well_is_left_in_peace(seen: SystemSeen) -> None:
    assert diagnose(Examination(system=seen)) == []


STALE = replace(
    WELL,
    data=(
        DataReading(name="quality", value=None, t=None, age=None, stale=True),
        DataReading(name="distance", value=1.0, t=1.0, age=9.0, stale=True),
    ),
    published_by={"quality": ("stream",), "distance": ("see", "goto")},
)


def test_a_datum_is_missed_only_while_a_skill_runs_that_publishes_it() -> None:
    (finding,) = diagnose(Examination(system=STALE))
    assert "`distance` is stale" in finding.what
    ended = GoalStatus(goal_id="g", skill="goto", state=State.TERMINATED, t=1.0)
    assert diagnose(Examination(system=replace(STALE, goals=(ended,)))) == []


@pytest.mark.parametrize(
    ("seen", "sentence"),
    [
        (WELL, "m600 is well."),
        (replace(WELL, lost=(LOST,)), "m600 works, with the notes above."),
        (process(ProcessCondition.DOWN), None),
    ],
)
def test_a_system_with_a_note_is_not_called_well(seen: SystemSeen, sentence: str | None) -> None:
    assert conclusion("m600", diagnose(Examination(system=seen))) == sentence


def test_the_serious_comes_first() -> None:
    found = diagnose(
        Examination(system=replace(process(ProcessCondition.DOWN), clients=frozenset()), load=9.0, cores=1)
    )
    assert [finding.serious for finding in found] == [True, False, False]


def test_every_finding_says_what_is_wrong_and_what_to_do_in_a_sentence_each() -> None:
    worst = replace(
        process(ProcessCondition.DOWN), data=(), clients=frozenset(), disk=Disk(Path("x"), 0, writable=False)
    )
    for finding in diagnose(Examination(system=worst, stale=("a",), load=99.0, missing={"sim": ("mujoco",)})):
        assert finding.what.endswith(".")
        assert finding.remedy
        assert finding.what[0].isupper() or finding.what.startswith(("skill/", "`"))


def test_no_rule_is_forgotten() -> None:
    written = {rule for rule in vars(findings).values() if inspect.isgeneratorfunction(rule)}
    assert written == {*RULES, *SYSTEM_RULES}


def test_a_node_that_hangs_is_found_also_where_it_shares_a_process() -> None:
    state = ProcessState(name="managers", pid=7, nodes=("skill/goto", "skill/hover"))
    hangs, away = Probe("skill/goto", ()), Probe("skill/hover", ())
    missing = frozenset({"skill/hover"})
    shared = replace(
        WELL, processes=(ProcessStatus(state, ProcessCondition.SILENT, USED, missing),), probes=(hangs, away)
    )
    found = [finding for finding in diagnose(Examination(system=shared)) if finding.about == "process_hangs"]
    assert [finding.what.partition(" ")[0] for finding in found] == ["skill/goto"]
    assert "kill -9 7" in found[0].remedy


@pytest.mark.parametrize(("days", "serious", "words"), [(10, False, "are valid until"), (-1, True, "were valid until")])
def test_keys_that_end_soon_are_reported_once(days: int, serious: bool, words: str) -> None:
    now = datetime(2026, 11, 28, tzinfo=UTC)
    keys = {"alice": now + timedelta(days=300), "router": now + timedelta(days=days), "m600.sim": now + timedelta(29)}
    (finding,) = diagnose(Examination(system=replace(WELL, keys=keys), now=now))
    assert (finding.about, finding.serious) == ("key_expires", serious)
    assert f"The keys of `router` {words}" in finding.what
    assert diagnose(Examination(system=replace(WELL, keys={"alice": keys["alice"]}), now=now)) == []
