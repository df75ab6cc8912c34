"""The package of a robot: all files that follow from its skillset.

    rover/generated/       rewritten by each run, never edited
    rover/skills/*.py      one manager for each skill, written once
    rover/robot.py         the table of processes, written once

Files of the user are never overwritten. The output is deterministic and readable.
"""

from __future__ import annotations

import ast
import os
from collections.abc import Collection, Mapping
from pathlib import Path

from skillwing.dsl.generating import (
    client_modules,
    compose_file,
    managers_module,
    mocks_module,
    processes_module,
    types_module,
)
from skillwing.dsl.generating.skeletons import skill_file
from skillwing.dsl.model import Skillset
from skillwing.dsl.naming import script_of
from skillwing.dsl.reading.parser import self_contained
from skillwing.dsl.whole_files import write_whole

GENERATED = "generated"
MARKS = ("# Generated from", "// Generated from")
"""First words of every generated file."""


def generate(skillset: Skillset, source: Path, folder: Path, managed: Collection[str]) -> Mapping[str, str]:
    """The files of `generated/` by name, without the copy of the skillset.

    source: the skillset's file. folder: the package. managed: the skills that have a manager. Reads nothing from disk.
    Only the last part of the paths and their relation have an effect.
    """
    if _in_place(skillset, source, folder):
        location = source.resolve().relative_to(folder.resolve()).parts
    else:
        location = (GENERATED, _copied_as(skillset, source))
    modules = {
        "__init__.py": (
            f'"""Made from the skillset `{skillset.name}`, and never edited."""',
            "",
            f'SCHEMA_HASH = "{skillset.schema_hash}"',
        ),
        "types.py": types_module.lines(skillset),
        "managers.py": managers_module.lines(skillset),
        "signatures.py": client_modules.signatures(skillset),
        client_modules.WAITING.module: client_modules.lines(skillset, client_modules.WAITING),
        client_modules.ASYNCHRONOUS.module: client_modules.lines(skillset, client_modules.ASYNCHRONOUS),
        "mocks.py": mocks_module.lines(skillset),
        "processes.py": processes_module.lines(skillset, location, managed),
        "compose.yml": compose_file.lines(skillset, folder.resolve().name, managed),
    }
    header = _header("#", source.name)
    return {name: header + "\n".join(lines) + "\n" for name, lines in modules.items()}


def skillset_copy(skillset: Skillset, source: Path, folder: Path, text: str) -> Mapping[str, str]:
    """The copy of a skillset that lies outside of the package; none for one inside.

    The copy has the name of the skillset, by which processes find it. It includes no other files.
    """
    if _in_place(skillset, source, folder):
        return {}
    copy = self_contained(text, str(source))
    return {_copied_as(skillset, source): _header("//", source.name) + copy}


def script_copy(skillset: Skillset, source: Path, folder: Path) -> Mapping[str, str]:
    """The copy of the mocks' script beside a skillset that is copied; none without a script. Raises OSError."""
    script = script_of(source)
    if _in_place(skillset, source, folder) or not script.is_file():
        return {}
    header = f"# Generated from {script.name} by `skillwing generate`. Do not edit: change that file instead.\n"
    return {script_of(Path(skillset.name)).name: header + script.read_text("utf-8")}


def _in_place(skillset: Skillset, source: Path, folder: Path) -> bool:
    inside = source.resolve().is_relative_to(folder.resolve())
    return inside and source.stem == skillset.name


def _copied_as(skillset: Skillset, source: Path) -> str:
    return skillset.name + source.suffix


def _header(comment: str, source: str) -> str:
    return f"{comment} Generated from {source} by `skillwing generate`. Do not edit: change the skillset instead.\n"


def is_generated(file: Path) -> bool:
    """True if a file was generated."""
    return file.is_file() and file.read_text("utf-8", errors="replace").startswith(MARKS)


class RobotFolder:
    """A robot's package on the disk. Its methods raise OSError where the disk does."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.generated = path / GENERATED

    @property
    def exists(self) -> bool:
        """True if the folder holds a generated package."""
        return is_generated(self.generated / "processes.py")

    def managed(self, skillset: Skillset) -> tuple[str, ...]:
        """The skills with a manager file."""
        return tuple(skill.name for skill in skillset.skills if (self.path / skill_file(skill.name)).is_file())

    def foreign(self, products: Collection[str]) -> tuple[Path, ...]:
        """The files in `generated/` that would be overwritten although they were not generated."""
        paths = [self.generated / name for name in products]
        return tuple(path for path in paths if path.is_file() and not is_generated(path))

    def outdated(self, products: Mapping[str, str]) -> tuple[Path, ...]:
        """The files in `generated/` that are missing, different or superfluous."""
        paths = {self.generated / name: text for name, text in products.items()}
        stale = [path for path, text in paths.items() if not path.is_file() or path.read_text("utf-8") != text]
        return (*stale, *self._superfluous(products))

    def orphans(self, skillset: Skillset) -> tuple[Path, ...]:
        """Managers in `skills/` of skills that the skillset does not have."""
        known = {managers_module.abstract_manager(skill.name) for skill in skillset.skills}
        files = sorted((self.path / "skills").glob("*.py"))
        return tuple(file for file in files if not known.issuperset(_bases(file)))

    def write(self, products: Mapping[str, str]) -> None:
        """Write `generated/`, and remove generated files that are superfluous."""
        self.generated.mkdir(parents=True, exist_ok=True)
        for name, text in products.items():
            write_whole(self.generated / name, text)
        for path in self._superfluous(products):
            path.unlink()

    def write_once(self, files: Mapping[str, str]) -> tuple[Path, ...]:
        """Write the files that do not exist yet, by their path from the package; return their paths."""
        paths = {Path(os.path.normpath(self.path / name)): text for name, text in files.items()}
        missing = {path: text for path, text in paths.items() if not path.exists()}
        for path, text in missing.items():
            path.parent.mkdir(parents=True, exist_ok=True)
            write_whole(path, text)
        return tuple(missing)

    def _superfluous(self, products: Collection[str]) -> tuple[Path, ...]:
        if not self.generated.is_dir():
            return ()
        return tuple(
            path
            for path in sorted(self.generated.iterdir())
            if path.name not in products and not path.name.startswith(".") and is_generated(path)
        )


def _bases(file: Path) -> set[str]:
    """The generated classes that a module imports as base classes; none if it cannot be read."""
    try:
        tree = ast.parse(file.read_text("utf-8"))
    except (SyntaxError, ValueError):
        return set()
    imports = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    return {
        alias.name
        for node in imports
        if (node.module or "").endswith("generated.managers")
        for alias in node.names
        if alias.name.startswith("Abstract")
    }
