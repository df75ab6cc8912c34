"""Advice on a skill that may not start: after a refused start, and as `skillwing ready` gives it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import pytest

from skillwing.dsl import parse
from skillwing.dsl.expressions import Environment
from skillwing.dsl.model import Skillset
from skillwing.services.core.ready_report import Situation, skill_ready
from skillwing.services.mocking.script import Reaction, When
from skillwing.services.protocol import Holder
from skillwing.services.terminal.start_advice import ready_advice, start_advice
from skillwing.services.terminal.system_state import Reporter, RunningMission, SystemState

BY_HAND = Holder(skill="wait", goal_id="g1", owner="cli")


def advice(
    skillset: Skillset,
    skill: str,
    failing: Sequence[str],
    now: SystemState,
    holder: Holder | None = None,
    data: Mapping[str, object] | None = None,
) -> list[str]:
    """Advice after a refused start, from the answer of the resource manager in that situation."""
    known = Environment(resources=now.states, data=data or {})
    ready = skill_ready(Situation(skillset, known, (holder,) if holder else ()), skillset.skill(skill), {})
    found = list(start_advice(skillset, ready, failing, now))
    assert [each for each in found if "holds by now" not in each] == list(ready_advice(skillset, ready, now))
    return found


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
STATES = {"stop": "RELEASED", "lamp": "ON", "wheels": "PARKED"}
ONLY_IT = "only the robot can report that"


def of_rover(skill: str, failing: Sequence[str], changed: Mapping[str, str], reporter: Reporter = "robot") -> list[str]:
    now = SystemState("rover", reporter, {**STATES, **changed}, running={})
    return advice(ROVER, skill, failing, now, data={} if "charged" in failing else {"battery": 50.0})


@pytest.mark.parametrize(
    ("skill", "failing", "changed", "sentences"),
    [
        (
            *("drive", ["released", "lit"], {"stop": "PRESSED", "lamp": "OFF"}),
            [
                f"released: `stop` has to become RELEASED; {ONLY_IT}.",
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
            ["effect take: `wheels` has to become PARKED or DRIVING; so it does by effects of `drive` and `lock`."],
        ),
        (
            *("lock", ["parked"], {"wheels": "LOCKED"}),
            ["parked: `wheels` has to become PARKED; so it does by effects of `drive` and `lock`."],
        ),
        ("lock", ["parked"], {}, ["parked: holds by now. Start it again."]),
        ("lock", ["effect take"], {}, ["effect take: holds by now. Start it again."]),
    ],
)
def test_the_advice_names_who_can_change_it(
    skill: str, failing: list[str], changed: dict[str, str], sentences: list[str]
) -> None:
    assert of_rover(skill, failing, changed) == sentences


@pytest.mark.parametrize(
    ("reporter", "way"),
    [
        ("robot", ONLY_IT),
        ("mock", "here `skillwing trigger lamp ON` does that"),
        (
            "nobody",
            "no bridge is there to report that (docs/robots.md), `skillwing trigger lamp ON` does in its place",
        ),
    ],
)
def test_by_hand_is_advised_only_where_no_robot_would_contradict(reporter: Reporter, way: str) -> None:
    assert of_rover("drive", ["lit"], {"lamp": "OFF"}, reporter) == [f"lit: `lamp` has to become ON; {way}."]


CRANE = parse(
    """
skillset crane {
    resource arm { initial FREE  FREE -> TAKEN  TAKEN -> FREE }
    resource hook { initial OFF  extern OFF -> ON  extern ON -> OFF }
    event hooked { effect { hook -> ON } }
    skill lift {
        effect { take: arm -> TAKEN  release: arm -> FREE }
        precondition { free: resource=(arm == FREE) success take }
        result { success DONE: apply=release }
    }
    skill turn {
        precondition { all: resource=(arm == FREE and hook == ON) }
        result { success DONE }
    }
}
"""
)
LIFTS = Holder(skill="lift", goal_id="g1", owner="shift")
LIFTING = SystemState("crane", "mock", {"arm": "TAKEN", "hook": "OFF"}, running={"lift": None})


def test_a_held_resource_hides_no_advice_on_the_others_of_its_precondition() -> None:
    assert advice(CRANE, "turn", ["all"], LIFTING, LIFTS) == [
        "all: `lift` holds `arm` for goal g1 of shift; `skillwing interrupt lift` ends it.",
        "all: `hook` has to become ON; the event `hooked` does that; here `skillwing trigger hook ON` does that.",
    ]


def test_a_goal_of_the_same_skill_is_named_once() -> None:
    assert advice(CRANE, "lift", [], LIFTING, LIFTS) == [
        "`lift` runs for goal g1 of shift; `skillwing interrupt lift` ends it."
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


def in_balloon(skill: str, failing: str, states: str, holder: Holder | None = None, **known: Any) -> list[str]:
    """Advice on one failing precondition."""
    place, burner = states.split()
    now = SystemState(
        "balloon", **{"reporter": "robot", "running": {}} | known, states={"place": place, "burner": burner}
    )
    found = advice(BALLOON, skill, [failing], now, holder)
    return [each for each in found if each.startswith(f"{failing}:")]


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


TRACTOR = parse(
    """
skillset tractor {
    resource engine { initial OFF  extern OFF -> ON  extern ON -> OFF }
    skill drive {
        precondition { on: resource=(engine == ON) }
        result { success DONE: post resource=(engine == ON) }
    }
    skill warm_up { result { success WARM: post resource=(engine == ON) } }
}
"""
)


@pytest.mark.parametrize(
    ("reporter", "way"),
    [
        ("robot", "the robot reports that after `skillwing start warm_up`"),
        ("mock", "here `skillwing trigger engine ON` does that"),
    ],
)
def test_no_skill_is_the_way_to_its_own_start_and_no_promise_moves_a_mocked_world(reporter: Reporter, way: str) -> None:
    now = SystemState("tractor", reporter, {"engine": "OFF"}, running={})
    assert advice(TRACTOR, "drive", ["on"], now) == [f"on: `engine` has to become ON; {way}."]


def test_in_a_mocked_world_both_are_named() -> None:
    assert in_balloon("sink", "up", "DOWN FREE", reporter="mock", reactions=(RISES,)) == [
        "up: `place` has to become UP; the mocked world does that after `skillwing start rise`, "
        "or `skillwing trigger place UP`."
    ]


def test_the_holder_of_a_resource_is_named_with_a_remedy() -> None:
    assert in_balloon("sink", "free", "UP USED", BY_HAND, running={"wait": None}) == [
        "free: `wait` holds `burner` for goal g1 of cli; `skillwing interrupt wait` ends it."
    ]
    assert in_balloon("sink", "free", "UP USED") == [
        "free: `burner` has to become FREE; so it does by effects of `rise`, `sink` and `wait`."
    ]


@pytest.mark.parametrize(("rescue", "then"), [("", "."), ("landing", ", and landing follows.")])
def test_the_rescue_of_a_mission_is_named_if_it_has_one(rescue: str, then: str) -> None:
    running = {"wait": RunningMission("patrol", rescue)}
    assert in_balloon("sink", "free", "UP USED", BY_HAND, running=running) == [
        f"free: `wait` holds `burner` for mission `patrol`; `skillwing mission abort` calls it off{then}"
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
