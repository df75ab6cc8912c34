"""Check of a tree's shape: branches that are never reached, skills and resources that are used twice at a time."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations, pairwise

from py_trees.behaviour import Behaviour
from py_trees.behaviours import Failure, Running, Success
from py_trees.common import ParallelPolicy, Status
from py_trees.composites import Parallel, Selector, Sequence
from py_trees.decorators import (
    Decorator,
    FailureIsSuccess,
    Inverter,
    OneShot,
    Repeat,
    Retry,
    SuccessIsFailure,
    SuccessIsRunning,
)

from skillwing.bt_missions.checking.intended_names import intended_name
from skillwing.bt_missions.checking.repetition import may_run_again
from skillwing.bt_missions.leaves.branch_switch import NoteSwitch, WaitForSettled
from skillwing.bt_missions.leaves.may_start import MayStart
from skillwing.bt_missions.leaves.placeholder import is_guessed, is_incomplete
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.subtrees.composites import OnEnding
from skillwing.bt_missions.subtrees.decorators import Deadline, Delay, RunOnce
from skillwing.bt_missions.subtrees.flow_control import IfThenElse, ValueSwitch
from skillwing.bt_missions.subtrees.lease import WithLease
from skillwing.bt_missions.subtrees.parallel_all import ParallelAll
from skillwing.bt_missions.subtrees.pausing import Pausable, WhileGranted
from skillwing.dsl.model import Skill, Skillset
from skillwing.dsl.queries import taken_by


def shape_problems(root: Behaviour, skillset: Skillset) -> Iterator[tuple[Behaviour, str]]:
    """Each problem as a sentence, with its node. No problem is derived from unreadable nodes and unknown names."""
    for node in root.iterate():
        yield from _unreachable(node, skillset)
        yield from _misplaced(node)
        if isinstance(node, Parallel | ParallelAll):
            for problem in (*_run_twice(node, skillset), *_taken_twice(node, skillset)):
                yield node, problem


def _unreachable(node: Behaviour, skillset: Skillset) -> Iterator[tuple[Behaviour, str]]:
    """Children that are never ticked, as the child before them always has the same end."""
    if isinstance(node, IfThenElse):
        yield from _unreachable_branches(node, skillset)
    if isinstance(node, ValueSwitch):
        for first, second in combinations(range(len(node.cases)), 2):
            if node.cases[first] == node.cases[second]:
                text = f"of `{node.name}` is never reached: cases {first + 1} and {second + 1} are the same."
                yield node.children[second], f"Branch `{node.children[second].name}` {text}"
    if not isinstance(node, Selector | Sequence):
        return
    needed, word = (Status.FAILURE, "fail") if isinstance(node, Selector) else (Status.SUCCESS, "succeed")
    for before, child in pairwise(node.children):
        if needed not in ends_of(before, skillset):
            yield child, f"Branch `{child.name}` of `{node.name}` is never reached: `{before.name}` cannot {word}."
            return


def _unreachable_branches(node: IfThenElse, skillset: Skillset) -> Iterator[tuple[Behaviour, str]]:
    condition, *branches = node.children
    possible = ends_of(condition, skillset)
    for branch, needed, word in zip(branches, (Status.SUCCESS, Status.FAILURE), ("succeed", "fail"), strict=False):
        if needed not in possible:
            text = f"is never reached: `{condition.name}` cannot {word}."
            yield branch, f"Branch `{branch.name}` of `{node.name}` {text}"


def _misplaced(node: Behaviour) -> Iterator[tuple[Behaviour, str]]:
    """A node that is skipped, where nothing can skip it."""
    if isinstance(node, RunOnce) and not isinstance(node.parent, Sequence | Selector | None):
        remedy = "Put it directly into one, or let it repeat its end: `then_skip` false, in Python `OneShot`"
        yield node, f"`{node.name}` is skipped after its end, which only a Sequence or a Fallback can do. {remedy}."


def _run_twice(parallel: Parallel | ParallelAll, skillset: Skillset) -> Iterator[str]:
    """Skills in different children. A skill has one goal at a time, and replies BUSY to a second one."""
    for one, other in combinations(parallel.children, 2):
        for robot, skill in dict.fromkeys(_skills(one, skillset)):
            if (robot, skill) in _skills(other, skillset):
                whose = f"skill `{skill}` of `{robot}`" if robot else f"skill `{skill}`"
                yield f"Under `{parallel.name}` {whose} would run twice at the same time; a second one is BUSY."


def _skills(node: Behaviour, skillset: Skillset) -> list[tuple[str, str]]:
    """Robot and name of each known skill below a node. A lease that another branch holds is asked for again."""
    leaves = [leaf for leaf in node.iterate() if isinstance(leaf, SkillAction) and not _is_lease(leaf)]
    return [(leaf.robot, leaf.skill) for leaf in leaves if _is_known(leaf, skillset)]


def _is_lease(leaf: SkillAction) -> bool:
    return isinstance(leaf.parent, WithLease) and leaf is leaf.parent.children[0]


def _is_known(leaf: SkillAction, skillset: Skillset) -> bool:
    return any(skill.name == leaf.skill for skill in skillset_of(leaf, skillset).skills)


def _taken_twice(parallel: Parallel | ParallelAll, skillset: Skillset) -> Iterator[str]:
    """Resources that skills in different children take when they start, but not those of a skill that runs twice."""
    for one, other in combinations(parallel.children, 2):
        twice = {*_skills(one, skillset)}.intersection(_skills(other, skillset))
        for resource, leaf in _taken(one, skillset):
            for same, rival in _taken(other, skillset):
                skills = {(leaf.robot, leaf.skill), (rival.robot, rival.skill)}
                if resource == same and leaf.robot == rival.robot and len(skills) == 2 and twice.isdisjoint(skills):
                    names = f"both `{leaf.name}` and `{rival.name}`"
                    yield f"Under `{parallel.name}` {names} take {resource}, at the same time."


def _taken(node: Behaviour, skillset: Skillset) -> list[tuple[str, SkillAction]]:
    """Each resource that a skill below `node` takes when it starts, with the leaf."""
    taken: dict[tuple[str, str], SkillAction] = {}
    for leaf in node.iterate():
        skill = skill_of(leaf, skillset) if isinstance(leaf, SkillAction) and not _is_lease(leaf) else None
        if isinstance(leaf, SkillAction) and skill is not None and skill.name == leaf.skill:
            taken |= {(resource, leaf.name): leaf for resource in taken_by(skill)}
    return [(resource, leaf) for (resource, _), leaf in taken.items()]


def ends_of(node: Behaviour, skillset: Skillset) -> set[Status]:
    """Statuses with which a node can end: SUCCESS, FAILURE, or both. Both for an unknown node."""
    match node:
        case _ if is_guessed(node) or is_incomplete(node):
            ends = {Status.SUCCESS, Status.FAILURE}
        case Success() | NoteSwitch() | WaitForSettled() | FailureIsSuccess():
            ends = {Status.SUCCESS}
        case Failure() | SuccessIsFailure():
            ends = {Status.FAILURE}
        case Running():
            ends = set[Status]()
        case RunOnce() if may_run_again(node):
            ends = {*ends_of(node.decorated, skillset), node.when_skipped}
        case Decorator():
            ends = _ends_of_decorator(node, skillset)
        case Pausable():
            ends = ends_of(node.children[-1], skillset)
        case OnEnding() | WithLease():
            ends = _ends_of_second(node, skillset)
        case IfThenElse() | ValueSwitch():
            ends = _ends_of_choice(node, skillset)
        case Sequence() | Selector() | Parallel() | ParallelAll():
            ends = _ends_of_composite(node, skillset)
        case SkillAction() if not _can_succeed(node, skillset):
            ends = {Status.FAILURE}
        case _:
            ends = {Status.SUCCESS, Status.FAILURE}
    return ends


def _ends_of_decorator(node: Decorator, skillset: Skillset) -> set[Status]:
    below = ends_of(node.decorated, skillset)
    match node:
        case Inverter():
            turned = {Status.SUCCESS: Status.FAILURE, Status.FAILURE: Status.SUCCESS}
            return {turned[end] for end in below}
        case SuccessIsRunning():
            return below - {Status.SUCCESS}
        case Repeat() if node.num_success < 0:
            return below - {Status.SUCCESS}
        case Repeat() | Retry() | OneShot() | Delay():
            return below
        case Deadline() | WhileGranted():
            return below | {Status.FAILURE}
        case _:
            return {Status.SUCCESS, Status.FAILURE}


def _ends_of_second(node: OnEnding | WithLease, skillset: Skillset) -> set[Status]:
    """Ends of a node that may run its second child: after a failure of the first one, or while that runs."""
    first, second = (ends_of(child, skillset) for child in node.children[:2])
    if isinstance(node, WithLease):
        return second | {Status.FAILURE}
    return first | second if Status.FAILURE in first else first


def _ends_of_choice(node: IfThenElse | ValueSwitch, skillset: Skillset) -> set[Status]:
    if isinstance(node, ValueSwitch):
        return set[Status]().union(*(ends_of(child, skillset) for child in node.children))
    condition, then, *otherwise = (ends_of(child, skillset) for child in node.children)
    ends = set(then) if Status.SUCCESS in condition else set[Status]()
    if Status.FAILURE in condition:
        ends |= otherwise[0] if otherwise else {Status.FAILURE}
    return ends


def _ends_of_composite(node: Sequence | Selector | Parallel | ParallelAll, skillset: Skillset) -> set[Status]:
    ends = {id(child): ends_of(child, skillset) for child in node.children}
    one, every = (Status.SUCCESS, Status.FAILURE) if isinstance(node, Selector) else (Status.FAILURE, Status.SUCCESS)
    deciding = node.children
    if isinstance(node, Parallel):
        if isinstance(node.policy, ParallelPolicy.SuccessOnOne):
            return set[Status]().union(*ends.values())
        if isinstance(node.policy, ParallelPolicy.SuccessOnSelected):
            deciding = node.policy.children
    found = {one} if any(one in end for end in ends.values()) else set[Status]()
    return found | ({every} if all(every in ends[id(child)] for child in deciding) else set())


def _can_succeed(leaf: SkillAction, skillset: Skillset) -> bool:
    """True if any ending means SUCCESS. A skill can always end in FAILURE, as its manager may be lost."""
    skill = skill_of(leaf, skillset)
    if skill is None or Status.SUCCESS in leaf.outcomes.values():
        return True
    return any(result.success and f"S_{result.name}" not in leaf.outcomes for result in skill.results)


def skillset_of(node: object, skillset: Skillset) -> Skillset:
    """The skillset of the robot that a node names; the given one in a mission on one robot."""
    own = getattr(node, "skillset", None) if getattr(node, "robot", "") else None
    return own if isinstance(own, Skillset) else skillset


def skill_of(leaf: SkillAction | MayStart, skillset: Skillset) -> Skill | None:
    """The skill that a leaf is about, or probably is meant to run. skillset: of a mission on one robot."""
    skillset = skillset_of(leaf, skillset)
    name = intended_name(leaf.skill, (skill.name for skill in skillset.skills))
    return None if name is None else skillset.skill(name)
