"""`skillwing fault` and `skillwing pilot` where there is no drone."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any

import pytest

from skillwing.m600 import commands
from skillwing.services.errors import InvalidOptionError, SkillwingError, UnansweredError
from skillwing.services.protocol import Message
from skillwing.sim_mujoco.topics import FAULT, LINK_FAULT, Done, SetFault, SetLinkFault


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


class Recorded:
    """A connection to a drone that does as it is told."""

    def __init__(self) -> None:
        self.asked: list[tuple[str, Message]] = []

    def ask(self, key: str, message: Message, reply: object) -> Done:
        self.asked.append((key, message))
        return Done(text="done")


@pytest.mark.parametrize(
    ("arguments", "key", "message"),
    [
        ({"sensor": "link"}, LINK_FAULT, SetLinkFault(kind="cut")),
        (
            {"sensor": "link", "kind": "narrow", "magnitude": 0.1},
            LINK_FAULT,
            SetLinkFault(kind="narrow", magnitude=0.1),
        ),
        ({"sensor": "link", "off": True}, LINK_FAULT, SetLinkFault(kind="cut", on=False)),
        ({"sensor": "camera"}, FAULT, SetFault(sensor="camera", kind="blackout")),
        ({"sensor": "rotor/2"}, FAULT, SetFault(sensor="rotor/2", kind="stopped")),
    ],
)
def test_a_fault_goes_to_whoever_can_have_it(
    arguments: dict[str, Any], key: str, message: Message, monkeypatch: pytest.MonkeyPatch
) -> None:
    drone = Recorded()

    @contextmanager
    def connect(robot: str | None) -> Iterator[Any]:
        yield drone

    monkeypatch.setattr(commands, "connect", connect)
    commands.fault(**arguments)
    assert drone.asked == [(key, message)]


@pytest.mark.parametrize(
    ("name", "magnitude", "bounds"),
    [
        ("gnss", 1e39, "-1,000,000 to 1,000,000"),
        ("zed", math.nan, "-1,000,000 to 1,000,000"),
        ("rotor/1", -math.inf, "-1,000,000 to 1,000,000"),
        ("link", -1.0, "0 to 10,000"),
        ("link", 2e4, "0 to 10,000"),
    ],
)
def test_a_magnitude_that_is_none_is_refused_before_anybody_is_asked(name: str, magnitude: float, bounds: str) -> None:
    with pytest.raises(InvalidOptionError, match=f"is a number from {bounds}, not"):
        commands.fault(name, magnitude=magnitude)
