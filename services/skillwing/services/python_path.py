"""Folders from which Python imports the packages of users."""

from __future__ import annotations

import os
import sys
from pathlib import Path


def make_importable(root: Path) -> None:
    """Put a folder at the end of the path of this process and its children."""
    if str(root) not in sys.path:
        sys.path.append(str(root))
        inherited = os.environ.get("PYTHONPATH")
        os.environ["PYTHONPATH"] = os.pathsep.join([*([inherited] if inherited else []), str(root)])


def folder_of_packages(file: Path) -> Path:
    """The folder with the packages beside a Python file. If the file is in a package, the one that contains it."""
    folder = file.resolve().parent
    while any((each / "__init__.py").is_file() for each in (folder, folder.parent)):
        folder = folder.parent
    return folder
