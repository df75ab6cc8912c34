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
FIRST_SEEN = {
    "guidance": ("guidance ABORTED",),
    "obstacles": ("zed_depthmap S_NO_DATA", "lidar_depthmap S_NO_DATA"),
    "mapping": ("map DIVERGED",),
}
"""Other effects on the m600. After the fault of another process they are none of its effects: a stop of the obstacle
node that made the map diverge was a router that stood still."""


def first_effects(process: str, skillset: Skillset) -> frozenset[str]:
    """Headlines of the records that failures after the fault of a process may begin with.

    A killed process leaves no record itself. The manager of a skill loses its goals; a process of the functional layer
    fails the skills that need it; goals whose mission is gone are interrupted. And data may be late.
    """
    stale = {f"{datum.name} STALE" for datum in skillset.data}
    lost = {f"{skill.name} {Ending.LOST}" for skill in skillset.skills if process == skill_process(skill.name)}
    orphaned = {f"{skill.name} {Ending.INTERRUPTED}" for skill in skillset.skills if process == "mission"}
    failed = {f"{skill} {Ending.ERROR}" for skill in NEEDED_BY.get(process, ())}
    return frozenset(stale | lost | orphaned | failed | {*FIRST_SEEN.get(process, ())})
