"""`skillwing fault` and `skillwing pilot` where there is no drone."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any

import pytest

from skillwing.m600 import commands
from skillwing.services.errors import SkillwingError, UnansweredError


class Sprayer:
    """A connection to a robot that has no simulator."""

    target = SimpleNamespace(robot="sprayer")

    def ask(self, key: str, message: object, reply: object) -> None:
        raise UnansweredError(key)


@pytest.mark.parametrize("command", ["fault", "pilot"])
def test_another_robot_is_told_from_the_drone(command: str, monkeypatch: pytest.MonkeyPatch) -> None:
    @contextmanager
    def connect(robot: str | None) -> Iterator[Any]:
        yield Sprayer()

    monkeypatch.setattr(commands, "connect", connect)
    call = {"fault": lambda: commands.fault("zed"), "pilot": lambda: commands.pilot(commands.Handover.TAKE)}[command]
    with pytest.raises(SkillwingError, match=f"`{command}` is for the simulated drone, and none answers in `sprayer`"):
        call()
