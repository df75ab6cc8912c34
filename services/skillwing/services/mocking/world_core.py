"""The core of a mocked world: its data, and its reactions to events. Pure: no bus, no clock."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

from skillwing.dsl.default_values import default_data
from skillwing.dsl.model import Skillset
from skillwing.services.core.bounded_dict import GOALS_REMEMBERED, BoundedDict
from skillwing.services.mocking.fitting import FittedReaction, FittedScript
from skillwing.services.mocking.signals import Constant, Signal, SignalContext, value_at
from skillwing.services.protocol import Ending, GoalStatus, MockedGoal, Record, State


@dataclass(frozen=True, slots=True)
class Trigger:
    resource: str
    state: str


@dataclass(frozen=True, slots=True)
class Fire:
    event: str


@dataclass(frozen=True, slots=True)
class SetDatum:
    """Set a datum. inputs: of the goal that sets it. goal_id: the goal whose end without a result stops the change."""

    datum: str
    signal: Signal
    inputs: Mapping[str, Any]
    goal_id: str | None = None


@dataclass(frozen=True, slots=True)
class EndMockedGoal:
    skill: str
    result: str


@dataclass(frozen=True, slots=True)
class StopReactions:
    """Cancel the delayed actions of a goal, and hold the data that it changes."""

    goal_id: str


MockAction: TypeAlias = "Trigger | Fire | SetDatum | EndMockedGoal | StopReactions"


@dataclass(frozen=True, slots=True)
class Due:
    """An action that is due `after` so many seconds. cause: the timeline record that led to it.

    goal_id: the goal that `StopReactions` names to cancel the action; None for an action that does not stop.
    """

    action: MockAction
    after: float
    cause: str | None
    goal_id: str | None = None


class Reactions:
    """The actions that are due after each event.

    follow_goals, follow_resources: True if any reaction waits for the start or end of goals, or for a resource.
    """

    def __init__(self, script: FittedScript) -> None:
        self._script = script
        events = [each.said.when for each in script.reactions if each.said.when is not None]
        self.follow_goals = any(when.starts is not None or when.ends is not None for when in events)
        self.follow_resources = any(when.resource is not None for when in events)
        self._done: set[int] = set()
        self._inputs: BoundedDict[str, Mapping[str, Any]] = BoundedDict(GOALS_REMEMBERED)
        self._running: BoundedDict[str, None] = BoundedDict(GOALS_REMEMBERED)
        self._over: BoundedDict[str, None] = BoundedDict(GOALS_REMEMBERED)

    def begin(self) -> tuple[Due, ...]:
        """The start of the world."""
        first = [Due(Trigger(name, state), 0.0, None) for name, state in self._script.resources.items()]
        return (*first, *self._react(lambda reaction: reaction.said.when is None, {}, None))

    def on_goal(self, goal: MockedGoal) -> None:
        """Remember the inputs of a goal."""
        self._inputs[goal.goal_id] = goal.inputs

    def on_resource(self, change: Record) -> tuple[Due, ...]:
        """A resource has changed."""

        def concerned(reaction: FittedReaction) -> bool:
            when = reaction.said.when
            return when is not None and (when.resource, when.becomes) == (change.subject, change.after)

        return self._react(concerned, {}, change.id)

    def on_status(self, status: GoalStatus) -> tuple[Due, ...]:
        """The state of a goal has changed. Repetitions are ignored.

        What a goal began stops with its end, unless it ended with a result.
        """
        seen = self._running if status.state is State.RUNNING else self._over
        if status.state not in (State.RUNNING, State.TERMINATED) or status.goal_id in seen:
            return ()
        seen[status.goal_id] = None
        inputs = self._inputs.get(status.goal_id) or {}
        end = status.terminal
        found = self._react(
            lambda reaction: _concerns(reaction, status), inputs, status.record, status.goal_id if end is None else None
        )
        if end is None or end.ending in _WITH_A_RESULT or status.goal_id not in self._running:
            return found
        return (Due(StopReactions(status.goal_id), 0.0, status.record), *found)

    def _react(
        self,
        concerned: Callable[[FittedReaction], bool],
        inputs: Mapping[str, Any],
        cause: str | None,
        goal_id: str | None = None,
    ) -> tuple[Due, ...]:
        found: list[Due] = []
        for number, reaction in enumerate(self._script.reactions):
            if number in self._done or not concerned(reaction):
                continue
            if reaction.said.once:
                self._done.add(number)
            actions = _actions(reaction, inputs, goal_id)
            found += [Due(action, reaction.said.after, cause, goal_id) for action in actions]
        return tuple(found)


_WITH_A_RESULT = (Ending.SUCCEEDED, Ending.NOT_HELD)


def _concerns(reaction: FittedReaction, status: GoalStatus) -> bool:
    when = reaction.said.when
    if when is None:
        return False
    if status.terminal is None:
        return when.starts == status.skill
    if when.ends != status.skill:
        return False
    end = status.terminal
    # A result that held has its name, another end its label, such as `N_ARRIVED`.
    names = {end.label, str(end.ending), end.result if end.ending is Ending.SUCCEEDED else None}
    return not reaction.endings or not names.isdisjoint(reaction.endings)


def _actions(reaction: FittedReaction, inputs: Mapping[str, Any], goal_id: str | None) -> Iterator[MockAction]:
    yield from (SetDatum(name, signal, inputs, goal_id) for name, signal in reaction.set.items())
    yield from (Trigger(name, state) for name, state in reaction.said.trigger.items())
    yield from (Fire(event) for event in reaction.fire)
    yield from (EndMockedGoal(skill, result) for skill, result in reaction.said.end.items())


# --- data ------------------------------------------------------------------------------------------------------------


@dataclass(slots=True)
class _Track:
    """The signal of a datum since `begun`. goal_id: as in `SetDatum`."""

    signal: Signal
    before: Any
    begun: float
    inputs: Mapping[str, Any]
    goal_id: str | None = None
    samples: int = 0


class MockedValues:
    """The data of a mocked world: those of the script, and defaults that satisfy the guards of the skills."""

    def __init__(self, skillset: Skillset, script: FittedScript, now: float) -> None:
        self._defaults = default_data(skillset)
        self._script = script
        self._tracks: dict[str, _Track] = {}
        self.reset(now)

    def reset(self, now: float) -> None:
        """Restart the data of the script."""
        for name, value in self._defaults.items():
            self._tracks[name] = _Track(self._script.data.get(name, Constant(value)), value, now, {})

    def set(
        self,
        datum: str,
        signal: Signal,
        now: float,
        inputs: Mapping[str, Any] | None = None,
        goal_id: str | None = None,
    ) -> None:
        """Give a datum another signal, from its present value on. Raises KeyError for an unknown input."""
        before = self.value(datum, now)
        track = _Track(signal, before, now, inputs or {}, goal_id)
        self._evaluate(track, now)
        self._tracks[datum] = track

    def hold(self, goal_id: str, now: float) -> None:
        """Hold the data that a goal changes at their present values."""
        for datum, track in self._tracks.items():
            if track.goal_id == goal_id:
                value = self._evaluate(track, now)
                self._tracks[datum] = _Track(Constant(value), value, now, {})

    def value(self, datum: str, now: float) -> Any:
        """The value at a time."""
        return self._evaluate(self._tracks[datum], now)

    def sample(self, datum: str, now: float) -> Any:
        """The value to publish next."""
        value = self.value(datum, now)
        self._tracks[datum].samples += 1
        return value

    def values(self, now: float) -> dict[str, Any]:
        """All values."""
        return {name: self.value(name, now) for name in self._tracks}

    def _evaluate(self, track: _Track, now: float) -> Any:
        context = SignalContext(track.before, elapsed=now - track.begun, sample=track.samples, inputs=track.inputs)
        return value_at(track.signal, context)
