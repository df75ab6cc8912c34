"""Import things with the packages of one image only: `image_imports.py LOCK MODULE[:NAME]...`.

Writes a line for each one that cannot be imported.
"""

from __future__ import annotations

import re
import sys
from importlib import import_module
from importlib.metadata import packages_distributions
from pathlib import Path


class Absent:
    """A finder of modules, before all others. It has none of those that an image lacks."""

    def __init__(self, lock: Path) -> None:
        held = {_plain(name) for name in re.findall(r"^([A-Za-z0-9._-]+)==", lock.read_text(), flags=re.MULTILINE)}
        self.modules = {
            module
            for module, owners in packages_distributions().items()
            if held.isdisjoint(map(_plain, owners)) and module != "skillwing"
        }

    def find_spec(self, name: str, *_: object) -> None:
        if name.partition(".")[0] in self.modules:
            raise ModuleNotFoundError(f"the image has no {name}")


def _plain(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def main(lock: str, *wanted: str) -> None:
    sys.meta_path.insert(0, Absent(Path(lock)))  # pyright: ignore[reportArgumentType]
    for each in wanted:
        module, _, name = each.partition(":")
        try:
            found = import_module(module)
        except ImportError as error:
            sys.stdout.write(f"{each}: {error}\n")
        else:
            assert not name or hasattr(found, name), each


if __name__ == "__main__":
    main(*sys.argv[1:])
