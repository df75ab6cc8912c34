"""Behaviour trees as messages and as text."""

from __future__ import annotations

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Composite
from py_trees.decorators import Decorator
from rich.text import Text

from skillwing.bt_missions.leaves.conditions import DataCompare, ResourceIs
from skillwing.bt_missions.leaves.may_start import MayStart
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.services.protocol import NodeStatus, TreeNode, TreeSnapshot

_MARKS = {
    NodeStatus.SUCCESS: ("✓", "green"),
    NodeStatus.FAILURE: ("✗", "red"),
    NodeStatus.RUNNING: ("▶", "blue"),
    NodeStatus.INVALID: ("·", "dim"),
}


class SnapshotBuilder:
    """Nodes of a `TreeSnapshot` for one tree, built again only after a change.

    Nodes are in depth-first order, each after its parent. `kind` is `Sequence`, `Selector`, `Parallel`, `Decorator`,
    `Action` (runs a skill), `Condition`, or `Behaviour`. The shape of the tree must not change.
    """

    def __init__(self, root: Behaviour) -> None:
        self._members = _depth_first(root, None, [])
        self._states: list[tuple[Status, str]] = []
        self.nodes: tuple[TreeNode, ...] = ()

    def update(self) -> bool:
        """Compare the tree with the latest nodes. Returns True if it has changed. Called after every tick, so fast."""
        states = [(node.status, node.feedback_message) for node, _ in self._members]
        if states == self._states:
            return False
        self._states = states
        self.nodes = tuple(
            TreeNode(
                index=index,
                parent=parent,
                name=node.name,
                kind=_kind(node),
                status=NodeStatus(node.status.name),
                feedback=node.feedback_message,
            )
            for index, (node, parent) in enumerate(self._members)
        )
        return True


def _depth_first(
    node: Behaviour, parent: int | None, seen: list[tuple[Behaviour, int | None]]
) -> list[tuple[Behaviour, int | None]]:
    """Append `node` and all below it to `seen`, each with the index of its parent."""
    index = len(seen)
    seen.append((node, parent))
    for child in node.children:
        _depth_first(child, index, seen)
    return seen


def render_tree(snapshot: TreeSnapshot, *, feedback: bool = True) -> Text:
    """One line per node, indented by depth, with a mark and a colour for its status."""
    depth: dict[int, int] = {}
    text = Text()
    for node in snapshot.nodes:
        depth[node.index] = 0 if node.parent is None else depth[node.parent] + 1
        mark, style = _MARKS[node.status]
        text.append(f"{'  ' * depth[node.index]}{mark} {node.name}", style)
        if feedback and node.feedback:
            text.append(f"  {node.feedback}", "dim")
        text.append("\n")
    return text


def _kind(node: Behaviour) -> str:
    if isinstance(node, SkillAction):
        return "Action"
    if isinstance(node, (ResourceIs, DataCompare, MayStart)):
        return "Condition"
    if isinstance(node, Decorator):
        return "Decorator"
    return type(node).__name__ if isinstance(node, Composite) else "Behaviour"
