"""Check that a mission cannot end with its robot away from the rescue goal, by the shape of its trees.

The check walks through a tree without a robot. Its only state is the place of the robot. For each node it computes
from which places the node is reached, how it can end from there, and where the robot is then. Every end that a node
does not exclude is possible. There are few places, so a loop is walked until it yields no new one.

For a node that cannot be read, no end is possible: its own problem is reported already.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum, auto
from typing import TypeAlias

from py_trees.behaviour import Behaviour
from py_trees.common import ParallelPolicy, Status
from py_trees.composites import Parallel, Selector, Sequence
from py_trees.decorators import FailureIsSuccess, Inverter, OneShot, Repeat, Retry, SuccessIsFailure, SuccessIsRunning

from skillwing.bt_missions.checking.intended_names import intended_name
from skillwing.bt_missions.checking.repetition import may_run_again
from skillwing.bt_missions.checking.tree_check import ends_of, skill_of
from skillwing.bt_missions.leaves.conditions import ResourceIs
from skillwing.bt_missions.leaves.placeholder import PlaceholderNode, is_guessed, is_incomplete
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.subtrees.composites import OnEnding
from skillwing.bt_missions.subtrees.decorators import Deadline, RepeatUntil, RunOnce
from skillwing.bt_missions.subtrees.flow_control import IfThenElse, SequenceWithMemory, ValueSwitch
from skillwing.bt_missions.subtrees.lease import WithLease
from skillwing.bt_missions.subtrees.parallel_all import ParallelAll
from skillwing.bt_missions.subtrees.pausing import Pausable, WhileGranted
from skillwing.dsl.model import Skillset
from skillwing.dsl.queries import needed_by
from skillwing.dsl.suggest import listed
from skillwing.services.rescue_goal import RescueGoal


class Place(Enum):
    """Place of the robot. GOAL: at its rescue goal. RELEASED: away, but this tree no longer has to bring it there. A
    person has taken the robot, or the skill that leads to the goal has failed."""

    GOAL = auto()
    AWAY = auto()
    RELEASED = auto()


Places: TypeAlias = frozenset[Place]


@dataclass(frozen=True, slots=True)
class NodeEnd:
    """A possible end of a node, and the node below it that is the reason."""

    status: Status
    place: Place
    by: Behaviour


@dataclass(frozen=True, slots=True)
class NodeOutcome:
    """Possible ends of a node. during: places where the robot may be while it runs."""

    ends: frozenset[NodeEnd]
    during: Places

    def places_after(self, *statuses: Status) -> Places:
        """Places where the robot may be after an end with one of these statuses."""
        return frozenset(end.place for end in self.ends if end.status in statuses)


def rescue_problems(
    root: Behaviour, rescue: Behaviour | None, skillset: Skillset, goal: RescueGoal, robot: str = ""
) -> Iterator[tuple[Behaviour, str]]:
    """Each problem as a sentence, with the first node that it is about. robot: its name, if there are several."""
    walker = _TreeWalker(skillset, goal, robot)
    run = walker.walk(root, frozenset({Place.GOAL}))
    whose = f" of `{robot}`" if robot else ""
    yield from _sentences(root, run, f"`{robot}`" if robot else "The mission", goal)
    if Place.AWAY not in run.during or isinstance(rescue, PlaceholderNode):
        return
    if rescue is None:
        first, who = _first_away(root, goal, robot), f"`{robot}`" if robot else "the robot"
        text = f"The mission has no rescue{whose}, and `{first}` brings {who} away from its rescue goal"
        yield root, f"{text} (`{goal.resource}` {goal.state}). Add a tree `rescue`, which runs when somebody aborts."
    else:
        yield from _sentences(rescue, walker.walk(rescue, frozenset({Place.AWAY})), f"The rescue{whose}", goal)


def _first_away(root: Behaviour, goal: RescueGoal, robot: str) -> str:
    leaves = (leaf.skill for leaf in root.iterate() if isinstance(leaf, SkillAction) and leaf.robot == robot)
    return next((skill for skill in leaves if intended_name(skill, goal.left_by)), root.name)


def _sentences(root: Behaviour, walk: NodeOutcome, what: str, goal: RescueGoal) -> Iterator[tuple[Behaviour, str]]:
    where = " or ".join(goal.away.values())
    for status in (Status.FAILURE, Status.SUCCESS):
        reasons = {end.by.id for end in walk.ends if (end.status, end.place) == (status, Place.AWAY)}
        named = [node for node in root.iterate() if node.id in reasons]
        if not named:
            continue
        names = listed(dict.fromkeys(node.name for node in named))
        if status is Status.FAILURE:
            when = f"when {names} fails" if len(named) == 1 else f"when one of {names} fails"
            yield named[0], f"{what} may end {where} {when}. Put it into a Fallback that runs `{goal.skill}` then."
        else:
            yield named[0], f"{what} may end {where} after {names}. Let it run `{goal.skill}`."


class _TreeWalker:
    def __init__(self, skillset: Skillset, goal: RescueGoal, robot: str) -> None:
        self._skillset = skillset
        self._robot = robot
        self._goal = goal
        self._needed = goal.needed_resources(skillset)

    def walk(self, node: Behaviour, places: Places) -> NodeOutcome:
        """Outcome of a node that is reached with the robot at any of these places."""
        match node:
            case PlaceholderNode():
                below = [self.walk(child, places) for child in node.children]
                walk = NodeOutcome(frozenset(), places.union(*(each.during for each in below)))
            case Sequence():
                walk = self._in_turn(node, Status.SUCCESS, places)
            case Selector():
                walk = self._in_turn(node, Status.FAILURE, places)
            case Parallel():
                walk = self._at_once(node, places)
            case ParallelAll():
                walk = self._each_to_its_end(node, places)
            case OnEnding():
                attempt, then = node.children
                first = self.walk(attempt, places)
                walk = _either(first, self.walk(then, first.places_after(Status.FAILURE)))
            case WithLease():
                run = self.walk(node.children[1], places)
                walk = NodeOutcome(run.ends | self._failures(node, places | run.during), places | run.during)
            case IfThenElse() | ValueSwitch():
                walk = self._chosen(node, places) if isinstance(node, IfThenElse) else self._switched(node, places)
            case Pausable():
                _, meanwhile, body = node.children
                run = self.walk(body, places)
                walk = NodeOutcome(run.ends, run.during | self.walk(meanwhile, run.during).during)
            case _ if len(node.children) == 1:
                walk = self._decorated(node, node.children[0], places)
            case _ if node.children:
                walk = _either(*(self.walk(child, places) for child in node.children))
            case _:
                walk = self._leaf(node, places)
        return walk

    def _in_turn(self, node: Sequence | Selector, goes_on: Status, places: Places) -> NodeOutcome:
        """Children one after the other, as long as each ends with `goes_on`."""
        ends, during, reached = set[NodeEnd](), set(places), places
        last = frozenset(NodeEnd(goes_on, place, node) for place in places)
        for index, child in enumerate(node.children):
            walk = self.walk(child, reached)
            ends |= {end for end in walk.ends if end.status is not goes_on}
            during |= walk.during
            if not node.memory:
                # The children before it are ticked again while it runs.
                again = [self.walk(earlier, walk.during) for earlier in node.children[:index]]
                ends |= {end for each in again for end in each.ends if end.status is not goes_on}
            last = frozenset(end for end in walk.ends if end.status is goes_on)
            reached = walk.places_after(goes_on)
            if isinstance(node, SequenceWithMemory) and may_run_again(node):
                reached |= places  # a new run may start with the next child
            if not reached:
                break
        return NodeOutcome(frozenset(ends) | last, frozenset(during))

    def _chosen(self, node: IfThenElse, places: Places) -> NodeOutcome:
        condition, then, *otherwise = node.children
        asked = self.walk(condition, places)
        walks = [self.walk(then, asked.places_after(Status.SUCCESS))]
        walks += (self.walk(child, asked.places_after(Status.FAILURE)) for child in otherwise)
        failed = frozenset(end for end in asked.ends if end.status is Status.FAILURE and not otherwise)
        return _either(NodeOutcome(failed, asked.during), *walks)

    def _switched(self, node: ValueSwitch, places: Places) -> NodeOutcome:
        """One of the children. A variable that changes halts it anywhere, and starts another one there."""
        while True:
            walk = _either(*(self.walk(child, places) for child in node.children))
            if not callable(node.variable) or walk.during <= places:
                return walk
            places |= walk.during

    def _at_once(self, node: Parallel, places: Places) -> NodeOutcome:
        """Children at the same time. One that does not move the robot may end wherever the others bring it."""
        walks = {child.id: self.walk(child, places) for child in node.children}
        everywhere = places.union(*(walk.during | walk.places_after(*Status) for walk in walks.values()))
        moving = {key for key, walk in walks.items() if not walk.during | walk.places_after(*Status) <= places}
        walks |= {child.id: self.walk(child, everywhere) for child in node.children if child.id not in moving}
        deciding = list(node.children)
        if isinstance(node.policy, ParallelPolicy.SuccessOnSelected):
            deciding = node.policy.children
        elif isinstance(node.policy, ParallelPolicy.SuccessOnAll):
            deciding = [child for child in node.children if child.id in moving] or deciding
        failed = {end for walk in walks.values() for end in walk.ends if end.status is Status.FAILURE}
        done = {end for child in deciding for end in walks[child.id].ends if end.status is Status.SUCCESS}
        return NodeOutcome(frozenset(failed | done), everywhere)

    def _each_to_its_end(self, node: ParallelAll, places: Places) -> NodeOutcome:
        """Children at the same time, none of which halts another: the robot is where its own child leaves it."""
        walks = [self.walk(child, places) for child in node.children]
        moving = [walk for walk in walks if not walk.during | walk.places_after(*Status) <= places]
        if len(moving) > 1:
            return _either(*walks)
        fail = any(end.status is Status.FAILURE for walk in walks for end in walk.ends)
        ends = moving[0].ends if moving else frozenset[NodeEnd]().union(*(walk.ends for walk in walks))
        ends |= {NodeEnd(Status.FAILURE, end.place, end.by) for end in ends if fail}
        return NodeOutcome(frozenset(ends), places.union(*(walk.during for walk in walks)))

    def _decorated(self, node: Behaviour, child: Behaviour, places: Places) -> NodeOutcome:
        """A decorator. One of an unknown type ends as its child does."""
        if isinstance(node, Retry | Repeat | SuccessIsRunning | RepeatUntil):
            return self._repeated(node, child, places)
        walk = self.walk(child, places)
        match node:
            case Inverter():
                turned = {Status.SUCCESS: Status.FAILURE, Status.FAILURE: Status.SUCCESS}
                ends = frozenset(NodeEnd(turned[end.status], end.place, end.by) for end in walk.ends)
            case FailureIsSuccess() | SuccessIsFailure():
                only = Status.SUCCESS if isinstance(node, FailureIsSuccess) else Status.FAILURE
                ends = frozenset(NodeEnd(only, end.place, end.by) for end in walk.ends)
            case OneShot() if may_run_again(node):
                later = {node.when_skipped} if isinstance(node, RunOnce) else {end.status for end in walk.ends}
                ends = walk.ends | {NodeEnd(status, place, node) for status in later for place in places}
            case Deadline():
                ends = walk.ends | self._failures(node, walk.during)
            case WhileGranted() if node.robot != self._robot:
                ends = walk.ends | self._failures(node, walk.during)
            case WhileGranted() if (resource := self._meant_resource(node.resource)) is not None:
                ends = walk.ends | self._failures(node, walk.during, of=resource)
            case _:
                ends = walk.ends
        return NodeOutcome(ends, walk.during)

    def _repeated(
        self, node: Retry | Repeat | SuccessIsRunning | RepeatUntil, child: Behaviour, places: Places
    ) -> NodeOutcome:
        walk = self._looped(child, places, Status.FAILURE if isinstance(node, Retry) else Status.SUCCESS)
        if isinstance(node, Retry) or (isinstance(node, Repeat) and node.num_success >= 0 and not is_incomplete(node)):
            return walk
        ends = {end for end in walk.ends if end.status is Status.FAILURE}
        if isinstance(node, RepeatUntil):
            ends |= {NodeEnd(Status.SUCCESS, place, node) for place in places | walk.places_after(*Status)}
        return NodeOutcome(frozenset(ends), walk.during)

    def _looped(self, child: Behaviour, places: Places, again: Status) -> NodeOutcome:
        """A child that is repeated after each end with `again`."""
        while True:
            walk = self.walk(child, places)
            reached = places | walk.places_after(again)
            if reached == places:
                return walk
            places = reached

    def _failures(self, node: Behaviour, places: Places, of: str | None = None) -> frozenset[NodeEnd]:
        """Failures of a node at each of these places. of: the resource whose state is the reason."""
        given_away = of in self._needed
        return frozenset(
            NodeEnd(Status.FAILURE, Place.RELEASED if given_away and place is Place.AWAY else place, node)
            for place in places
        )

    # --- leaves ------------------------------------------------------------------------------------------------------

    def _leaf(self, leaf: Behaviour, places: Places) -> NodeOutcome:
        possible = ends_of(leaf, self._skillset)
        ends = {end for place in places for end in self._ends_of_leaf(leaf, place) if end.status in possible}
        own = leaf if isinstance(leaf, SkillAction) and leaf.robot == self._robot else None
        skill = None if own is None else skill_of(own, self._skillset)
        leaves = skill is not None and skill.name in self._goal.left_by
        return NodeOutcome(frozenset(ends), places | {Place.AWAY} if leaves else places)

    def _ends_of_leaf(self, leaf: Behaviour, place: Place) -> Iterator[NodeEnd]:
        match leaf:
            case SkillAction() | ResourceIs() if leaf.robot != self._robot:
                yield from (NodeEnd(status, place, leaf) for status in (Status.SUCCESS, Status.FAILURE))
            case SkillAction():
                skill = skill_of(leaf, self._skillset)
                ends = [] if skill is None else self._ends_of_skill(leaf, skill.name, place)
                # It may fail for certain, even if its outcomes cannot be read.
                yield from (end for end in ends if end.status is Status.FAILURE or not is_incomplete(leaf))
            case ResourceIs():
                yield from self._ends_of_condition(leaf, place)
            case _:
                yield from (NodeEnd(status, place, leaf) for status in (Status.SUCCESS, Status.FAILURE))

    def _ends_of_skill(self, leaf: SkillAction, skill: str, place: Place) -> Iterator[NodeEnd]:
        away, moving = place is not Place.GOAL, self._goal.resource in needed_by(self._skillset.skill(skill))
        if skill in self._goal.left_by:
            yield NodeEnd(Status.FAILURE, place, leaf)
            if not away:
                yield from (NodeEnd(status, Place.AWAY, leaf) for status in (Status.SUCCESS, Status.FAILURE))
        elif skill == self._goal.skill:
            yield NodeEnd(Status.SUCCESS, Place.GOAL, leaf)
            yield NodeEnd(Status.FAILURE, Place.RELEASED if away else place, leaf)
        else:
            if away or not moving:
                # A skill that depends on the place controls the robot again.
                yield NodeEnd(Status.SUCCESS, Place.AWAY if moving else place, leaf)
            yield NodeEnd(Status.FAILURE, place, leaf)

    def _ends_of_condition(self, leaf: ResourceIs, place: Place) -> Iterator[NodeEnd]:
        """Ends of a condition. One on the goal's resource decides by the place, unless it waits for another state."""
        resource = self._meant_resource(leaf.resource)
        states = [intended_name(state, (self._goal.state, *self._goal.away)) for state in leaf.states]
        here = {self._goal.state} if place is Place.GOAL else set(self._goal.away)
        if resource is None or is_guessed(leaf) or not states:
            return
        if resource != self._goal.resource:
            yield NodeEnd(Status.SUCCESS, place, leaf)
            yield from self._failures(leaf, frozenset({place}), of=resource)
            return
        if not here.isdisjoint(states):
            yield NodeEnd(Status.SUCCESS, place, leaf)
        if None not in states and not here <= set(states):
            yield NodeEnd(Status.FAILURE, place, leaf)
            if leaf.wait and states == [self._goal.state]:
                yield NodeEnd(Status.SUCCESS, Place.GOAL, leaf)

    def _meant_resource(self, name: str) -> str | None:
        return intended_name(name, (resource.name for resource in self._skillset.resources))


def _either(*walks: NodeOutcome) -> NodeOutcome:
    ends, during = frozenset[NodeEnd](), frozenset[Place]()
    return NodeOutcome(ends.union(*(walk.ends for walk in walks)), during.union(*(walk.during for walk in walks)))
