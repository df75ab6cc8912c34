"""Skeletons, which are written once and then belong to the developer: package, process table and skill managers."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping

from skillwing.dsl.generating.managers_module import abstract_manager
from skillwing.dsl.generating.source_text import INDENT, TypeNames, docstring, enumeration, inputs_class
from skillwing.dsl.model import Skill, Skillset
from skillwing.dsl.naming import class_name, manager_class

_TABLE = '''\
"""The table of `{robot}`: its skillset, its skill managers, and the processes below them.

Written once by `skillwing generate`, and yours from then on. It already runs:

    skillwing up --robot {package}

Installed packages are found by name through the entry-point group `skillwing.robots`:

    {robot} = "{package}.robot:ROBOT"
"""

from __future__ import annotations

from skillwing.services.robot import Robot

from .generated.processes import HOOKS, SKILLSET

# There is no functional layer yet. `functional_layer=` names the processes below the managers: drivers, and the bridge
# that turns their messages into data and extern transitions. `clock="robot"` is for a layer that publishes the time.
ROBOT = Robot(name="{robot}", skillset=SKILLSET, hooks=HOOKS, clock="wall")
'''


def skeletons(skillset: Skillset, package: str, *, skills: Collection[str] | None = None) -> Mapping[str, str]:
    """The files by their path in the package. skills: those that get a manager, by default all."""
    wanted = [skill for skill in skillset.skills if skills is None or skill.name in skills]
    return {
        "__init__.py": f'"""The robot `{skillset.name}`."""\n',
        "robot.py": _TABLE.format(robot=skillset.name, package=package),
        "skills/__init__.py": f'"""The skill managers of `{skillset.name}`, one file each."""\n',
        **{skill_file(skill.name): "\n".join(_manager(skill)) + "\n" for skill in wanted},
    }


def skill_file(skill: str) -> str:
    """The path of a skill's manager in the package."""
    return f"skills/{skill}.py"


def refusal(skill: str) -> str:
    """The reason with which an unwritten manager ends its goals."""
    return f"`{skill}` is not written yet: fill in {skill_file(skill)}."


def _manager(skill: Skill) -> Iterator[str]:
    names = TypeNames(origin="..generated.types")
    inputs = inputs_class(skill, names)
    feedback = names(f"{class_name(skill.name)}Feedback") if skill.feedback else None
    yield f'"""The manager of `{skill.name}`. Written once by `skillwing generate`, and yours from then on."""'
    yield ""
    yield "from __future__ import annotations"
    yield ""
    yield "from skillwing.services.managers.hooks import Goal"
    yield "from skillwing.services.protocol import Terminal"
    yield ""
    yield f"from ..generated.managers import {abstract_manager(skill.name)}"
    yield from names.imports()
    yield from ("", "")
    yield from _hooks(skill, inputs, feedback)


def _hooks(skill: Skill, inputs: str, feedback: str | None) -> Iterator[str]:
    yield f"class {manager_class(skill.name)}({abstract_manager(skill.name)}):"
    yield f'{INDENT}"""Rejects all goals until it is written."""'
    yield ""
    yield f"{INDENT}def on_dispatch(self, goal: Goal[{inputs}]) -> None:"
    yield from docstring("Start the functional layer and return.", _how_it_ends(skill))
    yield f'{INDENT * 2}self.failed(goal.id, "{refusal(skill.name)}")'
    if feedback is not None:
        yield ""
        yield f"{INDENT}def progress(self, goal: Goal[{inputs}]) -> {feedback} | None:"
        called = f"Called every {skill.progress_period} s while the goal runs."
        yield from docstring(f"Return the progress as a `{feedback}`, or None for no feedback.", called)
        yield f"{INDENT * 2}return None"
    if skill.modifiable:
        yield ""
        yield f"{INDENT}def on_modify(self, goal: Goal[{inputs}]) -> None:"
        yield from docstring("Go on with the new inputs, which `validate` has accepted, and return.")
        yield f'{INDENT * 2}self.failed(goal.id, "{refusal(skill.name)}")'
    yield ""
    yield f"{INDENT}def on_interrupt(self, goal: Goal[{inputs}]) -> None:"
    stopped = f"Call `interrupted` when it has stopped, within {skill.interrupt.timeout} s; then the stop is forced."
    yield from docstring("Stop the functional layer and return.", stopped)
    yield f"{INDENT * 2}self.interrupted(goal.id)"
    yield ""
    yield f"{INDENT}def on_ended(self, goal: Goal[{inputs}], terminal: Terminal) -> None:"
    yield from docstring("Stop all activity for the goal, which a broken invariant may have ended.")


def _how_it_ends(skill: Skill) -> str:
    if not skill.results:
        return "It runs until it is interrupted."
    return f"Later call {enumeration([f'`terminated_{result.name}`' for result in skill.results], 'or')}."
