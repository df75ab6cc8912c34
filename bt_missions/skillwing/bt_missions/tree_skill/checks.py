"""Checks of a tree that is the body of a skill: fit with the skillset, rings, and resources taken twice."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from itertools import combinations, product
from pathlib import Path

from py_trees.behaviour import Behaviour
from py_trees.composites import Parallel

from skillwing.bt_missions.checking.mission_check import offline_context
from skillwing.bt_missions.checking.preflight import tree_problems
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.leaves.source_location import source_location
from skillwing.bt_missions.tree_skill.composition import RLC, read_composition
from skillwing.bt_missions.xml.blackboard import Blackboard
from skillwing.bt_missions.xml.builder import Builder
from skillwing.bt_missions.xml.document import FileProblem, by_place
from skillwing.bt_missions.xml.tree_file import TreeFile, read_tree_file
from skillwing.dsl.default_values import default_value
from skillwing.dsl.expressions import names_used
from skillwing.dsl.model import Skill, Skillset
from skillwing.dsl.queries import holds, taken_by
from skillwing.services.errors import InvalidOptionError

BODY_SUFFIXES = (".xml", RLC)


def read_body(file: Path, skillset: Skillset) -> TreeFile:
    """The trees of a skill's body: a tree file, or the compositions of an `.rlc` file.

    Raises TreeFileError for a file that is neither, and InvalidOptionError for one that cannot be read.
    """
    return read_composition(file, skillset) if file.suffix == RLC else read_tree_file(file)


def bodies_in(folder: Path, skillset: Skillset) -> dict[str, TreeFile]:
    """The bodies in a folder, by skill. A body that cannot be read is left out, since its own manager reports it."""
    names = {skill.name for skill in skillset.skills}
    found: dict[str, TreeFile] = {}
    for file in sorted(folder.iterdir()) if folder.is_dir() else ():
        if file.stem in names and file.suffix in BODY_SUFFIXES:
            try:
                found[file.stem] = read_body(file, skillset)
            except InvalidOptionError:
                continue
    return found


def body_problems(source: TreeFile, skillset: Skillset, skill: str, folder: Path) -> list[FileProblem]:
    """All problems of a body, with the bodies of other skills, by line. folder: of the bodies of all skills."""
    found = tree_skill_problems(source, skillset, skill)
    bodies = {**bodies_in(folder, skillset), skill: source}
    ring = ring_through(skill, bodies, skillset)
    if not ring:
        found += dict.fromkeys(_problems_of_called(source, skillset, _find(skill, skillset), bodies))
    else:
        names = " -> ".join(f"`{name}`" for name in ring)
        text = f"These skills would start each other for ever: {names}. Change a tree."
        found.append(_at_call(source, skillset, ring[1], text))
    return by_place(found)


def tree_skill_problems(source: TreeFile, skillset: Skillset, skill: str) -> list[FileProblem]:
    """All problems of a tree file as the body of a skill, by line. A skill may be missing in the skillset."""
    own = _find(skill, skillset)
    context = offline_context(skillset)
    builder = Builder(source, context)
    blackboard = Blackboard(may_be_empty=own is None)
    for field in own.inputs if own else ():
        blackboard.entry(field.name).set(default_value(field))
    root = builder.build(source.main, blackboard)
    builder.finish()
    found = [*source.problems, *builder.problems]
    found += [_problem(source, problem.place, problem.text) for problem in tree_problems([root], skillset)]
    for leaf in _leaves(root):
        for text in _problems_within(own, leaf.skill, skillset) if own else ():
            found.append(_problem(source, source_location(leaf), f"Leaf `{leaf.name}`: {text}"))
    marked = dict.fromkeys(_with_excerpt(source, problem) for problem in found)
    return by_place(marked)


def ring_through(skill: str, trees: Mapping[str, TreeFile], skillset: Skillset) -> list[str]:
    """Skills whose trees start each other, from `skill` back to it; empty if there is no such ring.

    trees: by skill. A tree that starts its own skill is no ring; `tree_skill_problems` reports it.
    """
    calls = {name: called_skills(source, skillset) - {name} for name, source in trees.items()}
    paths = (path for path in call_paths([skill], calls) if skill in calls.get(path[-1], ()))
    return next(([*path, skill] for path in paths), [])


def call_paths(skills: Iterable[str], calls: Mapping[str, frozenset[str]]) -> Iterator[tuple[str, ...]]:
    """The shortest chain of calls from one of the skills to each skill that they start, themselves included.

    calls: skills that the tree of a skill starts. Those of a skill may be added when its chain has been yielded.
    """
    seen = set(skills)
    paths: list[tuple[str, ...]] = [(skill,) for skill in sorted(seen)]
    while paths:
        path = paths.pop(0)
        yield path
        for called in sorted(calls.get(path[-1], frozenset()) - seen):
            seen.add(called)
            paths.append((*path, called))


def called_skills(source: TreeFile, skillset: Skillset) -> frozenset[str]:
    """The skills that any tree of a file starts."""
    context = offline_context(skillset)
    builder = Builder(source, context)
    trees = [builder.build(name, Blackboard(may_be_empty=True)) for name in source.trees]
    return frozenset(leaf.skill for tree in trees for leaf in _leaves(tree))


def _leaves(root: Behaviour) -> Iterator[SkillAction]:
    return (node for node in root.iterate() if isinstance(node, SkillAction))


def _problems_of_called(
    source: TreeFile, skillset: Skillset, own: Skill | None, bodies: Mapping[str, TreeFile]
) -> Iterator[FileProblem]:
    """Problems with resources that only the trees of called skills take. own: None if it is missing."""
    builder = Builder(source, offline_context(skillset))
    root = builder.build(source.main, Blackboard(may_be_empty=True))
    calls = {name: called_skills(body, skillset) for name, body in bodies.items()}

    def reached_by(skill: str) -> set[str]:
        return {path[-1] for path in call_paths([skill], calls)}

    def started_by(node: Behaviour) -> list[tuple[str, str]]:
        """Each leaf's skill with itself and with each skill that its tree starts, directly or not."""
        return [(leaf.skill, skill) for leaf in _leaves(node) for skill in sorted(reached_by(leaf.skill))]

    for leaf in _leaves(root):
        for skill in sorted(reached_by(leaf.skill) - {leaf.skill}):
            for text in _problems_within(own, skill, skillset) if own else ():
                problem = _problem(source, source_location(leaf), f"Leaf `{leaf.name}` starts `{skill}`: {text}")
                yield _with_excerpt(source, problem)
    for node in root.iterate():
        for first, second in combinations(node.children if isinstance(node, Parallel) else (), 2):
            for (caller, skill), (other_caller, other) in product(started_by(first), started_by(second)):
                shared = _taken(skill, skillset) & _taken(other, skillset)
                if shared and (caller != skill or other_caller != other):
                    both = f"{_named(skill, caller)} and {_named(other, other_caller)}"
                    text = f"Under `{node.name}` both {both} take {min(shared)}, at the same time."
                    yield _with_excerpt(source, _problem(source, source_location(node), text))


