"""Where the nodes of a behaviour tree stand on the screen.

The tree grows from left to right, because names are wide and panels are too: each leaf has a row of its own, a
parent stands level with the middle of its children, and each depth has a column as wide as its longest name.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from skillwing.services.protocol import TreeNode

ROW = 24.0
"""Height of a leaf's row in scene units (about the pixels of a full-size panel)."""
LETTER = 7.2
"""Width of a letter in scene units."""
GAP = 34.0
"""Between two columns, for the branches."""


@dataclass(frozen=True, slots=True)
class Place:
    """Centre of a node's pill and half its width; x to the right, y down."""

    x: float
    y: float
    half_width: float


@dataclass(frozen=True, slots=True)
class TreeLayout:
    """`places[i]` belongs to the i-th node given; `branches` are polylines from parents to children."""

    places: tuple[Place, ...]
    branches: tuple[tuple[tuple[float, float], ...], ...]

    @property
    def width(self) -> float:
        return max((place.x + place.half_width for place in self.places), default=0.0)

    @property
    def height(self) -> float:
        return max((place.y for place in self.places), default=0.0) + ROW / 2


def lay_out(nodes: Sequence[TreeNode]) -> TreeLayout:
    """Places for `nodes`, which may come in any order; a node whose parent is missing is a root.

    Raises ValueError if the parents form a circle or two nodes share an index.
    """
    by_index = {node.index: node for node in nodes}
    if len(by_index) != len(nodes):
        raise ValueError("two nodes of the tree have the same index")
    children: dict[int | None, list[int]] = {}
    for node in nodes:
        parent = node.parent if node.parent in by_index else None
        children.setdefault(parent, []).append(node.index)

    depth: dict[int, int] = {}
    preorder: list[int] = []
    waiting = [(index, 0) for index in reversed(children.get(None, []))]
    while waiting:
        index, level = waiting.pop()
        depth[index] = level
        preorder.append(index)
        waiting += [(child, level + 1) for child in reversed(children.get(index, []))]
    if len(preorder) != len(nodes):
        raise ValueError("some nodes of the tree are their own ancestors")

    widths = {index: max(4, len(by_index[index].name)) * LETTER for index in preorder}
    y = _rows(preorder, children)
    x = _columns(depth, widths)
    places = {index: Place(x[depth[index]] + widths[index] / 2, y[index], widths[index] / 2) for index in preorder}
    branches = [_elbow(places[parent], places[child]) for parent in preorder for child in children.get(parent, [])]
    return TreeLayout(tuple(places[node.index] for node in nodes), tuple(branches))


def _rows(preorder: Sequence[int], children: dict[int | None, list[int]]) -> dict[int, float]:
    leaves = [index for index in preorder if index not in children]
    y = {leaf: (row + 0.5) * ROW for row, leaf in enumerate(leaves)}
    for index in reversed(preorder):
        if below := children.get(index):
            y[index] = (y[below[0]] + y[below[-1]]) / 2
    return y


def _columns(depth: dict[int, int], widths: dict[int, float]) -> list[float]:
    """The left edge of each column."""
    edges: list[float] = [0.0]
    for level in range(max(depth.values(), default=0)):
        widest = max(widths[index] for index, at in depth.items() if at == level)
        edges.append(edges[-1] + widest + GAP)
    return edges


def _elbow(parent: Place, child: Place) -> tuple[tuple[float, float], ...]:
    start, end = parent.x + parent.half_width, child.x - child.half_width
    bend = end - GAP / 2
    return (start, parent.y), (bend, parent.y), (bend, child.y), (end, child.y)
