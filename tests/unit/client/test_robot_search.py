"""Search for the robots of a mission: who answers and cannot be used is named with the reason."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from lift_robot import SOURCE

from skillwing.services.bus import Request
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.client.robot_search import TIMEOUT, FoundRobot, RobotSearch, SearchBus
from skillwing.services.names import RESOURCE_MANAGER
from skillwing.services.protocol import ErrorCode, ErrorReply, Keys, RobotDescription, encode

KEYS = Keys("lift")
GOOD = encode(RobotDescription(source=SOURCE, schema="0", clock="wall"))
NEWER = ErrorReply(code=ErrorCode.BAD_REQUEST, message="The sender uses protocol 2, this process protocol 3.")


def found_with(*answers: Callable[[Request], None]) -> tuple[dict[str, FoundRobot], dict[str, str]]:
    """Robots `r1`, `r2`, ..., each of which answers so; what is found of them, and what they object."""
    network, names, ends = InProcessNetwork(), list[str](), list[dict[str, FoundRobot]]()
    for number, answer in enumerate(answers, start=1):
        names.append(f"r{number}")
        bus = network.bus(RESOURCE_MANAGER, names[-1])
        bus.serve(KEYS.resource_robot, answer)
        bus.declare_alive(KEYS.alive(RESOURCE_MANAGER))
    own = network.bus("mission")
    assert isinstance(own, SearchBus)
    search = RobotSearch(own, names, ends.append)
    network.run_for(TIMEOUT + 1.0)
    (found,) = ends
    return found, search.objections


def test_robots_that_describe_themselves_are_found() -> None:
    found, objections = found_with(lambda request: request.reply(GOOD), lambda request: request.reply(GOOD))
    assert (sorted(found), objections) == (["r1", "r2"], {})
    assert found["r1"].skillset.name == "lift"


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (lambda request: request.refuse(NEWER), "this process protocol 3"),
        (lambda request: request.reply(b"\xc1"), "Its description is not understood: "),
        (
            lambda request: request.reply(encode(RobotDescription(source="skillset {", schema="0", clock="wall"))),
            "Its description is not understood: ",
        ),
    ],
    ids=["refused", "another protocol", "another language"],
)
def test_a_robot_that_answers_otherwise_is_named_with_the_reason(answer: Callable[[Request], None], words: str) -> None:
    found, objections = found_with(lambda request: request.reply(GOOD), answer)
    assert sorted(found) == ["r1"]
    assert words in objections["r2"]
