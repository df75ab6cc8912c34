"""Advice for a start that was refused because the robot is not ready."""

from __future__ import annotations

from typing import Any

import pytest

from skillwing.dsl import parse
from skillwing.services.mocking.script import Reaction, When
from skillwing.services.terminal.start_advice import busy_advice, start_advice
from skillwing.services.terminal.system_state import Reporter, SystemState

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
ONLY_IT = "only the robot can report that"


def situation(reporter: Reporter = "robot", changed: dict[str, str] | None = None) -> SystemState:
    return SystemState("rover", reporter, STATES | (changed or {}), running={})


@pytest.mark.parametrize(
    ("skill", "failing", "changed", "sentences"),
    [
        (
            *("drive", ["released"], {"stop": "PRESSED"}),
            [f"released: `stop` has to become RELEASED; {ONLY_IT}."],
        ),
        (
            *("drive", ["lit"], {"stop": "PRESSED"}),
            [
                f"lit: `lamp` has to become ON; {ONLY_IT}.",
                f"lit: `stop` has to become RELEASED; {ONLY_IT}.",
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
                "charged: `battery` comes from the robot; see it with `skillwing data battery`.",
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
def test_the_advice_names_who_can_change_it(
    skill: str, failing: list[str], changed: dict[str, str], sentences: list[str]
) -> None:
    assert list(start_advice(ROVER, ROVER.skill(skill), failing, situation(changed=changed))) == sentences


@pytest.mark.parametrize(
    ("reporter", "way"),
    [
        ("robot", "only the robot can report that"),
        ("mock", "here `skillwing trigger stop RELEASED` does that"),
        (
            "nobody",
            "no bridge is there to report that (docs/robots.md), `skillwing trigger stop RELEASED` does in its place",
        ),
    ],
)
def test_by_hand_is_advised_only_where_no_robot_would_contradict(reporter: Reporter, way: str) -> None:
    now = situation(reporter, {"stop": "PRESSED"})
    assert list(start_advice(ROVER, ROVER.skill("drive"), ["released"], now)) == [
        f"released: `stop` has to become RELEASED; {way}."
    ]


BALLOON = parse(
    """
skillset balloon {
    data { wind: float64 [m/s] period=1.0 }
    resource place { state { DOWN UP }  initial DOWN  extern DOWN -> UP  extern UP -> DOWN }
    resource burner { initial FREE  FREE -> USED  USED -> FREE }
    skill rise {
        effect { take: burner -> USED  release: burner -> FREE }
        precondition { free: resource=(burner == FREE)  down: resource=(place == DOWN)  success take }
        result { success AT_HEIGHT: apply=release  failure COLD: apply=release }
    }
    skill sink {
        effect { take: burner -> USED  release: burner -> FREE }
        precondition { free: resource=(burner == FREE)  up: resource=(place == UP)  success take }
        result { success LANDED: apply=release post resource=(place == DOWN and burner == FREE) }
    }
    skill wait {
        effect { take: burner -> USED  release: burner -> FREE }
        precondition { calm: data=(wind < 3.0)  up: resource=(place == UP)  success take }
        result { success DONE: apply=release }
    }
}
"""
)
RISES = Reaction(when=When(starts="rise"), trigger={"place": "UP"})
TORN = Reaction(when=When(ends="wait", ending="RI"), trigger={"place": "DOWN"})
ROUNDS = Reaction(when=When(ends="wait", ending=("DONE", "RI")), trigger={"place": "DOWN"})


def in_balloon(skill: str, failing: str, states: str, **known: Any) -> list[str]:
    place, burner = states.split()
    now = SystemState(
        "balloon", **{"reporter": "robot", "running": {}} | known, states={"place": place, "burner": burner}
    )
    return list(start_advice(BALLOON, BALLOON.skill(skill), [failing], now))


@pytest.mark.parametrize("burner", ["FREE", "USED"])
def test_the_skill_that_promises_a_state_is_named(burner: str) -> None:
    told = "down: `place` has to become DOWN; the robot reports that after `skillwing start sink`."
    assert in_balloon("rise", "down", f"UP {burner}") == [told]


def test_the_skills_after_which_the_mock_reports_a_state_are_named() -> None:
    for skill in ("sink", "wait"):
        told = "up: `place` has to become UP; the robot reports that after `skillwing start rise`."
        assert in_balloon(skill, "up", "DOWN FREE", reactions=(RISES,)) == [told]
    assert in_balloon("sink", "up", "DOWN FREE") == ["up: `place` has to become UP; only the robot can report that."]
    both = "down: `place` has to become DOWN; the robot reports that after `skillwing start sink`{}."
    assert in_balloon("rise", "down", "UP FREE", reactions=(TORN,)) == [both.format("")]
    assert in_balloon("rise", "down", "UP FREE", reactions=(ROUNDS,)) == [both.format(" or `skillwing start wait`")]


def test_in_a_mocked_world_both_are_named() -> None:
    assert in_balloon("sink", "up", "DOWN FREE", reporter="mock", reactions=(RISES,)) == [
        "up: `place` has to become UP; the mocked world does that after `skillwing start rise`, "
        "or `skillwing trigger place UP`."
    ]


def test_the_holder_of_a_resource_is_named_with_a_remedy() -> None:
    assert in_balloon("sink", "free", "UP USED", running={"wait": None}) == [
        "free: `wait` holds `burner`; `skillwing interrupt wait` ends it."
    ]
    assert in_balloon("sink", "free", "UP USED", running={"wait": "patrol"}) == [
        "free: `wait` holds `burner` for mission `patrol`; `skillwing mission abort` calls it off and runs its rescue."
    ]
    assert in_balloon("sink", "free", "UP USED") == [
        "free: `burner` has to become FREE; so it does by effects of `rise`, `sink` and `wait`."
    ]


def test_a_datum_that_never_came_leads_on() -> None:
    assert in_balloon("wait", "calm", "UP FREE", unheard=["wind"], reporter="nobody") == [
        "calm: `wind` was never received: no bridge runs. Write one (docs/robots.md), or mock it: `skillwing down`, "
        "then `skillwing up --robot balloon --mock`."
    ]
    assert in_balloon("wait", "calm", "UP FREE", unheard=["wind"]) == [
        "calm: `wind` was never received; `skillwing doctor` checks the processes that should publish it."
    ]
    by = {"published_by": {"wind": ("rise", "sink")}}
    assert in_balloon("wait", "calm", "UP FREE", **by) == [
        "calm: `wind` comes only while one runs that publishes it: `rise` and `sink`."
    ]
    assert in_balloon("wait", "calm", "UP FREE", **by, running={"sink": None}) == [
        "calm: `wind` comes from the robot; see it with `skillwing data wind`."
    ]


def test_what_keeps_a_skill_busy_can_be_ended() -> None:
    assert busy_advice("wait", None) == "`wait` runs; `skillwing interrupt wait` ends it."
    assert busy_advice("wait", "patrol") == (
        "`wait` runs for mission `patrol`; `skillwing mission abort` calls it off and runs its rescue."
    )
