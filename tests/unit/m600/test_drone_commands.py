"""`skillwing fault` and `skillwing pilot` where there is no drone."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any

import pytest

from skillwing.dsl.model import UnknownNameError
from skillwing.m600 import operator_commands as commands
from skillwing.onboard.topics.common import Done
from skillwing.onboard.topics.faults import FAULT, FAULTS, LINK_FAULT, Faults, FaultState, SetFault, SetLinkFault
from skillwing.services.errors import InvalidOptionError, NoReplyError, RefusedError, SkillwingError
from skillwing.services.protocol import ErrorCode, Message

SENSOR_KINDS = ("blackout", "freeze", "noise")
OTHERS = (
    FaultState(name="camera", kinds=SENSOR_KINDS),
    *(FaultState(name=f"rotor/{number}", kinds=("stopped", "weak")) for number in range(1, 7)),
)


class Sprayer:
    """A connection to a robot that has no simulator."""

    target = SimpleNamespace(robot="sprayer")

    def ask(self, key: str, message: object, reply: object) -> None:
        raise NoReplyError(key)


@pytest.mark.parametrize("command", ["fault", "pilot"])
def test_another_robot_is_distinguished_from_the_drone(command: str, monkeypatch: pytest.MonkeyPatch) -> None:
    @contextmanager
    def connect(robot: str | None) -> Iterator[Any]:
        yield Sprayer()

    monkeypatch.setattr(commands, "connect", connect)
    call = {"fault": lambda: commands.fault("zed"), "pilot": lambda: commands.pilot(commands.Handover.TAKE)}[command]
    with pytest.raises(SkillwingError, match=f"`{command}` is for the simulated drone, and none answers in `sprayer`"):
        call()


class Recorded:
    """A connection to a drone that does as it is told, or refuses. active: of its depth camera, which faults are on."""

    target = SimpleNamespace(robot="m600")

    def __init__(self) -> None:
        self.asked: list[tuple[str, Message]] = []
        self.active: tuple[str, ...] = ()
        self.refusal: RefusedError | None = None

    def ask(self, key: str, message: Message, reply: object) -> Message:
        if key == FAULTS:
            return Faults(of=(FaultState(name="zed", kinds=SENSOR_KINDS, active=self.active), *OTHERS))
        self.asked.append((key, message))
        if self.refusal is not None:
            raise self.refusal
        assert isinstance(message, SetFault | SetLinkFault)
        return Done(text=f"{message.kind} is {'on' if message.on else 'off'}")


@pytest.fixture
def drone(monkeypatch: pytest.MonkeyPatch) -> Recorded:
    drone = Recorded()

    @contextmanager
    def connect(robot: str | None) -> Iterator[Any]:
        yield drone

    monkeypatch.setattr(commands, "connect", connect)
    monkeypatch.setattr(commands, "_link_faults", lambda system: [])
    return drone


@pytest.mark.parametrize(
    ("arguments", "key", "message"),
    [
        ({"sensor": "link"}, LINK_FAULT, SetLinkFault(kind="cut")),
        (
            {"sensor": "link", "kind": "narrow", "magnitude": 0.1},
            LINK_FAULT,
            SetLinkFault(kind="narrow", magnitude=0.1),
        ),
        ({"sensor": "link", "kind": "cut", "off": True}, LINK_FAULT, SetLinkFault(kind="cut", on=False)),
        ({"sensor": "camera"}, FAULT, SetFault(sensor="camera", kind="blackout")),
        ({"sensor": "rotor/2"}, FAULT, SetFault(sensor="rotor/2", kind="stopped")),
    ],
)
def test_a_fault_goes_to_the_process_that_simulates_it(
    arguments: dict[str, Any], key: str, message: Message, drone: Recorded
) -> None:
    commands.fault(**arguments)
    assert drone.asked == [(key, message)]


@pytest.mark.parametrize(
    ("active", "kind", "ended", "told"),
    [
        (("noise", "freeze"), None, ["noise", "freeze"], "Noise is off. Freeze is off."),
        (("noise", "freeze"), "noise", ["noise"], "Noise is off."),
        (("noise",), "blackout", [], "Blackout of zed was not on."),
        ((), None, [], "No fault of zed was on."),
    ],
)
def test_off_ends_what_is_on_and_says_what_that_was(
    active: tuple[str, ...],
    kind: str | None,
    ended: list[str],
    told: str,
    drone: Recorded,
    capsys: pytest.CaptureFixture[str],
) -> None:
    drone.active = active
    commands.fault("zed", kind=kind, off=True)
    assert drone.asked == [(FAULT, SetFault(sensor="zed", kind=each, on=False)) for each in ended]
    assert capsys.readouterr().out == f"{told}\n"


def test_off_of_a_kind_that_there_is_not_is_answered_with_those_there_are(drone: Recorded) -> None:
    with pytest.raises(UnknownNameError, match=r"^There is no fault `nosie` of `zed`; did you mean `noise`\?"):
        commands.fault("zed", kind="nosie", off=True)
    assert not drone.asked


def test_a_link_that_is_not_heard_is_rid_of_every_fault(drone: Recorded) -> None:
    commands.fault("link", off=True)
    assert [message for _, message in drone.asked] == [
        SetLinkFault(kind=kind, on=False) for kind in commands.LINK_KINDS
    ]


def test_what_the_drone_cannot_have_is_a_mistake_of_who_asked(drone: Recorded) -> None:
    drone.refusal = RefusedError(ErrorCode.BAD_REQUEST, "the magnitude is too large", help="choose another magnitude")
    with pytest.raises(InvalidOptionError, match=r"^The magnitude is too large\. Choose another magnitude\.$"):
        commands.fault("zed", kind="noise", magnitude=3.0)


@pytest.mark.parametrize("name", ["zde", "rotor", "lnik"])
def test_a_wrong_name_is_answered_with_all_that_can_fail(name: str, drone: Recorded) -> None:
    with pytest.raises(UnknownNameError, match=r"did you mean `(zed|rotor/\d|link)`\? .*`zed`.*`rotor/6`.*`link`\.$"):
        commands.fault(name)
    assert not drone.asked


@pytest.mark.parametrize(
    ("arguments", "option"),
    [
        ({"sensor": "zed", "list_faults": True}, "list"),
        ({"list_faults": True, "off": True}, "list"),
        ({"sensor": "zed", "off": True, "magnitude": 1.0}, "magnitude"),
    ],
)
def test_options_that_contradict_are_refused(arguments: dict[str, Any], option: str, drone: Recorded) -> None:
    with pytest.raises(InvalidOptionError) as caught:
        commands.fault(**arguments)
    assert caught.value.option == option
    assert not drone.asked


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
