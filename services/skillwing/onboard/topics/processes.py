"""Names of the processes that offer and use topics."""

from __future__ import annotations

VEHICLE, GUIDANCE, BRIDGE = "sim", "guidance", "bridge"
OBSTACLES, MAPPING = "obstacles", "mapping"
VIDEO, LINK, GROUND = "video", "link", "ground"
SKILLS, RECORDER, CAMPAIGNS = "skill managers", "recorder", "campaigns"
"""The managers of all skills have one name; `sim` stands for a vehicle."""
