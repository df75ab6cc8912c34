"""Exceptions in the code of leaves: the leaf, its line, and its mark in the tree."""

from __future__ import annotations

from pathlib import Path
from traceback import walk_tb

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from skillwing.bt_missions.leaves.source_location import is_library_file, source_location


def mark_raising_leaf(tree: Behaviour, error: BaseException, mission_file: Path | None) -> str:
    """Show at the leaf of `tree` that has raised `error` why it fails; returns the same as a clause.

    mission_file: file of the mission. The text names the innermost line of the traceback in this file. Without one it
    names that of the leaf's own code, or else the line in which the leaf was written.
    """
    nodes = {id(node): node for node in tree.iterate()}
    lines = [
        (nodes.get(id(frame.f_locals.get("self"))), frame.f_code.co_filename, line)
        for frame, line in walk_tb(error.__traceback__)
    ]
    raising = [node for node, _, _ in lines if node is not None]
    text = f"raised {type(error).__name__}" + (f": {error}" if str(error) else "")
    if not raising:
        return f"the tree {text}"
    leaf = raising[-1]
    places = [f"{file}:{line}" for _, file, line in lines if file == str(mission_file)]
    places = places or [f"{file}:{line}" for node, file, line in lines if node is leaf and not is_library_file(file)]
    place = places[-1] if places else source_location(leaf)
    text = text if place is None else f"{text} ({place})"
    leaf.status, leaf.feedback_message = Status.FAILURE, text
    return f"`{leaf.name}` {text}"
