"""Processes that offer and use topics."""

from __future__ import annotations

from enum import StrEnum

from skillwing.services.wire.channel import Role


class LayerProcess(StrEnum):
    """Processes of the functional layer by their names. `sim` stands for a vehicle."""

    VEHICLE = "sim"
    GUIDANCE = "guidance"
    BRIDGE = "bridge"
    OBSTACLES = "obstacles"
    MAPPING = "mapping"
    VIDEO = "video"
    LINK = "link"
    GROUND = "ground"


VEHICLE, GUIDANCE, BRIDGE = LayerProcess.VEHICLE, LayerProcess.GUIDANCE, LayerProcess.BRIDGE
OBSTACLES, MAPPING = LayerProcess.OBSTACLES, LayerProcess.MAPPING
VIDEO, LINK, GROUND = LayerProcess.VIDEO, LayerProcess.LINK, LayerProcess.GROUND
SKILLS, RECORDER, OPERATOR = Role.SKILL_MANAGER, Role.RECORDER, Role.OPERATOR
