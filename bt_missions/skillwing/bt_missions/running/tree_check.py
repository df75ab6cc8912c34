"""What can be told of a tree by its shape: branches that nobody reaches, resources that are wanted twice at once."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations, pairwise

from py_trees.behaviour import Behaviour
from py_trees.behaviours import Failure, Running, Success
from py_trees.common import ParallelPolicy, Status
from py_trees.composites import Parallel, Selector, Sequence
from py_trees.decorators import FailureIsSuccess, Inverter, SuccessIsFailure

from skillwing.bt_missions.leaves.settling import NoteSwitch, Settled
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.dsl.model import Skill, Skillset


def shape_problems(root: Behaviour, skillset: Skillset) -> Iterator[tuple[Behaviour, str]]:
    """Every problem as a sentence, with its node. Skills that the skillset does not know are passed over."""
    for node in root.iterate():
        yield from _unreachable(node, skillset)
        if isinstance(node, Parallel):
            for problem in _taken_twice(node, skillset):
                yield node, problem


def _unreachable(node: Behaviour, skillset: Skillset) -> Iterator[tuple[Behaviour, str]]:
    """Children that are never ticked, for the one before them always has the same end."""
    if not isinstance(node, Selector | Sequence):
        return
    needed, word = (Status.FAILURE, "fail") if isinstance(node, Selector) else (Status.SUCCESS, "succeed")
    for before, child in pairwise(node.children):
        if needed not in _ends(before, skillset):
            yield child, f"Branch `{child.name}` of `{node.name}` is never reached: `{before.name}` cannot {word}."
            return


def _taken_twice(parallel: Parallel, skillset: Skillset) -> Iterator[str]:
    """Resources that skills in different children take when they start."""
    for one, other in combinations(parallel.children, 2):
        for resource, skill in _taken(one, skillset):
            for same, rival in _taken(other, skillset):
                if resource == same:
                    yield f"Under `{parallel.name}` both `{skill}` and `{rival}` take {resource}, at the same time."


def _taken(node: Behaviour, skillset: Skillset) -> list[tuple[str, str]]:
    """Resource and name of the leaf for each resource that a skill below `node` takes when it starts."""
    taken: dict[tuple[str, str], None] = {}
    for leaf in node.iterate():
        skill = _skill_of(leaf, skillset) if isinstance(leaf, SkillAction) else None
        if skill is not None:
            start = skill.transitions(skill.preconditions.success)
            taken.update(((resource, leaf.name), None) for resource, _ in start)
    return list(taken)


def _ends(node: Behaviour, skillset: Skillset) -> set[Status]:
    """With which of SUCCESS and FAILURE a node can end; both where nothing is known of it."""
    match node:
        case Success() | NoteSwitch() | Settled() | FailureIsSuccess():
            ends = {Status.SUCCESS}
        case Failure() | SuccessIsFailure():
            ends = {Status.FAILURE}
        case Running():
            ends = set[Status]()
        case Inverter():
            turned = {Status.SUCCESS: Status.FAILURE, Status.FAILURE: Status.SUCCESS}
            ends = {turned[end] for end in _ends(node.decorated, skillset)}
        case Sequence() | Selector() | Parallel():
            ends = _ends_of_composite(node, skillset)
        case SkillAction() if not _can_succeed(node, skillset):
            ends = {Status.FAILURE}
        case _:
            ends = {Status.SUCCESS, Status.FAILURE}
    return ends


def _ends_of_composite(node: Sequence | Selector | Parallel, skillset: Skillset) -> set[Status]:
    ends = {id(child): _ends(child, skillset) for child in node.children}
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
    """Whether any ending means SUCCESS. A skill can always end in failure: its manager may be lost."""
    skill = _skill_of(leaf, skillset)
    if skill is None or Status.SUCCESS in leaf.outcomes.values():
        return True
    return any(result.success and f"S_{result.name}" not in leaf.outcomes for result in skill.results)


def _skill_of(leaf: SkillAction, skillset: Skillset) -> Skill | None:
    return next((skill for skill in skillset.skills if skill.name == leaf.skill), None)
