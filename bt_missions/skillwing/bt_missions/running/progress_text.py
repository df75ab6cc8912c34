"""Text of a mission's status: what its tree does now."""

from __future__ import annotations

from collections.abc import Iterator

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.subtrees.lease import WithLease


def progress_text(tree: Behaviour) -> str:
    """Names of the running skill leaves, in the order of ticking, with one text for a wait for a lease.

    The leaf of the lease begins and ends each second meanwhile, which is nothing to tell. In a mission on several
    robots, each name and text has its robot in front.
    """
    return ", ".join(_running(tree)) or "deciding"


def _running(node: Behaviour) -> Iterator[str]:
    if isinstance(node, WithLease) and node.waits:
        yield _of_robot(node.robot, node.feedback_message)
    elif isinstance(node, SkillAction):
        if node.status is Status.RUNNING:
            yield _of_robot(node.robot, node.name)
    else:
        for child in node.children:
            yield from _running(child)


def _of_robot(robot: str, text: str) -> str:
    """The text with its robot in front, once: a leaf without a name of its own has it there already."""
    front = f"{robot}: "
    return f"{front}{text}" if robot and not text.startswith(front) else text
