"""What is told to whose start was refused, because the robot is not ready."""

from __future__ import annotations

import pytest

from skillwing.dsl import parse
from skillwing.services.commands.readiness import ways_out

ROVER = parse(
    """
skillset rover {
    data { battery: float64 [%] period=1.0 }
    resource stop { initial RELEASED  extern RELEASED -> PRESSED  extern PRESSED -> RELEASED }
    resource lamp { state { OFF ON BROKEN }  initial OFF  extern OFF -> ON  extern ON -> OFF  extern ON -> BROKEN }
    resource wheels { initial PARKED  PARKED -> DRIVING  DRIVING -> PARKED  PARKED -> LOCKED  LOCKED -> PARKED }
    skill drive {
        input { speed: float64 [m/s] = 0.5 }
        effect { take: wheels -> DRIVING  release: wheels -> PARKED }
        precondition {
            released: resource=(stop == RELEASED)
            lit:      resource=(stop == RELEASED and lamp == ON)
            charged:  data=(battery > 10.0 and speed < 1.0)
            success take
        }
        result { DONE: apply=release }
    }
    skill lock {
        effect { take: wheels -> LOCKED  release: wheels -> PARKED }
        precondition { parked: resource=(wheels == PARKED) success take }
        result { DONE: apply=release }
    }
}
"""
)
STATES = {"stop": "RELEASED", "lamp": "OFF", "wheels": "PARKED"}
BY_HAND = "the robot reports that, or `skillwing trigger"


@pytest.mark.parametrize(
    ("skill", "failing", "changed", "sentences"),
    [
        (
            *("drive", ["released"], {"stop": "PRESSED"}),
            [f"released: `stop` has to become RELEASED; {BY_HAND} stop RELEASED` does in its place."],
        ),
        (
            *("drive", ["lit"], {"stop": "PRESSED"}),
            [
                f"lit: `lamp` has to become ON; {BY_HAND} lamp ON` does in its place.",
                f"lit: `stop` has to become RELEASED; {BY_HAND} stop RELEASED` does in its place.",
            ],
        ),
        (
            "drive",
            ["lit"],
            {"lamp": "BROKEN"},
            ["lit: `lamp` has to become ON; nothing leads there from BROKEN at once."],
        ),
        (
            *("drive", ["charged"], {}),
            [
                "charged: `battery` is for the robot to tell; see it with `skillwing data battery`.",
                "charged: `speed` is an input of the start; give another one.",
            ],
        ),
        (
            *("drive", ["effect take"], {"wheels": "LOCKED"}),
            ["effect take: `wheels` has to become PARKED; so it does by effects of `drive` and `lock`."],
        ),
        (
            *("lock", ["parked"], {"wheels": "DRIVING"}),
            ["parked: `wheels` has to become PARKED; so it does by effects of `drive` and `lock`."],
        ),
        ("lock", ["parked"], {}, ["parked: holds by now. Start it again."]),
    ],
)
def test_who_can_change_it_is_told(
    skill: str, failing: list[str], changed: dict[str, str], sentences: list[str]
) -> None:
    assert list(ways_out(ROVER, ROVER.skill(skill), failing, STATES | changed)) == sentences
