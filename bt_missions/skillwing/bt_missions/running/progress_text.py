"""Text of a mission's status: what its tree does now."""

from __future__ import annotations

from collections.abc import Iterator

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.subtrees.lease import WithLease


def progress_text(tree: Behaviour) -> str:
    """Names of the running skill leaves, in the order of ticking, with one text for a wait for a lease.

    The leaf of the lease begins and ends each second meanwhile, which is nothing to tell.
    """
    return ", ".join(_running(tree)) or "deciding"


def _running(node: Behaviour) -> Iterator[str]:
    if isinstance(node, WithLease) and node.waits:
        yield node.feedback_message
    elif isinstance(node, SkillAction):
        if node.status is Status.RUNNING:
            yield node.name
    else:
        for child in node.children:
            yield from _running(child)
