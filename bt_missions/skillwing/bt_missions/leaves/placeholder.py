"""Placeholders in the draft of a tree for nodes that cannot be built as they are written."""

from __future__ import annotations

from collections.abc import Sequence

from py_trees.behaviour import Behaviour
from py_trees.common import Status

_GUESSED = "_is_guessed"
_INCOMPLETE = "_is_incomplete"


class PlaceholderNode(Behaviour):
    """Keeps a place in a draft, so that all around and below it can be checked. It never runs.

    Its behaviour is unknown: no further problem is derived from it, as its own problem is reported already.
    """

    def __init__(self, name: str, children: Sequence[Behaviour] = ()) -> None:
        super().__init__(name)
        self.children = list(children)

    def update(self) -> Status:
        return Status.FAILURE


def mark_guessed(node: Behaviour) -> None:
    """Mark a node of a draft that was built with a guessed name. Its own problem is reported already."""
    setattr(node, _GUESSED, True)


def is_guessed(node: Behaviour) -> bool:
    return getattr(node, _GUESSED, False)


def mark_incomplete(node: Behaviour) -> None:
    """Mark a node of a draft of which a part could not be read. What it lacks may have been that part."""
    setattr(node, _INCOMPLETE, True)


def is_incomplete(node: Behaviour) -> bool:
    return getattr(node, _INCOMPLETE, False)
