"""Where the nodes of a behaviour tree stand on the screen.

Mission trees are deep and their names are long, so the tree is an outline: one row a node, in the order in which it
is ticked, each node indented under its parent. It fits a tall, narrow panel and never gets wider than its depth.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from skillwing.services.protocol import TreeNode

ROWS = 41
"""Rows that fit the panel; a larger tree is drawn with lower rows."""
ROW = 20.0
"""Height of a row in scene units, which are the pixels of a panel in a 1600 x 900 dashboard."""
WIDTH = 312.0
"""Of the panel, likewise."""
INDENT = 11.0
LETTER = 6.0
"""Width of a letter in scene units."""


@dataclass(frozen=True, slots=True)
class Place:
    """Where a node's pill begins and ends, and its row; x to the right, y down."""

    left: float
    right: float
    y: float


@dataclass(frozen=True, slots=True)
class TreeLayout:
    """`places[i]` belongs to the i-th node given; `branches` are polylines from parents down to children; `row` is the
    height of a row."""

    places: tuple[Place, ...]
    branches: tuple[tuple[tuple[float, float], ...], ...]
    row: float = ROW


class Outline:
    """Which nodes of a tree are worth a row: those that were visited, and the children of those.

    So a branch that was never taken is one row, and opens up when the mission turns to it. Of one that failed, so that
    another has taken over, only what failed keeps its row.
    """

    def __init__(self) -> None:
        self._latest: dict[int, str] = {}

    def shown(self, nodes: Sequence[TreeNode]) -> tuple[TreeNode, ...]:
        """The nodes to show of the next snapshot."""
        self._latest.update((node.index, node.status) for node in nodes if node.status != "INVALID")
        tree = {node.index: node for node in nodes}
        return tuple(
            node
            for node in nodes
            if node.parent is None or (node.parent in self._latest and not self._is_folded(node, tree))
        )

    def _is_folded(self, node: TreeNode, tree: Mapping[int, TreeNode]) -> bool:
        """Whether it lies in a branch that was given up, and not on the way to what failed there."""
        to_failure = True
        for _ in tree:  # no longer than the tree is deep, also where parents form a circle
            to_failure = to_failure and self.latest(node) == "FAILURE"
            parent = None if node.parent is None else tree.get(node.parent)
            if parent is None:
                return False
            if not to_failure and self._gave_up(parent):
                return True
            node = parent
        return False

    def _gave_up(self, node: TreeNode) -> bool:
        """Whether it failed and what is above it did not, or not yet."""
        above = None if node.parent is None else self._latest.get(node.parent)
        return self.latest(node) == "FAILURE" and above in ("RUNNING", "SUCCESS")

    def latest(self, node: TreeNode) -> str:
        """The status of the node when it was last visited; INVALID for one that never was."""
        return self._latest.get(node.index, "INVALID")


def lay_out(nodes: Sequence[TreeNode]) -> TreeLayout:
    """Places for `nodes`; siblings keep the order in which they come. A node whose parent is missing is a root.

    Raises ValueError if the parents form a circle or two nodes share an index.
    """
    by_index = {node.index: node for node in nodes}
    if len(by_index) != len(nodes):
        raise ValueError("two nodes of the tree have the same index")
    children: dict[int | None, list[int]] = {}
    for node in nodes:
        parent = node.parent if node.parent in by_index else None
        children.setdefault(parent, []).append(node.index)

    row = min(ROW, ROW * ROWS / max(len(nodes), 1))
    places: dict[int, Place] = {}
    branches: list[tuple[tuple[float, float], ...]] = []
    waiting = [(index, 0) for index in reversed(children.get(None, []))]
    while waiting:
        index, depth = waiting.pop()
        node = by_index[index]
        left = depth * INDENT
        place = places[index] = Place(left, left + (len(node.name) + 3) * LETTER, (len(places) + 0.5) * row)
        if node.parent in places:
            branches.append(_elbow(places[node.parent], place))
        waiting += [(child, depth + 1) for child in reversed(children.get(index, []))]
    if len(places) != len(nodes):
        raise ValueError("some nodes of the tree are their own ancestors")
    return TreeLayout(tuple(places[node.index] for node in nodes), tuple(branches), row)


def _elbow(parent: Place, child: Place) -> tuple[tuple[float, float], ...]:
    stem = parent.left + INDENT / 2
    return (stem, parent.y), (stem, child.y), (child.left, child.y)
