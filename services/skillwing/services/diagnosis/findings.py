"""Findings from evidence: one pure rule for each problem that a system can have."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from datetime import timedelta

import msgspec

from skillwing.services.access.exposure import EXPOSED
from skillwing.services.bus.identity import needs_identity
from skillwing.services.diagnosis.evidence import Examination, SystemSeen
from skillwing.services.names import RESOURCE_MANAGER, skill_process
from skillwing.services.processes.launcher import ROUTER
from skillwing.services.processes.process_monitor import ProcessStatus
from skillwing.services.processes.process_state import ProcessCondition
from skillwing.services.protocol import PROTOCOL_VERSION, ErrorCode, State

SLOW = 0.8
"""Share of the promised speed below which robot time counts as slow."""
CROWD = 2.0
"""Runnable processes per core above which a machine counts as overloaded."""
SOON = timedelta(days=30)
"""Time before the end of a certificate's validity from which on it is reported."""
LITTLE_ROOM = 200 << 20
"""Free bytes below which a run may fill its disk: a recording needs more."""

TWO_MANAGERS = (
    "End all but one (a `node_host` started by hand, a container, a second system?). The resource manager accepts the "
    "last one; any other ends at its next goal, and `up` starts it again."
)
TWO_RESOURCE_MANAGERS = (
    "Start no skill, and look again in some seconds: the first one ends by itself when it sees the other. If both "
    "stay, end the one that `skillwing status` does not name: each grants what the other has granted already."
)


class Finding(msgspec.Struct, frozen=True, kw_only=True):
    """One problem, or, unless `serious`, one note. about: its name for programs.

    what: a sentence on the problem. remedy: a sentence on what to do.
    """

    about: str
    what: str
    remedy: str
    serious: bool = True


Rule = Callable[[Examination], Iterator[Finding]]
SystemRule = Callable[[SystemSeen], Iterator[Finding]]


def diagnose(evidence: Examination) -> list[Finding]:
    """All findings, the serious ones first."""
    found = [finding for rule in RULES for finding in rule(evidence)]
    if evidence.system is not None:
        found += [finding for rule in SYSTEM_RULES for finding in rule(evidence.system)]
    return sorted(found, key=lambda finding: not finding.serious)


def conclusion(robot: str | None, findings: Sequence[Finding]) -> str | None:
    """A sentence on a system as a whole; None after a serious finding, which says enough."""
    if any(finding.serious for finding in findings):
        return None
    return f"{robot} works, with the notes above." if findings else f"{robot} is well."


# --- the machine -----------------------------------------------------------------------------------------------------


def no_system(evidence: Examination) -> Iterator[Finding]:
    if evidence.malformed is not None:
        what, remedy = _sentences(evidence.malformed)
        yield Finding(about="malformed_address", what=what, remedy=remedy)
    elif evidence.system is None:
        of_robot = f" of `{evidence.robot}`" if evidence.robot else ""
        yield Finding(
            about="no_system",
            what=f"No system{of_robot} is running.",
            remedy="Start one with `skillwing up`, or name one elsewhere: SKILLWING_CONNECT=tcp/HOST:PORT.",
        )


def stale_run_state(evidence: Examination) -> Iterator[Finding]:
    for robot in evidence.stale:
        yield Finding(
            about="stale_run_state",
            what=f"The last system of `{robot}` was killed: its run-state file was left behind.",
            remedy="Do nothing; the next command removes the file.",
            serious=False,
        )


def missing_extras(evidence: Examination) -> Iterator[Finding]:
    for extra, packages in evidence.missing.items():
        yield Finding(
            about="missing_extra",
            what=f"The extra `{extra}` is not complete: {_listed(packages)} cannot be imported.",
            remedy=f"Install it if you need it: pip install 'skillwing[{extra}]'",
            serious=False,
        )


def overload(evidence: Examination) -> Iterator[Finding]:
    if evidence.load > CROWD * evidence.cores:
        yield Finding(
            about="overload",
            what=f"The machine is overloaded: {evidence.load:.1f} processes want to run on {evidence.cores} cores.",
            remedy="End other programs (`skillwing top` shows the load of the system), or lower `up --speed`.",
            serious=False,
        )