def _find(skill: str, skillset: Skillset) -> Skill | None:
    return next((each for each in skillset.skills if each.name == skill), None)


def _named(skill: str, caller: str) -> str:
    return f"`{skill}`" if skill == caller else f"`{skill}` of `{caller}`"


def _taken(skill: str, skillset: Skillset) -> set[str]:
    found = _find(skill, skillset)
    return set[str]() if found is None else set(taken_by(found))


def _problems_within(own: Skill, skill: str, skillset: Skillset) -> Iterator[str]:
    """Problems of a skill because the skill of the tree runs meanwhile, and holds what it has taken."""
    if skill == own.name:
        yield f"the tree of `{own.name}` starts `{own.name}` itself, which is busy. Remove it."
        return
    called = _find(skill, skillset)
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


def _at_call(source: TreeFile, skillset: Skillset, skill: str, text: str) -> FileProblem:
    """A problem at the first leaf that starts a skill."""
    builder = Builder(source, offline_context(skillset))
    trees = [builder.build(name, Blackboard(may_be_empty=True)) for name in source.trees]
    leaf = next(leaf for tree in trees for leaf in _leaves(tree) if leaf.skill == skill)
    return _with_excerpt(source, _problem(source, source_location(leaf), text))


def _problem(source: TreeFile, place: str | None, text: str) -> FileProblem:
    """A problem at `FILE:LINE` or `FILE:LINE:COLUMN`."""
    line, _, column = (place or "").removeprefix(f"{source.file}:").partition(":")
    return FileProblem(int(line) if line.isdecimal() else 1, text, int(column) if column.isdecimal() else 0)


def _with_excerpt(source: TreeFile, problem: FileProblem) -> FileProblem:
    marked = source.excerpts.get((problem.line, problem.column))
    return problem if marked is None or "\n" in problem.text else replace(problem, text=f"{problem.text}\n{marked}")
