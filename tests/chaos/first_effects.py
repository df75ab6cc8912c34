"""First effects of a fault: the records that the causes of later failures lead to. Pure."""

from __future__ import annotations

from skillwing.dsl.model import Skillset
from skillwing.services.names import skill_process
from skillwing.services.protocol import Ending

NEEDED_BY = {
    "guidance": ("takeoff", "land", "hover", "goto", "goto_straight", "return_home", "rotate_head", "lock_head"),
    "obstacles": ("zed_depthmap", "lidar_depthmap"),
    "mapping": ("lidar_mapping",),
}
"""Skills of the m600 that cannot do without a process."""
LATE = ("guidance ABORTED", "map DIVERGED", "zed_depthmap S_NO_DATA", "lidar_depthmap S_NO_DATA")
"""Effects on the m600 of messages that come late, whichever process has stopped."""


def first_effects(process: str, skillset: Skillset) -> frozenset[str]:
    """Headlines of the records that failures after the fault of a process may begin with.

    A killed process leaves no record itself. The manager of a skill loses its goals; a process of the functional layer
    fails the skills that need it; goals whose mission is gone are interrupted. And messages may be late.
    """
    late = {*LATE, *(f"{datum.name} STALE" for datum in skillset.data)}
    lost = {f"{skill.name} {Ending.LOST}" for skill in skillset.skills if process == skill_process(skill.name)}
    orphaned = {f"{skill.name} {Ending.INTERRUPTED}" for skill in skillset.skills if process == "mission"}
    failed = {f"{skill} {Ending.ERROR}" for skill in NEEDED_BY.get(process, ())}
    return frozenset(late | lost | orphaned | failed)
