"""Text of a mission draft, as a tree file or in Python."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from pprint import pformat
from textwrap import indent
from typing import Any

from skillwing.bt_missions.drafting.steps import DraftSteps, draft_steps
from skillwing.bt_missions.xml.port_types import port_type
from skillwing.bt_missions.xml.skills import input_port
from skillwing.bt_missions.xml.values import attribute_text
from skillwing.dsl.default_values import default_value
from skillwing.dsl.model import Field, Skill, Skillset
from skillwing.services.rescue_goal import RescueGoal

ATTEMPTS = 3
"""Number of attempts of a rescue to reach its goal."""


def draft_tree_file(name: str, skillset: Skillset, goal: RescueGoal | None) -> str:
    """A tree file with a first mission. name: of the mission."""
    steps = draft_steps(skillset, goal)
    options = _options(steps.skills)
    tags = [_tag(skill, options) for skill in steps.skills] or ["<AlwaysSuccess/>"]
    lines = [
        '<?xml version="1.0" encoding="utf-8"?>',
        f'<root BTCPP_format="4" main_tree_to_execute="{name}">',
        "",
        f"  <!-- Skills of {skillset.name}, one after the other. -->",
        f'  <BehaviorTree ID="{name}">',
    ]
    sequence = [f'<Sequence name="{name}">', *indented(tags), "</Sequence>"]
    if goal is None:
        lines += indented(sequence, 2)
    else:
        instead = ['<ForceFailure name="rescued, but not done">', '  <SubTree ID="rescue"/>', "</ForceFailure>"]
        lines += indented(['<Fallback name="all, or rescue">', *indented([*sequence, *instead]), "</Fallback>"], 2)
    lines += ["  </BehaviorTree>", ""]
    if goal is not None:
        lines += [*_rescue_tree(goal), ""]
    lines += [
        "  <!-- Ports of the main tree are the options of the mission. -->",
        "  <TreeNodesModel>",
        f'    <SubTree ID="{name}">',
        *(f"      {_port(name, field)}" for name, field in options.values()),
        "      <MetadataFields>",
        f'        <Metadata summary="{_summary(skillset)}"/>',
        *(f'        <Metadata needs="{needs}"/>' for needs in _needs_text(steps)),
        "      </MetadataFields>",
        "    </SubTree>",
        "  </TreeNodesModel>",
        "</root>",
    ]
    return "\n".join(lines) + "\n"


def draft_python_file(name: str, skillset: Skillset, goal: RescueGoal | None) -> str:
    """A module with a first mission. name: of the mission."""
    steps = draft_steps(skillset, goal)
    leaves = [f"{_leaf(skill)}," for skill in steps.skills] or ['Success("nothing to do"),']
    steps_of_run = indent("\n".join(leaves), "    ")
    run = f'in_order(\n    "{name}",\n{steps_of_run}\n)'
    names = ["in_order"] if goal is None else ["first_that_works", "in_order"]
    states = {resource: (state,) for resource, state in steps.needs.items()}
    needs = f"\n    needs = {_python(states)}" if states else ""
    text = _PYTHON if goal is None else _PYTHON_WITH_RESCUE
    filled = text.format(
        name=name,
        summary=_summary(skillset),
        needs=needs,
        composites=", ".join(names),
        run=indent(run, "        " if goal is None else "            ").lstrip(),
        resource="" if goal is None else goal.resource,
        state="" if goal is None else goal.state,
        skill="" if goal is None else goal.skill,
        attempts=ATTEMPTS,
    )
    return (
        filled
        if steps.skills
        else filled.replace(_LEAF_IMPORT, f"from py_trees.behaviours import Success\n\n{_LEAF_IMPORT}")
    )


def indented(lines: Iterable[str], steps: int = 1) -> list[str]:
    return ["  " * steps + line for line in lines]


def _required(skill: Skill) -> Iterator[Field]:
    return (field for field in skill.inputs if field.default is None)


def _options(skills: Iterable[Skill]) -> dict[tuple[str, str], tuple[str, Field]]:
    """Name and field of the option for each required input, by skill and input. Inputs of one name get two options."""
    inputs = [(skill.name, field) for skill in skills for field in _required(skill)]
    count = Counter(field.name for _, field in inputs)
    return {
        (skill, field.name): (field.name if count[field.name] == 1 else f"{skill}_{field.name}", field)
        for skill, field in inputs
    }


def _tag(skill: Skill, options: Mapping[tuple[str, str], tuple[str, Field]]) -> str:
    named = {field.name: options[skill.name, field.name][0] for field in _required(skill)}
    inputs = "".join(f' {input_port(name)}="{{{option}}}"' for name, option in named.items())
    return f"<{skill.name}{inputs}/>"


def _port(name: str, field: Field) -> str:
    from xml.sax.saxutils import quoteattr  # noqa: PLC0415 - loads libraries for the internet

    default = quoteattr(attribute_text(default_value(field)))
    return f'<input_port name="{name}" type="{port_type(field.type)}" default={default}/>'


def _rescue_tree(goal: RescueGoal) -> list[str]:
    return [
        "  <!-- Runs when the mission fails, when somebody aborts it, and when a leaf raises an exception. -->",
        '  <BehaviorTree ID="rescue">',
        '    <Sequence name="rescue">',
        '      <Settled name="stopped"/>',
        '      <Fallback name="safe">',
        f'        <ResourceIs name="safe?" resource="{goal.resource}" states="{goal.state}" question="true"/>',
        f'        <RetryUntilSuccessful name="at most {ATTEMPTS} times" num_attempts="{ATTEMPTS}">',
        f"          <{goal.skill}/>",
        "        </RetryUntilSuccessful>",
        "      </Fallback>",
        "    </Sequence>",
        "  </BehaviorTree>",
    ]


def _needs_text(steps: DraftSteps) -> Iterator[str]:
    if steps.needs:
        yield "; ".join(f"{resource}: {state}" for resource, state in steps.needs.items())


def _summary(skillset: Skillset) -> str:
    return f"Run skills of {skillset.name}, one after the other."


def _leaf(skill: Skill) -> str:
    values: dict[str, Any] = {field.name: default_value(field) for field in _required(skill)}
    inputs = f", {_python(values)}" if values else ""
    return f'SkillAction("{skill.name}", context, "{skill.name}"{inputs})'


def _python(value: object) -> str:
    return pformat(value, width=90, sort_dicts=False).replace("'", '"')


_LEAF_IMPORT = "from skillwing.bt_missions.leaves.skill_action import SkillAction\n"
_PYTHON = '''"""{summary}"""

from __future__ import annotations

from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.mission.mission import Mission, MissionOptions, MissionTrees
from skillwing.bt_missions.subtrees.composites import {composites}


class DraftedMission(Mission):
    name = "{name}"
    summary = "{summary}"{needs}

    def build(self, context: MissionContext, options: MissionOptions) -> MissionTrees:
        run = {run}
        return MissionTrees(run)


MISSION = DraftedMission()
'''
_PYTHON_WITH_RESCUE = '''"""{summary}"""

from __future__ import annotations

from py_trees.behaviour import Behaviour
from py_trees.decorators import Retry, SuccessIsFailure

from skillwing.bt_missions.leaves.branch_switch import WaitForSettled
from skillwing.bt_missions.leaves.conditions import ResourceIs
from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.mission.mission import Mission, MissionOptions, MissionTrees
from skillwing.bt_missions.subtrees.composites import {composites}

STOPPING_PATIENCE = 10.0
"""Longest wait for cancelled skills before the rescue, in seconds of robot time."""


class DraftedMission(Mission):
    name = "{name}"
    summary = "{summary}"{needs}

    def build(self, context: MissionContext, options: MissionOptions) -> MissionTrees:
        run = first_that_works(
            "all, or rescue",
            {run},
            SuccessIsFailure("rescued, but not done", rescue(context)),
        )
        return MissionTrees(run, rescue(context))


def rescue(context: MissionContext) -> Behaviour:
    """Runs when the mission fails, when somebody aborts it, and when a leaf raises an exception."""
    attempt: Behaviour = SkillAction("{skill}", context, "{skill}")
    return in_order(
        "rescue",
        WaitForSettled("stopped", context, STOPPING_PATIENCE),
        first_that_works(
            "safe",
            ResourceIs("safe?", context, "{resource}", "{state}", question=True),
            Retry("at most {attempts} times", attempt, num_failures={attempts}),
        ),
    )


MISSION = DraftedMission()
'''
