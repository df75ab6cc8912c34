"""Checks of a tree that is the body of a skill: fit with the skillset, cycles, and resources taken twice."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from graphlib import CycleError, TopologicalSorter

from py_trees.behaviour import Behaviour

from skillwing.bt_missions.checking.mission_check import offline_context
from skillwing.bt_missions.checking.preflight import tree_problems
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.leaves.source_location import source_location
from skillwing.bt_missions.xml.blackboard import Blackboard
from skillwing.bt_missions.xml.builder import Builder
from skillwing.bt_missions.xml.document import FileProblem
from skillwing.bt_missions.xml.node_types import node_types
from skillwing.bt_missions.xml.tree_file import TreeFile
from skillwing.dsl.expressions import names_used
from skillwing.dsl.model import Skill, Skillset
from skillwing.dsl.queries import holds, taken_by
from skillwing.services.mocking.defaults import default_value


def tree_skill_problems(source: TreeFile, skillset: Skillset, skill: str) -> list[FileProblem]:
    """All problems of a tree file as the body of a skill, by line."""
    own = skillset.skill(skill)
    context = offline_context(skillset)
    builder = Builder(source, node_types(skillset), context)
    blackboard = Blackboard()
    for field in own.inputs:
        blackboard.entry(field.name).set(default_value(field))
    root = builder.build(source.main, blackboard)
    builder.finish()
    found = [*source.problems, *builder.problems]
    found += [FileProblem(_line(problem.place), problem.text) for problem in tree_problems([root], skillset)]
    for leaf in _leaves(root):
        for text in _problems_within(own, leaf, skillset):
            found.append(FileProblem(_line(source_location(leaf)), f"Leaf `{leaf.name}`: {text}"))
    return sorted(dict.fromkeys(found), key=lambda problem: problem.line)


def cycle(trees: Mapping[str, TreeFile], skillset: Skillset) -> list[str]:
    """Skills whose trees start each other in a ring, in that order; empty if there is no ring. trees: by skill."""
    calls = {skill: called_skills(source, skillset) & trees.keys() for skill, source in trees.items()}
    try:
        tuple(TopologicalSorter(calls).static_order())
    except CycleError as error:
        return list(error.args[1])
    return []


def called_skills(source: TreeFile, skillset: Skillset) -> frozenset[str]:
    """The skills that any tree of a file starts."""
    context = offline_context(skillset)
    builder = Builder(source, node_types(skillset), context)
    trees = [builder.build(name, Blackboard(may_be_empty=True)) for name in source.trees]
    return frozenset(leaf.skill for tree in trees for leaf in _leaves(tree))


def _leaves(root: Behaviour) -> Iterator[SkillAction]:
    return (node for node in root.iterate() if isinstance(node, SkillAction))


def _problems_within(own: Skill, leaf: SkillAction, skillset: Skillset) -> Iterator[str]:
    """Problems of a leaf because the skill of the tree runs meanwhile, and holds what it has taken."""
    if leaf.skill == own.name:
        yield f"the tree of `{own.name}` starts `{own.name}` itself, which is busy. Remove it."
        return
    called = next((skill for skill in skillset.skills if skill.name == leaf.skill), None)
    if called is None:
        return
    held = taken_by(own)
    for resource in taken_by(called).keys() & held.keys():
        if not skillset.resource(resource).allows(held[resource], taken_by(called)[resource], extern=False):
            yield f"`{own.name}` holds `{resource}` already, which `{called.name}` takes. Let only one of them take it."
            return
    for check in called.preconditions.checks:
        names = names_used(check.expression, "resource") if check.kind == "resource" else frozenset[str]()
        if names and names <= held.keys() and not holds(check.expression, held):
            states = ", ".join(f"`{name}` is {held[name]}" for name in sorted(names))
            yield f"`{check.name}` of `{called.name}` never holds while `{own.name}` runs: {states}."


def _line(place: str | None) -> int:
    text = (place or "").rpartition(":")[2]
    return int(text) if text.isdecimal() else 1
