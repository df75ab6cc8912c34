"""Names of the manager processes and of what a mock has instead of a robot, by which their alive tokens are known."""

from __future__ import annotations

RESOURCE_MANAGER = "resource_manager"
DATA_MANAGER = "data_manager"
MOCKED_WORLD = "mocked_world"
MISSION = "mission"
"""Process whose alive token tells that a mission is there, and the client that asks for its goals."""
CLIENT = "client/"
"""What the names of clients that own goals begin with."""

BLOCKED = "BLOCKED"
"""What the timeline says of a manager that one of its hooks has kept from everything else."""
JOURNAL_FILE = "journal.sqlite"
"""The resource manager's journal, in the directory of its run."""
STEPS_FOLDER = "steps"
"""All that the resource manager was asked and has answered, in the directory of its run."""


def skill_process(skill: str) -> str:
    """`skill/takeoff` for `takeoff`."""
    return f"skill/{skill}"
