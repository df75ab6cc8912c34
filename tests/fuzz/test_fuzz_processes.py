"""Bad input to real processes over Zenoh. `make fuzz` does the same for longer and with all of them."""

from __future__ import annotations

from pathlib import Path

import pytest
from fuzz_processes import Thrower, fuzz, managers_and_guidance

pytestmark = pytest.mark.slow
ROOM = 80.0
"""MB by which a process may grow: for its memory of messages, and for those that wait on a busy machine."""


def test_processes_live_on_and_answer(tmp_path: Path) -> None:
    def act(thrower: Thrower) -> None:
        thrower.throw(400)
        thrower.throw_huge()
        thrower.flood(150)

    outcome = fuzz(managers_and_guidance(), tmp_path, act, seed=1)
    assert not outcome.died, "these processes exited; their logs in the run directory have the payload"
    assert not outcome.deaf, "these processes do not answer any more"
    assert not outcome.silent, "these keys were not answered: refuse with a typed error"
    assert not outcome.internal, "these keys answered INTERNAL: refuse with a typed error"
    assert outcome.refused > 100
    assert outcome.growth < ROOM, outcome.memory
