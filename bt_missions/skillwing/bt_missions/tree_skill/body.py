"""`skillwing new-skill --tree`: a tree file as the body of a new skill."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from skillwing.bt_missions.tree_skill.checks import body_problems, read_body, tree_skill_problems
from skillwing.bt_missions.xml.document import FileProblem, TreeFileError
from skillwing.bt_missions.xml.port_types import LANGUAGE_NAMES, LIST
from skillwing.bt_missions.xml.tree_file import DeclaredPort, TreeFile
from skillwing.dsl.model import EnumType, Skillset
from skillwing.dsl.naming import manager_class

_BLOCK = """\
    // Runs the tree in skills/{file}.
    skill {skill} {{
{inputs}        result {{
            success {success}
            failure {failure}
        }}
    }}
"""
_MANAGER = '''\
"""The manager of `{skill}`. Written once by `skillwing new-skill`, and yours from then on."""

from __future__ import annotations

from pathlib import Path

from skillwing.bt_missions.tree_skill.hooks import TreeHooks

from ..generated.managers import Abstract{manager}
from ..generated.processes import SKILLSET


class {manager}(TreeHooks, Abstract{manager}):
    """Runs the tree beside this file for each goal."""

    skillset_file = SKILLSET
    tree_file = Path(__file__).with_name("{file}")
'''
_TEST = '''\
"""Tests of `{skill}`. Written once by `skillwing new-skill`, and yours from then on."""

from __future__ import annotations

from skillwing.bt_missions.tree_skill.checks import body_problems, read_body
from skillwing.dsl import load

from {package}.generated.processes import SKILLSET
from {package}.skills.{skill} import {manager}


def test_its_tree_fits_the_skillset() -> None:
    """Add runs on mocks: `SkillsetInProcess(SKILLSET, [{manager}])` of `skillwing.services.testing`."""
    file, skillset = {manager}.tree_file, load(SKILLSET)
    assert body_problems(read_body(file, skillset), skillset, "{skill}", file.parent) == []
'''


@dataclass(frozen=True)
class TreeBody:
    """A tree file as the body of the skill `skill`. block: of the skill, for the skillset."""

    skill: str
    source: TreeFile
    block: str

    def files(self, skillset: Skillset, package: Path | None) -> Mapping[str, str]:
        """The files of the robot's package by their path there. skillset: with the new skill.

        Raises TreeFileError with all problems of the tree.
        """
        folder = (package or self.source.file.parent) / "skills"
        if problems := body_problems(self.source, skillset, self.skill, folder):
            raise TreeFileError(self.source.file, problems)
        tree = self.source.file.read_text(encoding="utf-8")
        file = f"{self.skill}{self.source.file.suffix}"
        manager = _MANAGER.format(skill=self.skill, manager=manager_class(self.skill), file=file)
        return {f"skills/{self.skill}.py": manager, f"skills/{file}": tree}

    def test(self, package: str) -> str:
        """The first test of the manager. package: import name of the robot's package."""
        return _TEST.format(skill=self.skill, manager=manager_class(self.skill), package=package)


def tree_body(file: Path, skill: str, skillset: Skillset) -> TreeBody:
    """The body of a new skill. Its inputs are the ports of the file's main tree.

    Raises TreeFileError for a file that is no tree file, or with ports that cannot be inputs.
    """
    source = read_body(file, skillset)
    problems: list[FileProblem] = []
    lines = list(_input_lines(source, skillset, problems))
    if problems or source.problems:
        raise TreeFileError(file, [*problems, *tree_skill_problems(source, skillset, skill)])
    inputs = "".join(f"            {line}\n" for line in lines)
    results = source.main_model.metadata
    block = _BLOCK.format(
        skill=skill,
        file=f"{skill}{file.suffix}",
        inputs=f"        input {{\n{inputs}        }}\n" if inputs else "",
        success=results.get("success", "DONE"),
        failure=results.get("failure", "FAILED"),
    )
    return TreeBody(skill, source, block)


def _input_lines(source: TreeFile, skillset: Skillset, problems: list[FileProblem]) -> Iterator[str]:
    for port in source.main_model.ports:
        kind = port.kind.removesuffix(LIST)
        own = {each.name: each for each in skillset.types}
        if kind not in LANGUAGE_NAMES and kind not in own:
            text = f"Port `{port.name}` is of type `{port.kind}`, which {skillset.name} does not have. Change its type."
            problems.append(FileProblem(port.line, text))
            continue
        is_enum = isinstance(own.get(kind), EnumType)
        ends = port.kind.removeprefix(kind)
        yield f"{port.name}: {LANGUAGE_NAMES.get(kind, kind)}{ends}{_default(port, is_enum)}"


def _default(port: DeclaredPort, is_enum: bool) -> str:
    """The default of an input; structures and lists have none in the language."""
    if not port.default:
        return ""
    if port.kind == "string":
        return f" = {json.dumps(port.default)}"
    return f" = {port.default}" if is_enum or port.kind in LANGUAGE_NAMES else ""
