"""Behaviour trees as messages and as text."""

from __future__ import annotations

from py_trees.behaviour import Behaviour
from py_trees.composites import Composite
from py_trees.decorators import Decorator
from rich.text import Text

from skillwing.services.protocol import TreeNode, TreeSnapshot

from .conditions import DataCompare, ResourceIs
from .skill_action import SkillAction

_LOOKS = {
    "SUCCESS": ("✓", "green"),
    "FAILURE": ("✗", "red"),
    "RUNNING": ("▶", "blue"),
    "INVALID": ("·", "dim"),
}


def nodes_of(root: Behaviour) -> tuple[TreeNode, ...]:
    """The tree in depth-first order, each node after its parent.

    `kind` is `Sequence`, `Selector`, `Parallel`, `Decorator`, `Action` (runs a skill), `Condition`, or `Behaviour`.
    """
    nodes: list[TreeNode] = []

    def visit(node: Behaviour, parent: int | None) -> None:
        index = len(nodes)
        nodes.append(
            TreeNode(
                index=index,
                parent=parent,
                name=node.name,
                kind=_kind(node),
                status=node.status.name,
                feedback=node.feedback_message,
            )
        )
        for child in node.children:
            visit(child, index)

    visit(root, None)
    return tuple(nodes)


def render(snapshot: TreeSnapshot, *, feedback: bool = True) -> Text:
    """One line a node, indented by depth, with a mark and colour for its status."""
    depth: dict[int, int] = {}
    text = Text()
    for node in snapshot.nodes:
        depth[node.index] = 0 if node.parent is None else depth[node.parent] + 1
        mark, style = _LOOKS.get(node.status, ("?", ""))
        text.append(f"{'  ' * depth[node.index]}{mark} {node.name}", style)
        if feedback and node.feedback:
            text.append(f"  {node.feedback}", "dim")
        text.append("\n")
    return text


def _kind(node: Behaviour) -> str:
    if isinstance(node, SkillAction):
        return "Action"
    if isinstance(node, (ResourceIs, DataCompare)):
        return "Condition"
    if isinstance(node, Decorator):
        return "Decorator"
    return type(node).__name__ if isinstance(node, Composite) else "Behaviour"
