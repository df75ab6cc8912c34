"""First effects of a fault: the records that the causes of later failures lead to. Pure."""

from __future__ import annotations

from skill_needs import told
from skillwing.dsl.model import Skillset
from skillwing.services.names import KILLED, MISSION, MOCKED_WORLD, RESOURCE_MANAGER, skill_process
from skillwing.services.processes.launcher import ROUTER
from skillwing.services.protocol import Ending, State

ON_THE_WAY_OF_DATA = frozenset({"sim", "bridge", MOCKED_WORLD, ROUTER, RESOURCE_MANAGER})
"""Processes without which data stay away, or are read late: their sources, their publishers, and their way."""
INTERRUPTS = frozenset({MISSION, RESOURCE_MANAGER})
"""Processes whose silence interrupts goals: an owner, and the judge of their invariants. The exit of an owner that was
killed is the cause of that."""
FIRST_SEEN = {
    "guidance": ("guidance ABORTED",),
    "obstacles": ("zed_depthmap S_NO_DATA", "lidar_depthmap S_NO_DATA"),
    "mapping": ("map DIVERGED",),
}
"""Other effects on the m600. After the fault of another process they are none of its effects: a stop of the obstacle
node that made the map diverge was a router that stood still."""


def first_effects(process: str, skillset: Skillset, *, killed: bool) -> frozenset[str]:
    """Headlines of the records that failures after the fault of a process may begin with. killed: it was not stopped.

    The launcher records the exit of a killed process. The manager of a skill loses its goals: without that exit as the
    cause if it was stopped, or if the client alone knew them. A router that stands still ends leases, and so loses
    goals. A process of the functional layer fails the skills that command it. Goals are interrupted whose mission was
    stopped, or whose invariants nobody watches. And data may be late.
    """
    names = [skill.name for skill in skillset.skills]
    stale = [f"{datum.name} STALE" for datum in skillset.data if process in ON_THE_WAY_OF_DATA]
    leases_end = process == ROUTER and not killed
    lost = [f"{name} {Ending.LOST}" for name in names if leases_end or process == skill_process(name)]
    exits = [f"{process} {KILLED}"]
    exit_is_cause = killed and process == MISSION
    stops = (State.INTERRUPTING, Ending.INTERRUPTED) if process in INTERRUPTS and not exit_is_cause else ()
    stopped = [f"{name} {state}" for name in names for state in stops]
    failed = [f"{name} {Ending.ERROR}" for name, (asked, _) in told().items() if f"fl/{process}/command" in asked]
    return frozenset([*exits, *stale, *lost, *stopped, *failed, *FIRST_SEEN.get(process, ())])
