"""Counter of the edges of the goal table that a process takes.

As a pytest plugin (`-p edge_counter`) it writes its counts into the file that `GOAL_EDGES` names.
"""

from __future__ import annotations

import os
from collections import Counter
from pathlib import Path

import msgspec
import pytest
from goal_table import STATES, Edge, edge_of

from skillwing.dsl.model import Skill
from skillwing.services.core.goal_states import GoalState, Reaction
from skillwing.services.core.skill_events import GoalEvent

FILE = "GOAL_EDGES"
COUNTS: Counter[Edge] = Counter()


def install() -> None:
    """Count the reactions of every state from now on."""
    for kind in STATES:
        _count(kind)


def _count(kind: type[GoalState]) -> None:
    right = kind.on

    def on(self: GoalState, event: GoalEvent, skill: Skill, now: float) -> Reaction | None:
        reaction = right(self, event, skill, now)
        if reaction is not None and type(self) is kind:
            COUNTS[edge_of(self, event, reaction)] += 1
        return reaction

    kind.on = on


def save(file: Path) -> None:
    """Write the counts into a file."""
    file.write_bytes(msgspec.json.encode([(*edge, count) for edge, count in COUNTS.items()]))


def load(file: Path) -> Counter[Edge]:
    """The counts in a file that `save` has written."""
    return Counter({Edge(*edge): count for *edge, count in msgspec.json.decode(file.read_bytes())})


def pytest_configure(config: pytest.Config) -> None:
    del config
    install()


def pytest_sessionfinish(session: pytest.Session) -> None:
    del session
    save(Path(os.environ[FILE]))