def keys_expire(evidence: Examination) -> Iterator[Finding]:
    keys = {} if evidence.system is None else evidence.system.keys
    for name, expires in sorted(keys.items(), key=lambda each: each[1]):
        if evidence.now is not None and expires - evidence.now < SOON:
            over = expires <= evidence.now
            yield Finding(
                about="key_expires",
                what=f"The keys of `{name}` {'were' if over else 'are'} valid until {expires:%Y-%m-%d}.",
                remedy="Make new ones: `skillwing keys add` for a person, `skillwing keys add-robot` for a robot.",
                serious=over,
            )
            return


# --- the system's processes ------------------------------------------------------------------------------------------


def no_router(system: SystemSeen) -> Iterator[Finding]:
    if system.router:
        return
    if system.objection is not None:
        what, remedy = _sentences(system.objection)
        yield Finding(about="not_known", what=what, remedy=remedy)
        return
    if system.listener is not None and system.listener.stopped:
        yield Finding(
            about="process_stopped",
            what=f"{system.listener.who} listens at {system.endpoint}, and is stopped by a signal.",
            remedy=f"Let it go on with `kill -CONT {system.listener.pid}`.",
        )
    elif system.listener is not None:
        yield Finding(
            about="port_taken",
            what=f"At {system.endpoint} no router answers, but {_decapitalised(system.listener.who)} listens there.",
            remedy="End that process, or start the system at another port: `skillwing up --listen tcp/HOST:PORT`.",
        )
    elif system.local:
        yield Finding(
            about="no_router",
            what=f"The router of `{system.robot}` does not answer at {system.endpoint}.",
            remedy="If it does not return within seconds, restart: `skillwing down`, then `skillwing up`.",
        )
    else:
        yield Finding(
            about="no_router",
            what=f"No router answers at {system.endpoint}.",
            remedy="Check the address in SKILLWING_CONNECT, and that the system runs there.",
        )


def exposed_router(system: SystemSeen) -> Iterator[Finding]:
    if system.exposed is not None:
        yield Finding(
            about="exposed",
            what=EXPOSED.format(endpoint=system.exposed),
            remedy="Make keys with `skillwing keys init`, and start it with `--keys DIR` (docs/keys.md).",
        )


def processes_down(system: SystemSeen) -> Iterator[Finding]:
    if _all_cut_off(system):
        reason = "Look whether `skillwing keys list` still has it" if needs_identity(system.endpoint) else "Wait"
        yield Finding(
            about="cut_off",
            what=f"All processes of `{system.robot}` live, and none of them is at the router {system.endpoint}.",
            remedy=f"{reason}; if that does not help, restart: `skillwing down`, then `skillwing up`.",
        )
        return
    for entry in system.processes:
        state = entry.state
        match entry.condition:
            case ProcessCondition.DOWN if system.router or state.pid is not None:
                yield Finding(
                    about="process_down",
                    what=f"{state.name} does not run. {state.last_words}".strip(),
                    remedy=f"Look at its log; restart the system to have {state.name} again."
                    if system.local
                    else "Start it on the machine of the system.",
                )
            case ProcessCondition.RESTARTS | ProcessCondition.STARTS:
                yield Finding(
                    about="process_starting",
                    what=f"{state.name} is being started. {state.last_words}".strip(),
                    remedy="Look again in some seconds.",
                    serious=state.name == RESOURCE_MANAGER,
                )
            case ProcessCondition.SILENT if entry.used is not None and entry.used.stopped:
                yield Finding(
                    about="process_stopped",
                    what=f"{state.name} is stopped by a signal (process {state.pid}).",
                    remedy=f"Let it go on with `kill -CONT {state.pid}`.",
                )
            case ProcessCondition.SILENT:
                yield Finding(
                    about="process_silent",
                    what=f"{state.name} lives (process {state.pid}) and has no alive token: it is cut off, or hangs.",
                    remedy=f"Let `up` restart it with `kill -9 {state.pid}`; its present work is lost.",
                )
            case _:
                pass


