"""Folders of Python as packages: their import names, names that cannot be imported, and the folder of their tests."""

from __future__ import annotations

import keyword
import re
import sys
from collections import Counter
from collections.abc import Collection
from pathlib import Path
from typing import Any

_OURS = "skillwing"


def import_name(folder: Path) -> tuple[str, Path]:
    """The dotted name of a package folder, and the folder that has to be on `sys.path` for it.

    The name starts below the first ancestor that is no package itself. A part of a namespace package starts at an entry
    of `sys.path` further up.
    """
    folder = folder.resolve()
    root = folder.parent
    while (root / "__init__.py").is_file():
        root = root.parent
    # The current folder is on the path by accident: it is another one tomorrow.
    known = {Path(entry).resolve() for entry in sys.path if entry} - {Path.cwd()}
    for ancestor in (root, *root.parents):
        parts = folder.relative_to(ancestor).parts
        if ancestor in known and all(part.isidentifier() for part in parts):
            root = ancestor
            break
    return ".".join(folder.relative_to(root).parts), root


def name_problem(folder: Path) -> str | None:
    """The reason why a folder of that name cannot be imported, with a name to use instead; None if it can."""
    name = folder.resolve().name
    if name in sys.stdlib_module_names or name == _OURS:
        return f"`{name}` is a module that Python finds first. Choose another name, such as `{name}_robot`."
    if keyword.iskeyword(name):
        return f"`{name}` is a word of Python and cannot be imported. Choose another name, such as `{name}_robot`."
    if not name.isidentifier():
        usable = re.sub(r"\W", "_", name)
        usable = usable if usable.isidentifier() else f"robot_{usable}"
        return f"`{name}` cannot be imported as a Python package. Write `{folder.with_name(usable)}`."
    return None


def project_of(folder: Path) -> Path | None:
    """The folder of the `pyproject.toml` that a package belongs to; None if there is none."""
    return next((each for each in (folder.resolve(), *folder.resolve().parents) if _project_file(each).is_file()), None)


def tests_folder(package: Path, skills: Collection[str]) -> Path:
    """The folder where the project's pytest collects the tests of a robot's skills.

    A project without `testpaths` has them in `tests` of the package. Otherwise it is the folder below its test paths
    that has most tests of these skills, or its first test path.
    """
    inside, project = package / "tests", project_of(package)
    roots = [] if project is None else [project / path for path in _test_paths(project)]
    if project is None or not roots or any(inside.resolve().is_relative_to(root) for root in roots):
        return inside
    names = {f"test_{skill}.py" for skill in skills}
    found = Counter(file.parent for root in roots for file in root.rglob("test_*.py") if file.name in names)
    chosen = found.most_common(1)[0][0] if found else roots[0]
    here = Path.cwd()
    return chosen.relative_to(here) if chosen.is_relative_to(here) else chosen


def _project_file(folder: Path) -> Path:
    return folder / "pyproject.toml"


def _test_paths(project: Path) -> list[str]:
    try:
        import tomllib  # noqa: PLC0415 - processes of a robot read no project file

        content: Any = tomllib.loads(_project_file(project).read_text("utf-8"))
        paths = content["tool"]["pytest"]["ini_options"]["testpaths"]
    except (OSError, ValueError, KeyError, TypeError):
        return []
    return paths.split() if isinstance(paths, str) else list(paths)
