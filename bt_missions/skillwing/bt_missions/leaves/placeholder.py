"""What stands in a draft for a node that could not be built, or not as it was written."""

from __future__ import annotations

from collections.abc import Sequence

from py_trees.behaviour import Behaviour
from py_trees.common import Status

_GUESSED = "_is_guessed"
_INCOMPLETE = "_is_incomplete"


class PlaceholderNode(Behaviour):
    """Keeps a place in a draft, so that everything around and below it can be looked at; never in a flight.

    What it does is not known, so that nothing follows from it: its author knows already what is wrong here.
    """

    def __init__(self, name: str, children: Sequence[Behaviour] = ()) -> None:
        super().__init__(name)
        self.children = list(children)

    def update(self) -> Status:
        return Status.FAILURE


def mark_guessed(node: Behaviour) -> None:
    """Note that a node of a draft was made with a name that its author did not write, and knows of already."""
    setattr(node, _GUESSED, True)


def is_guessed(node: Behaviour) -> bool:
    return getattr(node, _GUESSED, False)


def mark_incomplete(node: Behaviour) -> None:
    """Note that something of what its author wrote about a node of a draft could not be read, and that he knows.

    Whatever the node lacks now may have been that.
    """
    setattr(node, _INCOMPLETE, True)


def is_incomplete(node: Behaviour) -> bool:
    return getattr(node, _INCOMPLETE, False)