def _all_cut_off(system: SystemSeen) -> bool:
    """True if two or more processes live without an alive token, and no process beside the router has one."""
    of_robot = [entry for entry in system.processes if entry.state.name != ROUTER]
    silent = [entry for entry in of_robot if entry.condition is ProcessCondition.SILENT]
    runs = any(entry.condition is ProcessCondition.RUNS for entry in of_robot)
    stopped = any(entry.used is None or entry.used.stopped for entry in silent)
    return len(silent) > 1 and not runs and not stopped


def unanswered(system: SystemSeen) -> Iterator[Finding]:
    well = {name: entry for entry in system.processes for name in _at_work(entry)}
    for probe in system.probes:
        if probe.replies or probe.process not in well:
            continue
        pid = well[probe.process].state.pid
        yield Finding(
            about="process_hangs",
            what=f"{probe.process} holds its alive token and answers no question: it hangs in its own code.",
            remedy="Look at its log" + (f", or let `up` restart it with `kill -9 {pid}`." if pid else "."),
        )


def two_of_a_name(system: SystemSeen) -> Iterator[Finding]:
    for probe in system.probes:
        repliers = {reply.replier for reply in probe.replies}
        if len(repliers) > 1:
            yield Finding(
                about="two_of_a_name",
                what=f"{len(repliers)} processes are {probe.process}, and each answers every request.",
                remedy=TWO_RESOURCE_MANAGERS if probe.process == RESOURCE_MANAGER else TWO_MANAGERS,
            )


def versions(system: SystemSeen) -> Iterator[Finding]:
    for probe in system.probes:
        spoken = {reply.version for reply in probe.replies} - {PROTOCOL_VERSION}
        for version in spoken:
            other = "another protocol" if version is None else f"protocol {version}"
            yield Finding(
                about="protocol_version",
                what=f"{probe.process} uses {other}; this command uses protocol {PROTOCOL_VERSION}.",
                remedy="Use the same version of skillwing for every process.",
            )


def schemas(system: SystemSeen) -> Iterator[Finding]:
    differing = [
        probe.process
        for probe in system.probes
        if any(reply.refusal is not None and reply.refusal.code is ErrorCode.SCHEMA_MISMATCH for reply in probe.replies)
    ]
    if system.states is not None and set(system.states) != system.resources:
        differing.insert(0, RESOURCE_MANAGER)
    if differing:
        yield Finding(
            about="schema_mismatch",
            what=f"{_listed(differing)} run another version of the skillset than {system.skillset}.",
            remedy="Restart the system, so that all read the present file: `skillwing down`, then `skillwing up`.",
        )


def resuming(system: SystemSeen) -> Iterator[Finding]:
    for probe in system.probes:
        for reply in probe.replies:
            if reply.refusal is not None and reply.refusal.code is ErrorCode.UNAVAILABLE:
                yield Finding(
                    about="unavailable",
                    what=f"{probe.process} cannot answer now: {reply.refusal.message}",
                    remedy=reply.refusal.help or "Look again in some seconds.",
                )


# --- the work of the processes ---------------------------------------------------------------------------------------


def clock(system: SystemSeen) -> Iterator[Finding]:
    seen = system.clock_seen
    if system.clock == "wall" or seen is None or _all_cut_off(system):
        return
    if seen.ticks == 0 or seen.elapsed <= 0.0:
        yield Finding(
            about="clock_stopped",
            what=f"Robot time stands still: no tick for {seen.watched:.1f} s, so no skill can go on.",
            remedy="Check the simulator with `skillwing status`; it cannot be restarted alone.",
        )
    elif seen.factor > 0.0 and seen.elapsed < SLOW * seen.factor * seen.between:
        yield Finding(
            about="clock_slow",
            what=f"Robot time passes at {seen.elapsed / seen.between:.2f} robot seconds per second, not at the "
            f"requested {seen.factor:g}.",
            remedy="The machine is too slow for that, or too busy: lower `up --speed`, or end other programs.",
            serious=False,
        )


