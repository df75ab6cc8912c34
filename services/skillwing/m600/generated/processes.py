# Generated from m600.skillset by `skillwing generate`. Do not edit: change the skillset instead.
"""The managers of `m600`: their skillset, and the manager class of each skill.

`robot.py` puts them into the robot's table. It lists the skills with a file in `skills/`.
"""

from __future__ import annotations

from pathlib import Path

PACKAGE = __name__.removesuffix(".generated.processes")
TABLE = f"{PACKAGE}.robot:ROBOT"
SKILLSET = Path(__file__).parents[1] / "m600.skillset"
HOOKS = {
    "takeoff": f"{PACKAGE}.skills.takeoff:TakeoffManager",
    "land": f"{PACKAGE}.skills.land:LandManager",
    "hover": f"{PACKAGE}.skills.hover:HoverManager",
    "goto": f"{PACKAGE}.skills.goto:GotoManager",
    "goto_straight": f"{PACKAGE}.skills.goto_straight:GotoStraightManager",
    "return_home": f"{PACKAGE}.skills.return_home:ReturnHomeManager",
    "rotate_head": f"{PACKAGE}.skills.rotate_head:RotateHeadManager",
    "lock_head": f"{PACKAGE}.skills.lock_head:LockHeadManager",
    "zed_depthmap": f"{PACKAGE}.skills.zed_depthmap:ZedDepthmapManager",
    "lidar_depthmap": f"{PACKAGE}.skills.lidar_depthmap:LidarDepthmapManager",
    "lidar_mapping": f"{PACKAGE}.skills.lidar_mapping:LidarMappingManager",
    "inspect": f"{PACKAGE}.skills.inspect:InspectManager",
    "stream": f"{PACKAGE}.skills.stream:StreamManager",
}
