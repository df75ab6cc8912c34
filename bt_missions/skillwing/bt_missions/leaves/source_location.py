"""Where in a mission's file a node was written, for those who have to mend it."""

from __future__ import annotations

import sys
from pathlib import Path

from py_trees.behaviour import Behaviour

_PIECES = tuple(str(Path(__file__).parents[1] / folder) for folder in ("leaves", "subtrees", "planning"))
"""What missions are made of; the mission's own file is the first caller that stands elsewhere."""
_ATTRIBUTE = "_written_at"


def set_source_location(node: Behaviour, file: Path, line: int) -> None:
    setattr(node, _ATTRIBUTE, f"{file}:{line}")


def set_caller_location(node: Behaviour) -> None:
    """Note the line of the mission that makes a node: to be called by its constructor."""
    frame = sys._getframe(1)
    while frame.f_back is not None and frame.f_code.co_filename.startswith(_PIECES):
        frame = frame.f_back
    set_source_location(node, Path(frame.f_code.co_filename), frame.f_lineno)


def source_location(node: Behaviour) -> str | None:
    """`file:line` of a node, or of the first one below it for which that is known."""
    found = (getattr(each, _ATTRIBUTE, None) for each in (node, *node.iterate()))
    return next((place for place in found if place is not None), None)
