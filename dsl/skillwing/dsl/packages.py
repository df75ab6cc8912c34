"""Folders of Python as packages: what they are imported as, and which names cannot be."""

from __future__ import annotations

import keyword
import re
import sys
from pathlib import Path

_OURS = "skillwing"


def import_name(folder: Path) -> tuple[str, Path]:
    """The dotted name of a package folder, and the folder that has to be on `sys.path` for it.

    The name starts below the first ancestor that is no package itself. Where Python looks for packages further up,
    as for the parts of a namespace package, it starts there.
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
    """Why a folder of that name could not be imported, with what to write instead; None if it can."""
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
