"""What stands in a draft for a node that could not be built, or not as it was written."""

from __future__ import annotations

from collections.abc import Sequence

from py_trees.behaviour import Behaviour
from py_trees.common import Status

_ATTRIBUTE = "_is_guessed"


class Unbuilt(Behaviour):
    """Keeps a place in a draft, so that everything around and below it can be looked at; never in a flight."""

    def __init__(self, name: str, children: Sequence[Behaviour] = ()) -> None:
        super().__init__(name)
        self.children = list(children)

    def update(self) -> Status:
        return Status.FAILURE


def mark_guessed(node: Behaviour) -> None:
    """Note that a node of a draft was made with a name that its author did not write, and knows of already."""
    setattr(node, _ATTRIBUTE, True)


def is_guessed(node: Behaviour) -> bool:
    return getattr(node, _ATTRIBUTE, False)
