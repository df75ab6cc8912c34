"""Writes a mission to begin with."""

from __future__ import annotations

from pathlib import Path

from skillwing.services.errors import InvalidOptionError

_SOURCES = {".xml": "template.xml", ".py": "template.py.txt"}
"""By suffix. The Python one is text here, for it is no module of this package."""


def write_template(file: Path) -> None:
    """Write a mission that is called like the file.

    Raises InvalidOptionError where there is such a file already, or its suffix says neither XML nor Python.
    """
    if file.suffix not in _SOURCES:
        raise InvalidOptionError("FILE", f"`{file}` ends neither with .xml nor with .py. Name it {file.stem}.xml.")
    text = (Path(__file__).parent / _SOURCES[file.suffix]).read_text(encoding="utf-8")
    try:
        with file.open("x", encoding="utf-8") as opened:
            opened.write(text.replace("NAME", file.stem))
    except FileExistsError as error:
        raise InvalidOptionError("FILE", f"There is `{file}` already. Choose another name.") from error
