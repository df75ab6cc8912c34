"""Names of the manager processes, by which their alive tokens are known."""

from __future__ import annotations

RESOURCE_MANAGER = "resource_manager"
DATA_MANAGER = "data_manager"


def skill_process(skill: str) -> str:
    """`skill/takeoff` for `takeoff`."""
    return f"skill/{skill}"
