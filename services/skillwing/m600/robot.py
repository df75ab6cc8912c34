"""The table of the M600: its skillset, its functional layer, and who manages which skill."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from skillwing.services.robot import ProcessSpec, Robot

SKILLSET = Path(__file__).with_name("m600.skillset")
SIMULATION = "skillwing.sim_mujoco"


def functional_layer(options: dict[str, Any]) -> tuple[ProcessSpec, ...]:
    """The simulated drone, with the bridge that makes it known to the skillset.

    options: `seed` of the world, `speed` (robot seconds per wall second, 0 for as fast as possible), `faults` as the
    simulator schedules them (`[{"sensor": "zed", "kind": "blackout", "at": 60.0}]`). Absent ones keep their defaults.
    """
    names = {"seed": "seed", "speed": "factor", "faults": "faults"}
    sim = {names[option]: value for option, value in options.items() if option in names and value is not None}
    return (
        ProcessSpec("sim", f"{SIMULATION}.app:make_sim", sim, extra="sim"),
        ProcessSpec("guidance", f"{SIMULATION}.app:make_guidance", extra="sim"),
        ProcessSpec("obstacles", f"{SIMULATION}.obstacles_node:make_obstacles", extra="sim"),
        ProcessSpec("mapping", f"{SIMULATION}.mapping_node:make_mapping", extra="sim"),
        ProcessSpec("bridge", "skillwing.m600.bridge:make_bridge", {"skillset": str(SKILLSET)}),
    )


ROBOT = Robot(
    name="m600",
    skillset=SKILLSET,
    functional_layer=functional_layer,
    hooks={
        "takeoff": "skillwing.m600.takeoff:TakeoffManager",
        "land": "skillwing.m600.land:LandManager",
        "hover": "skillwing.m600.hover:HoverManager",
        "goto": "skillwing.m600.goto:GotoManager",
        "goto_straight": "skillwing.m600.goto_straight:GotoStraightManager",
        "return_home": "skillwing.m600.return_home:ReturnHomeManager",
        "rotate_head": "skillwing.m600.rotate_head:RotateHeadManager",
        "lock_head": "skillwing.m600.lock_head:LockHeadManager",
        "zed_depthmap": "skillwing.m600.zed_depthmap:ZedDepthmapManager",
        "lidar_depthmap": "skillwing.m600.lidar_depthmap:LidarDepthmapManager",
        "lidar_mapping": "skillwing.m600.lidar_mapping:LidarMappingManager",
    },
)
