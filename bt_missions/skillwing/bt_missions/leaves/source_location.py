"""Source locations of nodes: the line of a mission's file in which each was written."""

from __future__ import annotations

import sys
from pathlib import Path

import py_trees
from py_trees.behaviour import Behaviour

_LIBRARY = (
    *(str(Path(__file__).parents[1] / folder) for folder in ("leaves", "subtrees", "planning")),
    str(Path(py_trees.__file__).parent),
)
"""Folders of nodes that missions are made of. The first caller outside of them is the mission."""
_ATTRIBUTE = "_written_at"


def set_source_location(node: Behaviour, file: Path, line: int, column: int = 0) -> None:
    """Note where a node was written. line, column: from 1; column 0 for the whole line."""
    setattr(node, _ATTRIBUTE, f"{file}:{line}:{column}" if column else f"{file}:{line}")


def is_library_file(file: str) -> bool:
    """True for a file of the nodes that missions are made of, or of py_trees."""
    return file.startswith(_LIBRARY)


def set_caller_location(node: Behaviour) -> None:
    """Note the line of the mission that makes a node. The constructor of the node calls this."""
    frame = sys._getframe(1)
    while frame.f_back is not None and is_library_file(frame.f_code.co_filename):
        frame = frame.f_back
    set_source_location(node, Path(frame.f_code.co_filename), frame.f_lineno)


def source_location(node: Behaviour) -> str | None:
    """`file:line` or `file:line:column` of a node, or of the first one below it with a known location."""
    found = (getattr(each, _ATTRIBUTE, None) for each in (node, *node.iterate()))
    return next((place for place in found if place is not None), None)
