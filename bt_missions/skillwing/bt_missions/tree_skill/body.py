"""`skillwing new-skill --tree`: a tree file as the body of a new skill."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from skillwing.bt_missions.tree_skill.checks import cycle, tree_skill_problems
from skillwing.bt_missions.xml.document import FileProblem, TreeFileError
from skillwing.bt_missions.xml.tree_file import DeclaredPort, TreeFile, read_tree_file
from skillwing.dsl.model import EnumType, Skillset
from skillwing.dsl.naming import manager_class
from skillwing.services.errors import InvalidOptionError

SCALARS = {"double": "float64", "float": "float64", "int": "int64", "bool": "bool", "string": "string"}
"""Types of the language for the types of ports."""
_BLOCK = """\
    // Runs the tree in skills/{skill}.xml.
    skill {skill} {{
{inputs}        result {{
            success DONE
            failure FAILED
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
    tree_file = Path(__file__).with_name("{skill}.xml")
'''
_TEST = '''\
"""Tests of `{skill}`. Written once by `skillwing new-skill`, and yours from then on."""

from __future__ import annotations

from skillwing.bt_missions.tree_skill.checks import tree_skill_problems
from skillwing.bt_missions.xml.tree_file import read_tree_file
from skillwing.dsl import load

from {package}.generated.processes import SKILLSET
from {package}.skills.{skill} import {manager}


def test_its_tree_fits_the_skillset() -> None:
    """Add runs on mocks: `SkillsetInProcess(SKILLSET, [{manager}])` of `skillwing.services.testing`."""
    assert tree_skill_problems(read_tree_file({manager}.tree_file), load(SKILLSET), "{skill}") == []
'''


@dataclass(frozen=True)
class TreeBody:
    """A tree file as the body of the skill `skill`. block: of the skill, for the skillset."""

    skill: str
    source: TreeFile
    block: str

    def files(self, skillset: Skillset, package: Path | None) -> Mapping[str, str]:
        """The files of the robot's package by their path there. skillset: with the new skill.

        Raises TreeFileError with all problems of the tree, and InvalidOptionError for trees that start each other.
        """
        if problems := tree_skill_problems(self.source, skillset, self.skill):
            raise TreeFileError(self.source.file, problems)
        trees = {} if package is None else _trees_of(package, skillset)
        if ring := cycle({**trees, self.skill: self.source}, skillset):
            names = " -> ".join(f"`{name}`" for name in ring)
            raise InvalidOptionError("tree", f"These skills would start each other for ever: {names}. Change a tree.")
        tree = self.source.file.read_text(encoding="utf-8")
        manager = _MANAGER.format(skill=self.skill, manager=manager_class(self.skill))
        return {f"skills/{self.skill}.py": manager, f"skills/{self.skill}.xml": tree}

    def test(self, package: str) -> str:
        """The first test of the manager. package: import name of the robot's package."""
        return _TEST.format(skill=self.skill, manager=manager_class(self.skill), package=package)


def tree_body(file: Path, skill: str, skillset: Skillset) -> TreeBody:
    """The body of a new skill. Its inputs are the ports of the file's main tree.

    Raises TreeFileError for a file that is no tree file, or with ports that cannot be inputs.
    """
    source = read_tree_file(file)
    problems: list[FileProblem] = list(source.problems)
    lines = list(_input_lines(source, skillset, problems))
    if problems:
        raise TreeFileError(file, problems)
    inputs = "".join(f"            {line}\n" for line in lines)
    block = _BLOCK.format(skill=skill, inputs=f"        input {{\n{inputs}        }}\n" if inputs else "")
    return TreeBody(skill, source, block)


def _input_lines(source: TreeFile, skillset: Skillset, problems: list[FileProblem]) -> Iterator[str]:
    for port in source.main_model.ports:
        kind = port.kind.removesuffix("[]")
        own = {each.name: each for each in skillset.types}
        if kind not in SCALARS and kind not in own:
            text = f"Port `{port.name}` is of type `{port.kind}`, which {skillset.name} does not have. Change its type."
            problems.append(FileProblem(port.line, text))
            continue
        is_enum = isinstance(own.get(kind), EnumType)
        ends = port.kind.removeprefix(kind)
        yield f"{port.name}: {SCALARS.get(kind, kind)}{ends}{_default(port, is_enum)}"


def _default(port: DeclaredPort, is_enum: bool) -> str:
    """The default of an input; structures and lists have none in the language."""
    if not port.default:
        return ""
    if port.kind == "string":
        return f" = {json.dumps(port.default)}"
    return f" = {port.default}" if is_enum or port.kind in SCALARS else ""


def _trees_of(package: Path, skillset: Skillset) -> dict[str, TreeFile]:
    """The trees of the skills in a robot's package, by skill."""
    names = {skill.name for skill in skillset.skills}
    files = [file for file in (package / "skills").glob("*.xml") if file.stem in names]
    return {file.stem: read_tree_file(file) for file in files}
