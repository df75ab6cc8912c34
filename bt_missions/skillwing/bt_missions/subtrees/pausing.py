"""Nodes that hold a mission for a while, and let it continue where it was.

Neither node halts its children. It holds skills: their goals are interrupted, and start again later. All other nodes
are ticked as always. So guards stay active, mapping continues, and a branch that loses its sensor is still replaced by
another one.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Composite, Parallel
from py_trees.decorators import Decorator

from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.leaves.source_location import set_caller_location
from skillwing.bt_missions.subtrees.lease import WithLease
from skillwing.bt_missions.subtrees.parallel_all import ParallelAll
from skillwing.dsl.queries import checks_of, needed_by, taken_by
from skillwing.services.protocol import Ending, Terminal

AGAIN_AFTER = 1.0
"""Time after which a paused node starts `meanwhile` again when it has failed, in seconds of robot time."""

_MESSAGES_OF_PY_TREES = ("success", "failure")
"""Messages of leaves that only repeat their status."""


class StateChange(NamedTuple):
    """A resource and its new state."""

    resource: str
    state: str


class WhileGranted(Decorator):
    """Runs its child while `resource` is in one of `states`. At other times it holds the skills that need the resource.

    FAILURE when that lasts for more than `patience` seconds of robot time, or when `ended_by` happens meanwhile. For
    example: a person keeps the robot, or has put it away. robot: its name, in a mission on several robots; skills of
    others are not held.
    """

    def __init__(
        self,
        name: str,
        context: MissionContext,
        child: Behaviour,
        *,
        resource: str,
        states: tuple[str, ...],
        patience: float,
        ended_by: StateChange,
        robot: str | None = None,
    ) -> None:
        super().__init__(name, child)
        set_caller_location(self)
        self._context = context.of(robot)
        self.robot = self._context.robot
        self.skillset = self._context.skillset
        self.resource = resource
        self.states = states
        self.patience = patience
        self.ended_by = ended_by
        self._gone_since: float | None = None
        self._can_end = False
        for leaf in _skills_below(child):
            if leaf.robot == self.robot:
                leaf.follow(self)

    @property
    def reason(self) -> str | None:
        """The state of the resource while it holds the child; None otherwise."""
        return None if self._gone_since is None else self._state_text

    def blocks(self, skill: str) -> str | None:
        if self._gone_since is None or self.resource not in needed_by(self._context.skillset.skill(skill)):
            return None
        return self._state_text

    def explains(self, skill: str, terminal: Terminal) -> bool:
        if terminal.ending is Ending.INVARIANT_VIOLATED:
            return terminal.subject == self.resource
        checks = checks_of(self._context.skillset.skill(skill))
        refused = terminal.ending is Ending.NOT_READY
        return refused and any(self.resource in checks.get(check, ()) for check in terminal.failing)

    def tick(self) -> Iterator[Behaviour]:
        if self.status is not Status.RUNNING:
            self._gone_since = None
        over = self._check_resource()
        if over is None:
            yield from super().tick()
            return
        self.feedback_message = over
        self._context.observe(over, self._context.interface.change_record(self.resource), failed=True)
        self.stop(Status.FAILURE)
        yield self

    def update(self) -> Status:
        return self.decorated.status

    def _check_resource(self) -> str | None:
        """Update the hold. Returns the reason if the node has to end."""
        interface, now = self._context.interface, self._context.now()
        if interface.state(self.resource) in self.states:
            if self._gone_since is not None:
                self._gone_since = None
                self._observe_change()
            self.feedback_message = self._state_text
            return None
        ended = interface.state(self.ended_by.resource) == self.ended_by.state
        if self._gone_since is None:
            self._gone_since = now
            self._can_end = False
            self._observe_change()
        self._can_end |= not ended
        self.feedback_message = f"{self._state_text}; waiting for {' or '.join(self.states)}"
        if ended and self._can_end:
            return f"{self._state_text} and {self.ended_by.resource} became {self.ended_by.state}"
        if now - self._gone_since > self.patience:
            return f"{self._state_text} for more than {self.patience:g} s; it has to be {' or '.join(self.states)}"
        return None

    def _observe_change(self) -> None:
        self._context.observe(self._state_text, self._context.interface.change_record(self.resource))

    @property
    def _state_text(self) -> str:
        return f"{self.resource} is {self._context.interface.state(self.resource) or 'not known'}"


class Pausable(Composite):
    """Runs `body`. While paused, it runs `meanwhile`, and holds skills of `body`: `paused_skills`.

    A pause needs `condition`: it is refused if the condition fails, and ends by itself when it fails later.
    children: condition, meanwhile, body. The node ends as `body` does.
    """

    def __init__(
        self, name: str, context: MissionContext, condition: Behaviour, meanwhile: Behaviour, body: Behaviour
    ) -> None:
        super().__init__(name, [condition, meanwhile, body])
        set_caller_location(self)
        self._condition, self._meanwhile, self._body = condition, meanwhile, body
        self._context = context
        self._paused: str | None = None
        self._again_at = 0.0
        self.held = tuple(paused_skills(body, meanwhile))
        for leaf in self.held:
            leaf.follow(self)

    @property
    def reason(self) -> str | None:
        """Reason of the pause; None if it is not paused."""
        return self._paused

    def pause(self, reason: str) -> str | None:
        """Hold the body from now on. Returns the reason if that is not possible; then nothing has changed."""
        if self.status is not Status.RUNNING:
            return "the mission is in a part that is not paused"
        if self._paused is None:
            try:
                self._condition.tick_once()
            except Exception as error:  # noqa: BLE001 - an operator's request must not end the mission
                return f"its condition raised {type(error).__name__}: {error}"
            if self._condition.status is Status.FAILURE:
                return _failure_text(self._condition)
            self._paused = reason
            self._again_at = self._context.now()
        return None

    def resume(self) -> None:
        """Let the body continue where it was. No effect if it is not paused."""
        self._paused = None

    def blocks(self, skill: str) -> str | None:
        return self._paused

    def explains(self, skill: str, terminal: Terminal) -> bool:
        return False

    def tick(self) -> Iterator[Behaviour]:
        if self.status is not Status.RUNNING:
            self._paused = None
            for child in self.children:
                child.stop(Status.INVALID)
        if self._paused is not None:
            yield from self._condition.tick()
            if self._condition.status is Status.FAILURE:
                self.resume()
        if self._paused is None and self._meanwhile.status is not Status.INVALID:
            self._meanwhile.stop(Status.INVALID)
        yield from self._body.tick()
        self.feedback_message = "" if self._paused is None else f"paused: {self._paused}"
        if self._body.status is not Status.RUNNING:
            for child in (self._condition, self._meanwhile):
                child.stop(Status.INVALID)
            self.stop(self._body.status)
        else:
            if self._paused is not None:
                yield from self._tick_meanwhile()
            self.status = Status.RUNNING
        yield self

    def stop(self, new_status: Status = Status.INVALID) -> None:
        self._paused = None
        super().stop(new_status)

    def _tick_meanwhile(self) -> Iterator[Behaviour]:
        if self._context.now() < self._again_at:
            return
        yield from self._meanwhile.tick()
        if self._meanwhile.status is Status.FAILURE:
            self._again_at = self._context.now() + AGAIN_AFTER


def paused_skills(body: Behaviour, meanwhile: Behaviour) -> Iterator[SkillAction]:
    """The leaves of `body` that a pause holds: all but those that run beside a skill in the way of `meanwhile`.

    A skill is in the way if it takes a resource that a skill of `meanwhile` takes. Such a skill is always held. A
    `meanwhile` that takes nothing of `body` holds all of it, so no pause leaves the only running skill running.
    """

    def resources(node: Behaviour) -> frozenset[tuple[str, str]]:
        return frozenset[tuple[str, str]]().union(*(_taken(leaf) for leaf in _skills_below(node)))

    claimed = resources(meanwhile)

    def held(node: Behaviour, *, goes_on: bool) -> Iterator[SkillAction]:
        if isinstance(node, SkillAction) and not (goes_on and claimed.isdisjoint(resources(node))):
            yield node
        for child in node.children:
            others = (
                [each for each in node.children if each is not child]
                if isinstance(node, Parallel | ParallelAll | WithLease)
                else []
            )
            yield from held(child, goes_on=goes_on or any(claimed & resources(each) for each in others))

    return held(body, goes_on=False)


def _failure_text(condition: Behaviour) -> str:
    """Reason why a condition fails: the message of the leaf that decided, or else that it does not hold."""
    leaf = condition.tip() or condition
    said = leaf.feedback_message
    return f"its condition `{condition.name}` does not hold" if said in ("", *_MESSAGES_OF_PY_TREES) else said


def _taken(leaf: SkillAction) -> Iterator[tuple[str, str]]:
    """Robot and name of each resource that the skill of a leaf takes; none for an unknown skill."""
    skill = next((each for each in leaf.skillset.skills if each.name == leaf.skill), None)
    return ((leaf.robot, resource) for resource in (taken_by(skill) if skill else ()))


def _skills_below(node: Behaviour) -> Iterator[SkillAction]:
    return (leaf for leaf in node.iterate() if isinstance(leaf, SkillAction))
