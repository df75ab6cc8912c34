"""Check of a mission's trees against the skillset, before its run: it lists all problems."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping

from py_trees.behaviour import Behaviour

from skillwing.bt_missions.checking.comparison_check import comparison_problems
from skillwing.bt_missions.checking.entry_check import entry_problems
from skillwing.bt_missions.checking.rescue_check import rescue_problems
from skillwing.bt_missions.checking.tree_check import shape_problems, skill_of, skillset_of
from skillwing.bt_missions.leaves.conditions import DataCompare, ResourceIs
from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.leaves.may_start import MayStart
from skillwing.bt_missions.leaves.pause_gate import HELD
from skillwing.bt_missions.leaves.placeholder import PlaceholderNode, is_guessed, is_incomplete
from skillwing.bt_missions.leaves.robot_group import MissingRobotError
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.leaves.source_location import source_location
from skillwing.bt_missions.mission.mission import Mission, MissionTrees, split_need
from skillwing.bt_missions.mission.problems import MissionProblem
from skillwing.bt_missions.subtrees.composites import OnEnding
from skillwing.bt_missions.subtrees.pausing import WhileGranted
from skillwing.dsl.model import Skill, Skillset, UnknownNameError
from skillwing.dsl.suggest import missing_names
from skillwing.services.core.values import fit_fields
from skillwing.services.protocol import Ending


def preflight(mission: Mission, trees: MissionTrees, context: MissionContext) -> list[MissionProblem]:
    """All problems of a mission with its robots: of its needs, of its trees, and of the ways to their rescue goals."""
    found = list(_needs_problems(mission, context))
    found.extend(tree_problems(trees.all, next(iter(context.robots.values())).skillset))
    for robot, own in context.robots.items():
        goal = own.rescue_goal
        wrong = [] if goal is None else list(goal.problems(own.skillset))
        whose = f"The rescue goal of `{robot}`" if robot else "The robot's rescue goal"
        found.extend(MissionProblem(f"{whose}: {problem}") for problem in wrong)
        if goal is not None and not wrong:
            unsafe = rescue_problems(trees.root, trees.rescue_of(robot), own.skillset, goal, robot)
            found.extend(MissionProblem(problem, source_location(node)) for node, problem in unsafe)
    return list(dict.fromkeys(found))


def _needs_problems(mission: Mission, context: MissionContext) -> Iterator[MissionProblem]:
    for name, states in mission.needs.items():
        robot, resource = split_need(name, several=bool(mission.robots))
        try:
            skillset = context.of(robot).skillset
        except (UnknownNameError, MissingRobotError) as error:
            texts = [str(error)]
        else:
            texts = list(_resource_problems(skillset, resource, states))
        yield from (MissionProblem(f"The mission's needs: {text}", mission.needs_location) for text in texts)


def tree_problems(trees: Iterable[Behaviour], skillset: Skillset) -> list[MissionProblem]:
    """All problems of these trees by themselves, or with the skillset."""
    trees = tuple(trees)
    found: list[MissionProblem] = []
    for node, problem in entry_problems(trees, skillset):
        kind = "Node" if node.children else "Leaf"
        found.append(MissionProblem(f"{kind} `{node.name}`: {problem}", source_location(node)))
    for root in trees:
        found.extend(MissionProblem(problem, source_location(node)) for node, problem in shape_problems(root, skillset))
        for node in root.iterate():
            if is_guessed(node):
                continue
            kind, problems = ("Node", _structure_problems) if node.children else ("Leaf", _leaf_problems)
            own = skillset_of(node, skillset)
            texts = (f"{kind} `{node.name}`: {problem}" for problem in problems(node, own))
            found.extend(MissionProblem(text, source_location(node)) for text in texts)
    return list(dict.fromkeys(found))


def _leaf_problems(leaf: Behaviour, skillset: Skillset) -> Iterator[str]:
    if isinstance(leaf, SkillAction):
        yield from _skill_problems(leaf, skillset)
    elif isinstance(leaf, MayStart):
        yield from _question_problems(leaf, skillset)
    elif isinstance(leaf, ResourceIs):
        yield from _resource_problems(skillset, leaf.resource, leaf.states)
    elif isinstance(leaf, DataCompare):
        problem = next(_unknown(lambda: skillset.datum(leaf.datum)), None)
        yield from comparison_problems(leaf, skillset.datum(leaf.datum)) if problem is None else (problem,)


def _skill_problems(leaf: SkillAction, skillset: Skillset) -> Iterator[str]:
    problem = next(_unknown(lambda: skillset.skill(leaf.skill)), None)
    if problem is not None:
        yield problem
        return
    skill = skillset.skill(leaf.skill)
    yield from _input_problems(leaf, leaf.inputs, skill)
    yield from _outcome_problems(leaf, skill)
    outputs = [field.name for field in skill.outputs]
    for name in leaf.outputs.keys() - set(outputs):
        yield str(UnknownNameError(f"output of {skill.name}", name, outputs))
    feedback = [field.name for field in skill.feedback]
    for name, counter in leaf.done.items():
        yield from _unknown(lambda name=name: skill.input(name))
        if counter not in feedback:
            yield str(UnknownNameError(f"feedback of {skill.name}", counter, feedback))


def _question_problems(leaf: MayStart, skillset: Skillset) -> Iterator[str]:
    problem = next(_unknown(lambda: skillset.skill(leaf.skill)), None)
    if problem is not None:
        yield problem
    elif leaf.inputs is not None:
        yield from _input_problems(leaf, leaf.inputs, skillset.skill(leaf.skill))


def _input_problems(leaf: Behaviour, inputs: Mapping[str, object], skill: Skill) -> Iterator[str]:
    """Problems of the inputs, as far as their values are known before the run."""
    known = {name: value for name, value in inputs.items() if not callable(value)}
    problems = fit_fields(skill.inputs, known)[1]
    named = [field.name for field in skill.inputs]
    absent = [each.path for each in problems if each.kind == "missing" and each.path in named]
    lacking = (
        ()
        if is_incomplete(leaf)
        else missing_names(
            (name for name in absent if name not in inputs), [name for name in inputs if name not in named]
        )
    )
    for problem in problems:
        if problem.path not in absent or problem.path in lacking:
            yield f"{skill.name}: {problem.sentence}"
    for name in inputs.keys() - known.keys():
        yield from _unknown(lambda name=name: skill.input(name))


def _outcome_problems(leaf: SkillAction, skill: Skill) -> Iterator[str]:
    """Labels with which the skill never ends, and results that a mapping of labels leaves out."""
    possible = possible_endings(skill)
    unknown_labels = [label for label in leaf.outcomes if label not in possible]
    for label in unknown_labels:
        yield str(UnknownNameError(f"ending of {skill.name}", label, possible))
    if leaf.outcomes and not is_incomplete(leaf):
        unmapped = (f"S_{result.name}" for result in skill.results if f"S_{result.name}" not in leaf.outcomes)
        for label in missing_names(unmapped, unknown_labels):
            yield f"{skill.name} can end {label}, and the leaf does not say what that means"


def possible_endings(skill: Skill) -> list[str]:
    """Labels with which a leaf that runs this skill may end."""
    with_result = (Ending.SUCCEEDED, Ending.NOT_HELD)
    named = [f"{ending}_{result.name}" for ending in with_result for result in skill.results]
    return [*named, *(ending for ending in Ending if ending not in with_result), HELD]


def _structure_problems(node: Behaviour, skillset: Skillset) -> Iterator[str]:
    """Problems of a node that is not a leaf."""
    if isinstance(node, WhileGranted):
        yield from _resource_problems(skillset, node.resource, node.states)
        yield from _resource_problems(skillset, node.ended_by.resource, (node.ended_by.state,))
    elif isinstance(node, OnEnding):
        below = [each for child in node.children[:1] for each in child.iterate()]
        skills = [skill_of(leaf, skillset) for leaf in below if isinstance(leaf, SkillAction)]
        if None in skills or any(isinstance(each, PlaceholderNode) for each in below):
            return  # an unknown node may end with any label
        possible = list(dict.fromkeys(label for skill in skills if skill for label in possible_endings(skill)))
        for label in node.endings:
            if label not in possible:
                yield str(UnknownNameError(f"ending below {node.name}", label, possible))


def _resource_problems(skillset: Skillset, resource: str, states: tuple[str, ...]) -> Iterator[str]:
    problem = next(_unknown(lambda: skillset.resource(resource)), None)
    if problem is not None:
        yield problem
        return
    known = skillset.resource(resource).states
    for state in states:
        if state not in known:
            yield str(UnknownNameError(f"state of {resource}", state, known))


def _unknown(look_up: Callable[[], object]) -> Iterator[str]:
    try:
        look_up()
    except UnknownNameError as error:
        yield str(error)