def stale_data(system: SystemSeen) -> Iterator[Finding]:
    """Notes only: some data flow only while a skill needs them, and not every robot's table has them."""
    running = {goal.skill for goal in system.goals if goal.state is not State.TERMINATED}
    at_rest = {name for name, skills in system.published_by.items() if running.isdisjoint(skills)}
    expected = [reading for reading in system.data if reading.name not in at_rest]
    never = [reading.name for reading in expected if reading.t is None]
    if never:
        yield Finding(
            about="no_data",
            what=f"{_listed(never)}: never published, so that no condition on it holds.",
            remedy="If it should exist by now, check the robot's bridge, and the sensors behind it.",
            serious=False,
        )
    for reading in expected:
        if reading.stale and reading.age is not None:
            yield Finding(
                about="stale_data",
                what=f"`{reading.name}` is stale, {reading.age:.1f} s old, so that no condition on it holds.",
                remedy="If it should still come, check the robot's bridge, and the sensor behind it.",
                serious=False,
            )


def goals_of_nobody(system: SystemSeen) -> Iterator[Finding]:
    if system.clients:
        return
    for goal in system.goals:
        if goal.state is not State.TERMINATED:
            yield Finding(
                about="goal_of_nobody",
                what=f"`{goal.skill}` runs ({goal.state}), and no client owns it.",
                remedy=f"End it with `skillwing interrupt {goal.skill}` if it is not needed any more.",
                serious=False,
            )


def goals_lost(system: SystemSeen) -> Iterator[Finding]:
    for goal in system.lost:
        if goal.terminal is not None:
            yield Finding(
                about="goal_lost",
                what=f"The last goal of `{goal.skill}` ended LOST. {goal.terminal.reason}",
                remedy=f"Look at the log of {skill_process(goal.skill)}, then start the skill again.",
                serious=False,
            )


def unattended(system: SystemSeen) -> Iterator[Finding]:
    if system.unattended is not None:
        yield Finding(about="unattended", what=system.unattended.what, remedy=system.unattended.remedy)


def disk(system: SystemSeen) -> Iterator[Finding]:
    run_disk = system.disk
    if run_disk is None:
        return
    if not run_disk.writable:
        yield Finding(
            about="disk_not_writable",
            what=f"Nothing can be written to {run_disk.path}: logs and recording have stopped. Goals go on.",
            remedy="Make room there, or give its owner the right to write. The recording then goes on by itself.",
        )
    elif run_disk.free < LITTLE_ROOM:
        yield Finding(
            about="disk_full",
            what=f"The disk of {run_disk.path} has {run_disk.free >> 20} MB left.",
            remedy="Remove old runs, or start the next one elsewhere with --run-dir.",
        )


RULES: tuple[Rule, ...] = (no_system, stale_run_state, overload, missing_extras, keys_expire)
SYSTEM_RULES: tuple[SystemRule, ...] = (
    no_router,
    exposed_router,
    processes_down,
    unanswered,
    resuming,
    two_of_a_name,
    versions,
    schemas,
    clock,
    stale_data,
    goals_of_nobody,
    goals_lost,
    unattended,
    disk,
)


def _sentences(message: str) -> tuple[str, str]:
    """The problem in a message, and its last sentence, which says what to do."""
    what, _, remedy = message.rpartition(". ")
    return f"{what}.", remedy


def _listed(names: tuple[str, ...] | list[str]) -> str:
    quoted = [f"`{name}`" for name in names]
    return quoted[0] if len(quoted) == 1 else f"{', '.join(quoted[:-1])} and {quoted[-1]}"


def _at_work(entry: ProcessStatus) -> list[str]:
    """Names of the process's nodes that run, and can answer."""
    if entry.state.nodes:
        return [node for node, how in entry.nodes.items() if how is ProcessCondition.RUNS]
    return [entry.state.name] if entry.condition is ProcessCondition.RUNS else []


def _decapitalised(sentence: str) -> str:
    return sentence[0].lower() + sentence[1:]
