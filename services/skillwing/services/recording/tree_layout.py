"""Layout of a behaviour tree on the screen, as an outline.

Mission trees are deep and their names are long. So each node has a row, in the order of ticking, indented under its
parent. The outline fits a tall, narrow panel, and its width depends only on the tree's depth.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from msgspec.structs import replace

from skillwing.services.protocol import TreeNode

ROWS = 41
"""Rows that fit the panel; a larger tree is drawn with lower rows."""
ROW = 20.0
"""Height of a row in scene units, which are the pixels of a panel in a 1600 x 900 dashboard."""
WIDTH = 312.0
"""Width of the panel in scene units."""
INDENT = 11.0
LETTER = 6.0
"""Width of a letter in scene units."""


@dataclass(frozen=True, slots=True)
class NodeBox:
    """Box of a node's pill: its left and right end, and its row; x to the right, y down."""

    left: float
    right: float
    y: float


@dataclass(frozen=True, slots=True)
class TreeLayout:
    """boxes: one for each node. branches: polylines from parents down to children. row: height of a row."""

    boxes: tuple[NodeBox, ...]
    branches: tuple[tuple[tuple[float, float], ...], ...]
    row: float = ROW


class Outline:
    """Selects the nodes that get a row: visited nodes and their children.

    A branch that was never visited is one row, and opens when the mission enters it. In a failed branch that another
    one has replaced, only the path to the failure keeps its rows. If there are more rows than fit the panel, as in
    missions on several robots, `condensed` leaves some out.
    """

    def __init__(self) -> None:
        self._latest: dict[int, str] = {}

    def shown(self, nodes: Sequence[TreeNode]) -> tuple[TreeNode, ...]:
        """The nodes of the next snapshot that get a row."""
        self._latest.update((node.index, node.status) for node in nodes if node.status != "INVALID")
        tree = {node.index: node for node in nodes}
        rows = [
            node
            for node in nodes
            if node.parent is None or (node.parent in self._latest and not self._is_folded(node, tree))
        ]
        return tuple(condensed(rows, self._latest))

    def _is_folded(self, node: TreeNode, tree: Mapping[int, TreeNode]) -> bool:
        """True for a node of a branch that was given up, away from the path to its failure."""
        to_failure = True
        for _ in tree:  # bounded, even if parents form a circle
            to_failure = to_failure and self.latest(node) == "FAILURE"
            parent = None if node.parent is None else tree.get(node.parent)
            if parent is None:
                return False
            if not to_failure and self._gave_up(parent):
                return True
            node = parent
        return False

    def _gave_up(self, node: TreeNode) -> bool:
        """True for a failed node below one that has not failed."""
        above = None if node.parent is None else self._latest.get(node.parent)
        return self.latest(node) == "FAILURE" and above in ("RUNNING", "SUCCESS")

    def latest(self, node: TreeNode) -> str:
        """The status of the node at its last visit; INVALID before the first one."""
        return self._latest.get(node.index, "INVALID")


def condensed(nodes: Sequence[TreeNode], latest: Mapping[int, str], rows: int = ROWS) -> Sequence[TreeNode]:
    """The nodes that fit so many rows, or a few more. Each step is taken only if the one before was not enough:

    1. What was never visited has no row.
    2. What lies below a success has no row.
    3. A node with one child has no row, except a root: the child stands in its place.

    latest: status of each visited node at its last visit.
    """
    if len(nodes) > rows:
        nodes = [node for node in nodes if node.parent is None or node.index in latest]
    if len(nodes) > rows:
        nodes = _without_done(nodes, latest)
    if len(nodes) > rows:
        nodes = _without_chains(nodes)
    return nodes


def _without_done(nodes: Sequence[TreeNode], latest: Mapping[int, str]) -> list[TreeNode]:
    done: set[int] = set()
    kept: list[TreeNode] = []
    for node in nodes:  # parents come first
        if node.parent in done:
            done.add(node.index)
            continue
        kept.append(node)
        if latest.get(node.index) == "SUCCESS":
            done.add(node.index)
    return kept


def _without_chains(nodes: Sequence[TreeNode]) -> list[TreeNode]:
    number = Counter(node.parent for node in nodes)
    stands_for: dict[int, int | None] = {}
    kept: list[TreeNode] = []
    for node in nodes:
        parent = node.parent if node.parent is None else stands_for.get(node.parent, node.parent)
        if node.parent is not None and number[node.index] == 1:
            stands_for[node.index] = parent
        else:
            kept.append(replace(node, parent=parent))
    return kept


def lay_out(nodes: Sequence[TreeNode]) -> TreeLayout:
    """Boxes for `nodes`; siblings keep their order. A node whose parent is missing is a root.

    Raises ValueError for parents that form a circle, and for two nodes with the same index.
    """
    by_index = {node.index: node for node in nodes}
    if len(by_index) != len(nodes):
        raise ValueError("two nodes of the tree have the same index")
    children: dict[int | None, list[int]] = {}
    for node in nodes:
        parent = node.parent if node.parent in by_index else None
        children.setdefault(parent, []).append(node.index)

    row = min(ROW, ROW * ROWS / max(len(nodes), 1))
    boxes: dict[int, NodeBox] = {}
    branches: list[tuple[tuple[float, float], ...]] = []
    waiting = [(index, 0) for index in reversed(children.get(None, []))]
    while waiting:
        index, depth = waiting.pop()
        node = by_index[index]
        left = depth * INDENT
        box = boxes[index] = NodeBox(left, left + (len(node.name) + 3) * LETTER, (len(boxes) + 0.5) * row)
        if node.parent in boxes:
            branches.append(_elbow(boxes[node.parent], box))
        waiting += [(child, depth + 1) for child in reversed(children.get(index, []))]
    if len(boxes) != len(nodes):
        raise ValueError("some nodes of the tree are their own ancestors")
    return TreeLayout(tuple(boxes[node.index] for node in nodes), tuple(branches), row)


def _elbow(parent: NodeBox, child: NodeBox) -> tuple[tuple[float, float], ...]:
    stem = parent.left + INDENT / 2
    return (stem, parent.y), (stem, child.y), (child.left, child.y)
