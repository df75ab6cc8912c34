"""The resource manager process: the one judge of who may take what, and of who may keep it."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from typing import Any, TypeVar

from skillwing.dsl import load
from skillwing.dsl.model import Skillset
from skillwing.services.bus import Bus, Handle, Node, Publisher, Sample
from skillwing.services.core.leases import Expired
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.resource_core import ResourceCore, Step
from skillwing.services.managers.alarm import Alarm
from skillwing.services.managers.lease_watch import LeaseWatch
from skillwing.services.managers.presence import Presence
from skillwing.services.managers.serving import serve
from skillwing.services.names import RESOURCE_MANAGER
from skillwing.services.options import required
from skillwing.services.protocol import (
    AttachManager,
    BeginGoal,
    DataSample,
    EndGoal,
    FireEvent,
    FireExtern,
    GoalCall,
    GoalVerdict,
    Keys,
    Lost,
    ProtocolError,
    QueryStates,
    Record,
    ResourceChange,
    ResourceStates,
    Violated,
    decode,
    encode,
)
from skillwing.services.timeline import Timeline

R = TypeVar("R")
log = logging.getLogger(__name__)

GRANT_LEASE = 2.0
"""Wall time in seconds within which a manager has to renew a grant, which it does four times as often."""
DISPATCH_GRACE = 1.0
"""Seconds past its `dispatch_timeout` that a skill may take for `on_dispatch` until its manager counts as hung."""


class ResourceManagerNode:
    """Shell of `ResourceCore`. found: states in which resources are found at the start, not their initial ones."""

    name = RESOURCE_MANAGER
    owns_clock = False

    def __init__(self, skillset: Skillset, found: Mapping[str, str] | None = None) -> None:
        self._skillset = skillset
        self._found = found
        self._keys = Keys(skillset.name)

    def attach(self, bus: Bus) -> None:
        self._bus = bus
        keys = self._keys
        self._timeline = Timeline(bus, keys)
        self._core = ResourceCore(
            self._skillset, source=self.name, new_record_id=self._timeline.new_id, found=self._found
        )
        self._alarm = Alarm(bus, lambda: self._perform(self._core.tick(bus.now())))
        self._changes: dict[str, Publisher] = {
            resource.name: bus.advertise(keys.resource(resource.name), events=True)
            for resource in self._skillset.resources
        }
        self._verdicts: dict[str, Publisher] = {
            skill.name: bus.advertise(keys.verdict(skill.name), events=True) for skill in self._skillset.skills
        }
        for datum in self._core.data_names:
            bus.subscribe(keys.data(datum), self._on_datum, latest_only=True)
        self._leases = LeaseWatch(bus, self._on_silent)
        self._presence = Presence(bus, keys, "**", self._on_gone)
        serve(bus, keys.resource_states, QueryStates, self._answer_states)
        serve(bus, keys.resource_extern, FireExtern, self._answer_extern)
        serve(bus, keys.event("*"), FireEvent, self._answer_event)
        serve(bus, keys.resource_attach, AttachManager, self._answer_attach)
        serve(bus, keys.resource_goal, GoalCall, self._answer_goal)
        self._alive: Handle = bus.declare_alive(keys.alive(self.name))

    def detach(self) -> None:
        self._alive.cancel()

    # --- what comes in -----------------------------------------------------------------------------------------------

    def _answer_states(self, query: QueryStates, key: str) -> ResourceStates:
        del query, key
        return self._core.snapshot(self._bus.now())

    def _answer_extern(self, request: FireExtern, key: str) -> ResourceStates:
        del key
        return self._perform(self._core.fire_extern(request, self._bus.now()))

    def _answer_event(self, request: FireEvent, key: str) -> ResourceStates:
        if self._keys.event(request.event) != key:
            raise ProtocolError(f"the event `{request.event}` was fired on the key of another one, {key}")
        return self._perform(self._core.fire_event(request, self._bus.now()))

    def _answer_attach(self, request: AttachManager, key: str) -> ResourceStates:
        del key
        return self._perform(self._core.attach_manager(request, self._bus.now()))

    def _answer_goal(self, call: GoalCall, key: str) -> GoalVerdict:
        del key
        now = self._bus.now()
        match call:
            case BeginGoal():
                return self._perform(self._core.begin(call, now))
            case EndGoal():
                return self._perform(self._core.end(call, now))
            case _:
                verdict = self._perform(self._core.renew(call))
                self._leases.renew(call.goal_id, GRANT_LEASE)
                return verdict

    def _on_datum(self, sample: Sample) -> None:
        try:
            self._perform(self._core.update_datum(decode(sample.payload, DataSample), self._bus.now()))
        except (ProtocolError, RefusedError) as error:
            # The data manager, which follows all data, is the one that complains.
            log.debug("dropped a sample on %s: %s", sample.key, error)

    def _on_gone(self, process: str) -> None:
        self._perform(self._core.manager_lost(process, self._bus.now()))

    def _on_silent(self, lease: Expired) -> None:
        self._perform(self._core.goal_lost(lease.key, self._bus.now(), f"silent for {lease.silence:.1f} s"))

    def _keep_leases(self) -> None:
        """Every grant has a lease, and nothing else has one."""
        held = {grant.goal_id: grant for grant in self._core.grants}
        for goal_id in self._leases.keys:
            if goal_id not in held:
                self._leases.end(goal_id)
        for goal_id, grant in held.items():
            if goal_id not in self._leases:
                # Its manager renews nothing before `on_dispatch` has returned.
                self._leases.begin(goal_id, max(GRANT_LEASE, grant.skill.dispatch_timeout + DISPATCH_GRACE))

    # --- what goes out -----------------------------------------------------------------------------------------------

    def _perform(self, step: Step[R]) -> R:
        """Publish what a step has brought about; returns its reply."""
        for publication in step.publications:
            match publication:
                case Record():
                    self._timeline.publish(publication)
                case ResourceChange():
                    self._changes[publication.resource].put(encode(publication))
                case Violated() | Lost():
                    self._verdicts[publication.skill].put(encode(publication))
        self._alarm.set(self._core.next_tick(self._bus.now()))
        self._keep_leases()
        return step.reply


def make_resource_manager(options: dict[str, Any]) -> Node:
    """Options: `skillset`, the path of the .skillset file."""
    return ResourceManagerNode(load(required(options, "skillset")))
