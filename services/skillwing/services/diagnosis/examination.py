"""Examination of a system and its machine in any state, without changes to them."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import TypeVar

import zenoh

from skillwing.dsl import UnknownNameError, load
from skillwing.dsl.model import Skillset
from skillwing.services.access.exposure import exposed
from skillwing.services.access.handshake import explained, unknown_name
from skillwing.services.access.identity_files import person_identity
from skillwing.services.access.key_store import KeyStore, read_facts
from skillwing.services.bus.identity import SessionIdentity
from skillwing.services.bus.zenoh_session import RouterUnreachableError, open_client, role_at_router
from skillwing.services.client.connection import find_target
from skillwing.services.client.target import DEFAULT_ROBOT, TABLE, Target, target_of_table
from skillwing.services.diagnosis.evidence import Disk, Examination, Probe, SystemSeen
from skillwing.services.diagnosis.probing import ProbeRequest, alive, ask_all, watch_clock
from skillwing.services.diagnosis.unattended import unattended_state
from skillwing.services.errors import InvalidOptionError, KeysError, NoSystemError
from skillwing.services.history.goal_ends import recorded_goals, was_lost
from skillwing.services.ids import new_goal_id
from skillwing.services.names import CLIENT, DATA_MANAGER, RESOURCE_MANAGER, skill_process
from skillwing.services.processes.proc_files import Listener, listener, port_of
from skillwing.services.processes.process_monitor import process_statuses
from skillwing.services.processes.process_state import ProcessState
from skillwing.services.processes.run_state import running_systems, stale_run_states
from skillwing.services.protocol import (
    DataReading,
    GoalStatus,
    Keys,
    Message,
    ProtocolError,
    QueryData,
    QueryGoal,
    QueryStates,
    ResourceStates,
    StartGoal,
    State,
    decode,
)
from skillwing.services.robot import Robot, find_robot

M = TypeVar("M", bound=Message)

CONNECT_TIMEOUT = 2.0
CLOCK_WATCH = 1.0
"""Wall seconds of the measurement of robot time."""
LONG_AGO = -1.0
"""Deadline in robot time of a start that must not start anything."""
PACKAGES = {
    "sim": ("mujoco", "embreex", "numpy", "scipy"),
    "missions": ("py_trees",),
    "viewer": ("rerun", "matplotlib"),
}


def examine(robot: str | None = None) -> Examination:
    """Examine the running system, or that of a robot; raises NoSystemError for several systems to choose from."""
    stale, malformed = stale_run_states(), None
    try:
        target = find_target(robot)
    except InvalidOptionError as error:
        target, malformed = None, str(error)
    except NoSystemError as error:
        if robot is None and len(running_systems()) > 1:
            raise
        target = None if error.endpoint is None else _expected_target(error.endpoint, robot)
    return Examination(
        robot=robot,
        system=None if target is None else examine_system(target),
        malformed=malformed,
        stale=stale,
        missing={extra: found for extra, names in PACKAGES.items() if (found := _not_installed(names))},
        load=os.getloadavg()[0],
        cores=os.cpu_count() or 1,
        now=datetime.now(UTC),
    )


def _expected_target(endpoint: str, robot: str | None) -> Target | None:
    """The system that should be at a router which does not answer; None without a table of that robot."""
    try:
        return target_of_table(endpoint, robot, os.environ.get(TABLE) or robot or DEFAULT_ROBOT)
    except UnknownNameError:
        return None


def examine_system(target: Target) -> SystemSeen:
    """Examine one system."""
    skillset = load(target.skillset)
    keys = Keys(skillset.name)
    disk = None if target.run_dir is None else _disk(target.run_dir)
    lost = tuple(filter(was_lost, recorded_goals(target.run_dir).values()))
    port = port_of(target.endpoint)
    exposed_at = target.listens or target.endpoint
    seen = SystemSeen if not exposed(exposed_at) else partial(SystemSeen, exposed=exposed_at)
    joined = _join(target)
    if joined.session is None:
        return seen(
            objection=joined.objection,
            robot=target.robot,
            endpoint=target.endpoint,
            skillset=target.skillset,
            clock=target.clock,
            local=target.pid is not None,
            router=False,
            listener=None if port is None else _stranger(port, target),
            processes=tuple(process_statuses(target.processes, None)),
            disk=disk,
            lost=lost,
        )
    identity = joined.identity
    with joined.session as session:
        probe = partial(ask_all, session, identity)
        held = frozenset(key.removeprefix(keys.alive("")) for key in alive(session, keys.alive("**")))
        probes = probe((*_manager_questions(skillset, keys), *_skill_questions(skillset, keys, held)))
        goals = probe(tuple(_goal_questions(skillset, keys, held)))
        data = probe(tuple(_data_questions(skillset, keys)) if DATA_MANAGER in held else ())
        clock = watch_clock(session, CLOCK_WATCH)
    known = next(iter(_messages(probes[:1], ResourceStates)), None)
    states = None if known is None else known.states
    statuses = tuple(_messages(goals, GoalStatus))
    running = [goal.skill for goal in statuses if goal.state is not State.TERMINATED]
    return seen(
        robot=target.robot,
        endpoint=target.endpoint,
        skillset=target.skillset,
        clock=target.clock,
        local=target.pid is not None,
        router=True,
        keys=_validity(identity, target),
        processes=tuple(process_statuses(target.processes or _expected(target), held)),
        probes=probes,
        clock_seen=clock,
        data=tuple(_messages(data, DataReading)),
        states=states,
        resources=frozenset(resource.name for resource in skillset.resources),
        goals=statuses,
        lost=lost,
        clients=frozenset(name for name in held if name.startswith(CLIENT)),
        disk=disk,
        published_by={} if (table := _table(target)) is None else table.published_by,
        unattended=unattended_state(target, skillset, states or {}, held, running),
    )


@dataclass(frozen=True)
class _Joined:
    """A session with the identity that it shows; None for no router, or one that rejects it with an objection."""

    session: zenoh.Session | None = None
    identity: SessionIdentity | None = None
    objection: str | None = None


def _join(target: Target) -> _Joined:
    identity = None
    try:
        identity = person_identity(target.endpoint)
        session = open_client(target.endpoint, target.robot, CONNECT_TIMEOUT, identity)
    except KeysError as error:
        return _Joined(objection=str(error))
    except RouterUnreachableError as error:
        reason = explained(error, identity)
        return _Joined(objection=None if reason is error else str(reason))
    if identity is not None:
        role = role_at_router(session, identity)
        if role is None:
            session.close()
            return _Joined(objection=str(unknown_name(target.endpoint)))
        identity = identity.in_role(role)
    return _Joined(session, identity)


# --- questions -------------------------------------------------------------------------------------------------------


def _manager_questions(skillset: Skillset, keys: Keys) -> Iterable[ProbeRequest]:
    yield ProbeRequest(RESOURCE_MANAGER, keys.resource_states, QueryStates())
    if skillset.data:
        yield ProbeRequest(DATA_MANAGER, keys.data(skillset.data[0].name), QueryData())


def _skill_questions(skillset: Skillset, keys: Keys, alive: frozenset[str]) -> Iterable[ProbeRequest]:
    """Starts that are too late to start anything: each manager compares the schema before the deadline."""
    for skill in skillset.skills:
        if skill_process(skill.name) in alive:
            start = StartGoal(
                goal_id=new_goal_id(), inputs={}, client="doctor", schema=skillset.schema_hash, deadline=LONG_AGO
            )
            yield ProbeRequest(skill_process(skill.name), keys.start(skill.name), start)


def _goal_questions(skillset: Skillset, keys: Keys, alive: frozenset[str]) -> Iterable[ProbeRequest]:
    for skill in skillset.skills:
        if skill_process(skill.name) in alive:
            yield ProbeRequest(skill_process(skill.name), keys.goal(skill.name), QueryGoal())


def _data_questions(skillset: Skillset, keys: Keys) -> Iterable[ProbeRequest]:
    for datum in skillset.data:
        yield ProbeRequest(DATA_MANAGER, keys.data(datum.name), QueryData())


def _messages(probes: Iterable[Probe], kind: type[M]) -> Iterable[M]:
    """The answers that can be read; the version identifies all others."""
    for each in probes:
        for reply in each.replies[:1]:
            if reply.refusal is None:
                try:
                    yield decode(reply.payload, kind)
                except ProtocolError:
                    continue


def _validity(identity: SessionIdentity | None, target: Target) -> dict[str, datetime]:
    """End of validity of this user's certificate, and of all in the folder of a system that runs here."""
    found = {} if identity is None else {identity.name: read_facts(identity.folder).expires}
    if target.keys is not None:
        with suppress(KeysError):  # another user's folder, or that of one robot
            holders = KeyStore(target.keys).holders()
            found |= {each.name: each.expires for each in holders if each.expires is not None}
    return found


# --- the machine -----------------------------------------------------------------------------------------------------


def _expected(target: Target) -> tuple[ProcessState, ...]:
    """The processes of the robot's table, for a system without a run state."""
    table = _table(target)
    if table is None:
        return ()
    return tuple(ProcessState(name=spec.name) for spec in (*table.functional_layer({}), *table.managers()))


def _table(target: Target) -> Robot | None:
    """The table of the robot; None for one that is not installed under its name."""
    try:
        return find_robot(target.table or target.robot)
    except UnknownNameError:
        return None


def _stranger(port: int, target: Target) -> Listener | None:
    found = listener(port)
    own = {state.pid for state in target.processes}
    return None if found is None or found.pid in own else found


def _not_installed(packages: Iterable[str]) -> tuple[str, ...]:
    return tuple(name for name in packages if find_spec(name) is None)


def _disk(run_dir: Path) -> Disk:
    try:
        free = shutil.disk_usage(run_dir).free
        with tempfile.TemporaryFile(dir=run_dir) as file:
            file.write(b"x")
    except OSError:
        return Disk(run_dir, 0, writable=False)
    return Disk(run_dir, free, writable=True)
