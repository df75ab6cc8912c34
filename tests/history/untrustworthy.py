"""Managers that lie now and then: the check has to find out."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count
from pathlib import Path
from typing import Any

import msgspec

from skillwing.dsl import load
from skillwing.services.bus import Bus, Handle, Publisher, Request
from skillwing.services.core.snapshot import Snapshot
from skillwing.services.journal.journal import Journal
from skillwing.services.journal.schema import Identity
from skillwing.services.managers.resource_manager import ResourceManagerNode
from skillwing.services.mocking.fitting import fit_script
from skillwing.services.mocking.script_file import load_scripts
from skillwing.services.mocking.skill import MockSkillNode
from skillwing.services.protocol import (
    Ended,
    EndGoal,
    GoalCall,
    GoalStatus,
    GoalVerdict,
    Granted,
    Keys,
    Message,
    NotReady,
    RecordOutcome,
    ResourceStates,
    ResourceStep,
    decode,
    encode,
)

OFTEN = 7
"""Every so many chances to lie, one is taken."""


class _LyingRequest:
    """A request whose answer is changed on its way out."""

    def __init__(self, request: Request, change: Callable[[Request, bytes], bytes]) -> None:
        self._request = request
        self._change = change

    def __getattr__(self, name: str) -> Any:
        return getattr(self._request, name)

    def reply(self, payload: bytes, attachment: bytes = b"") -> None:
        self._request.reply(self._change(self._request, payload), attachment)


class _LyingBus:
    """A bus on which the answers to some key's requests are changed; drop: requests that are answered unseen."""

    def __init__(
        self,
        bus: Bus,
        key: str,
        change: Callable[[Request, bytes], bytes],
        drop: Callable[[Request], bytes | None] = lambda request: None,
    ) -> None:
        self._bus = bus
        self._key = key
        self._change = change
        self._drop = drop

    def __getattr__(self, name: str) -> Any:
        return getattr(self._bus, name)

    def serve(self, key_expression: str, on_request: Callable[[Request], None]) -> Handle:
        def lie(request: Request) -> None:
            answer = self._drop(request)
            if answer is None:
                on_request(_LyingRequest(request, self._change))  # pyright: ignore[reportArgumentType]
            else:
                request.reply(answer)

        return self._bus.serve(key_expression, lie if key_expression == self._key else on_request)


class GrantsTwice(ResourceManagerNode):
    """Grants at times what somebody else holds."""

    def attach(self, bus: Bus) -> None:
        refusals = count(1)

        def change(request: Request, payload: bytes) -> bytes:
            verdict = decode(payload, _union(GoalVerdict))
            if isinstance(verdict, NotReady) and next(refusals) % OFTEN == 0:
                token, step = int(bus.now() * 1000), self._core.last_step
                return encode(Granted(goal_id=verdict.goal_id, token=token, step=step, record=verdict.record))
            return payload

        super().attach(_lying(bus, Keys("workshop").resource_goal, change))


class RepliesOldStates(ResourceManagerNode):
    """Answers at times with states that it has told before."""

    def attach(self, bus: Bus) -> None:
        questions, told = count(1), list[bytes]()

        def change(request: Request, payload: bytes) -> bytes:
            told.append(payload)
            return told[-min(5, len(told))] if next(questions) % OFTEN == 0 else payload

        super().attach(_lying(bus, Keys("workshop").resource_states, change))


class ForgetsEnds(ResourceManagerNode):
    """Acknowledges at times an end, and applies nothing."""

    def attach(self, bus: Bus) -> None:
        ends = count(1)

        def drop(request: Request) -> bytes | None:
            call = decode(request.payload, _union(GoalCall))
            if isinstance(call, EndGoal) and next(ends) % OFTEN == 0:
                step = self._core.last_step + 1
                return encode(Ended(goal_id=call.goal_id, held=True, reason="", step=step, record=""))
            return None

        super().attach(_lying(bus, Keys("workshop").resource_goal, lambda request, payload: payload, drop))


class ForgetsOutcomes(ResourceManagerNode):
    """Acknowledges at times a local outcome, and does not store it."""

    def attach(self, bus: Bus) -> None:
        outcomes = count(1)

        def drop(request: Request) -> bytes | None:
            call = decode(request.payload, _union(GoalCall))
            if isinstance(call, RecordOutcome) and next(outcomes) % OFTEN == 0:
                ended = Ended(
                    goal_id=call.goal_id,
                    held=False,
                    reason="",
                    step=self._core.last_step,
                    record="",
                    terminal=call.terminal,
                )
                return encode(ended)
            return None

        super().attach(_lying(bus, Keys("workshop").resource_goal, lambda request, payload: payload, drop))


