"""Names of processes, of their alive tokens and of their files."""

from __future__ import annotations

RESOURCE_MANAGER = "resource_manager"
DATA_MANAGER = "data_manager"
MOCKED_WORLD = "mocked_world"
LAUNCHER = "launcher"
"""Name of the process that starts and supervises the others, and the source of its records."""
WEB_VIEWER = "viewer"
"""Name of the process that shows a run in browsers, in containers."""
MISSION = "mission"
"""Name of a mission's process, its alive token, and its client."""
CLIENT = "client/"
"""Begin of the names of clients that own goals."""

SEPARATOR = "~"
"""Character after the name of a certificate in the names of its holder's sessions and tokens. No name contains it."""
KILLED, EXITED = "KILLED", "EXITED"
"""States in the timeline of a process that a signal has killed, or that has ended by itself."""
STARTED = "STARTED"
"""The same of a mission that somebody starts on board."""
BLOCKED = "BLOCKED"
"""State in the timeline of a manager that one of its hooks blocks."""
JOURNAL_FILE = "journal.sqlite"
"""The resource manager's journal, in the directory of its run."""
STEPS_FOLDER = "steps"
"""Folder of the resource manager's recorded steps, in the directory of its run."""


def skill_process(skill: str) -> str:
    """`skill/drive` for `drive`."""
    return f"skill/{skill}"