class LosesSteps(ResourceManagerNode):
    """Does not publish some steps."""

    def attach(self, bus: Bus) -> None:
        self._published = count(1)
        super().attach(bus)

    def _put(self, publisher: Publisher, message: Message) -> None:
        if not (isinstance(message, ResourceStep) and next(self._published) % OFTEN == 0):
            super()._put(publisher, message)


class RewritesSteps(LosesSteps):
    """Publishes some steps once more, with fewer records."""

    def _put(self, publisher: Publisher, message: Message) -> None:
        ResourceManagerNode._put(self, publisher, message)
        if isinstance(message, ResourceStep) and next(self._published) % OFTEN == 0:
            ResourceManagerNode._put(self, publisher, msgspec.structs.replace(message, records=message.records[1:]))


class SwapsSteps(LosesSteps):
    """Publishes some steps after the next one."""

    _late: ResourceStep | None = None

    def _put(self, publisher: Publisher, message: Message) -> None:
        if isinstance(message, ResourceStep) and next(self._published) % OFTEN == 0:
            self._late = message
            return
        ResourceManagerNode._put(self, publisher, message)
        if isinstance(message, ResourceStep) and self._late is not None:
            late, self._late = self._late, None
            ResourceManagerNode._put(self, publisher, late)


class NamesStepsTooEarly(ResourceManagerNode):
    """Replies at times to a change with the number of the step before."""

    def attach(self, bus: Bus) -> None:
        replies = count(1)

        def change(request: Request, payload: bytes) -> bytes:
            states = decode(payload, ResourceStates)
            early = msgspec.structs.replace(states, step=states.step - 1)
            return encode(early) if next(replies) % OFTEN == 0 else payload

        super().attach(_lying(bus, Keys("workshop").resource_extern, change))


class SkipsNumbers(ResourceManagerNode):
    """Leaves out numbers when it continues from its journal."""

    def _resume(self, snapshot: Snapshot) -> None:
        super()._resume(msgspec.structs.replace(snapshot, step=snapshot.step + OFTEN))


class NamesEarlierSteps(MockSkillNode):
    """Publishes the ends of its goals with the number of the step before."""

    def _publish(self, status: GoalStatus) -> None:
        super()._publish(
            msgspec.structs.replace(status, after_step=status.after_step - 1) if status.terminal else status
        )


def make_names_earlier_steps(options: dict[str, Any]) -> MockSkillNode:
    skillset = load(options["skillset"])
    script = load_scripts([Path(script) for script in options["scripts"]], skillset)
    return NamesEarlierSteps(skillset, options["skill"], fit_script(script, skillset))


def make_loses_steps(options: dict[str, Any]) -> ResourceManagerNode:
    return LosesSteps(load(options["skillset"]))


def make_rewrites_steps(options: dict[str, Any]) -> ResourceManagerNode:
    return RewritesSteps(load(options["skillset"]))


def make_swaps_steps(options: dict[str, Any]) -> ResourceManagerNode:
    return SwapsSteps(load(options["skillset"]))


def make_names_steps_too_early(options: dict[str, Any]) -> ResourceManagerNode:
    return NamesStepsTooEarly(load(options["skillset"]))


def make_skips_numbers(options: dict[str, Any]) -> ResourceManagerNode:
    skillset = load(options["skillset"])
    identity = Identity("", skillset.name, skillset.schema_hash)
    return SkipsNumbers(skillset, journal=Journal(Path(options["journal"]), identity))


def make_grants_twice(options: dict[str, Any]) -> ResourceManagerNode:
    return GrantsTwice(load(options["skillset"]))


def make_replies_old_states(options: dict[str, Any]) -> ResourceManagerNode:
    return RepliesOldStates(load(options["skillset"]))


def make_forgets_ends(options: dict[str, Any]) -> ResourceManagerNode:
    return ForgetsEnds(load(options["skillset"]))


def make_forgets_outcomes(options: dict[str, Any]) -> ResourceManagerNode:
    return ForgetsOutcomes(load(options["skillset"]))


def _lying(bus: Bus, *how: Any) -> Bus:
    return _LyingBus(bus, *how)  # pyright: ignore[reportReturnType]


def _union(kind: Any) -> Any:
    """A union of tagged messages as `decode` takes it; type checkers have no name for its type."""
    return kind
