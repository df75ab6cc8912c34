"""A campaign's flight: the whole robot in one process, identical each time, judged by the ground truth."""

from __future__ import annotations

import pytest

from skillwing.evaluation.flights.conditions import Condition
from skillwing.evaluation.flights.observer import HELD_FOR, FlightObserver
from skillwing.evaluation.flights.plan import FlightPlan
from skillwing.evaluation.flights.result import End
from skillwing.evaluation.judged_flight import fly
from skillwing.m600.robot import ROBOT
from skillwing.onboard.frames.extent import TIP_RADIUS
from skillwing.onboard.topics.flight import FLIGHT, FlightState
from skillwing.onboard.topics.truth import TRUTH, Truth
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.protocol import Keys, MissionPhase, MissionStatus, encode
from skillwing.sim_mujoco.world.world import make_world

TERRAIN = make_world(1).terrain
TAKE_OFF = 4.0
"""Robot seconds: the drone is in the air, and all its sensors have spoken."""


@pytest.mark.slow
def test_the_same_plan_is_the_same_flight_bit_by_bit_and_another_seed_is_another() -> None:
    plans = [
        FlightPlan(mission="mapping", world="courtyard", seed=seed, condition=Condition.GUST) for seed in (1, 1, 2)
    ]
    first, again, other = (fly(plan, longest=TAKE_OFF) for plan in plans)
    assert first.end is End.FLYING
    assert (again.digest, again.clearance) == (first.digest, first.clearance)
    assert other.digest != first.digest


# --- the observer -----------------------------------------------------------------------------------------------------


class Scene:
    """A drone that the test moves, and the observer who sees it."""

    def __init__(self, *, pilot_returns: bool = False) -> None:
        self.network = InProcessNetwork()
        self.observer = FlightObserver(ROBOT.skillset.stem, TERRAIN, pilot_returns=pilot_returns)
        self.network.attach(self.observer)
        self.bus = self.network.bus("drone")
        self.truth, self.flight = self.bus.advertise(TRUTH), self.bus.advertise(FLIGHT)
        self.mission = self.bus.advertise(Keys(ROBOT.skillset.stem).mission_status, events=True)
        self.network.run_for(0.1)

    def be(
        self,
        x: float,
        z: float,
        *,
        seconds: float = 0.1,
        on_ground: bool = False,
        authority: bool = True,
        inside: bool = True,
        failsafe: str = "",
        sinking: float = 0.0,
    ) -> None:
        """Be at a place for a while, `z` above the ground there."""
        end = self.bus.now() + seconds
        while (t := self.bus.now()) < end - 1e-9:
            state = FlightState(
                t=t,
                on_ground=on_ground,
                rotors_on=not on_ground,
                home_valid=True,
                authority=authority,
                failsafe=failsafe,
            )
            truth = Truth(
                t=t,
                position=(x, 0.0, TERRAIN.height(x, 0.0) + z),
                quaternion=(1.0, 0.0, 0.0, 0.0),
                velocity=(0.0, 0.0, -sinking),
                collisions=0,
                clearance=x - 1.0,
                inside_fence=inside,
            )
            self.flight.put(encode(state))
            self.truth.put(encode(truth))
            self.network.run_for(0.1)

    def end_mission(self, phase: str = MissionPhase.FAILED) -> None:
        self.mission.put(
            encode(
                MissionStatus(mission="mapping", phase=MissionPhase(phase), t=self.bus.now(), text="as the test says")
            )
        )
        self.network.run_for(0.1)


@pytest.mark.parametrize(("x", "end"), [(1.9, End.HOME), (2.1, End.ELSEWHERE)])
def test_a_drone_has_landed_when_its_rotors_are_off(x: float, end: End) -> None:
    scene = Scene()
    scene.be(x, 4.0)
    scene.end_mission()
    assert (scene.observer.end, scene.observer.over) == (End.FLYING, False)
    scene.be(x, 0.1, on_ground=True)
    assert (scene.observer.end, scene.observer.over) == (end, True)


@pytest.mark.parametrize("x", [0.0, 20.0, 30.0])
def test_where_the_autopilot_says_that_it_stands_the_truth_decides(x: float) -> None:
    scene = Scene()
    scene.end_mission()
    scene.be(x, 30.0, on_ground=True, sinking=5.0)
    assert (scene.observer.end, scene.observer.over) == (End.FLYING, False)
    scene.be(x, TIP_RADIUS - 0.1, on_ground=True)
    assert (scene.observer.end, scene.observer.over) == (End.ELSEWHERE if x else End.HOME, True)
    scene.be(x, TIP_RADIUS + 0.1, on_ground=True)
    assert (scene.observer.end, scene.observer.over) == (End.NOT_LANDED, True)


def test_a_drone_in_the_pilots_hands_is_handed_over_once_it_has_held_its_place() -> None:
    scene = Scene()
    scene.end_mission()
    for x in (5.0, 8.0, 11.0):
        scene.be(x, 4.0, authority=False)
    scene.be(11.0, 4.0, authority=False, seconds=HELD_FOR - 0.2)
    assert scene.observer.end is End.FLYING
    scene.be(11.0, 4.0, authority=False, seconds=0.6)
    assert scene.observer.end is End.HANDED_OVER
    scene.be(11.0, 4.0, authority=True)
    assert scene.observer.end is End.FLYING


def test_a_drone_that_the_pilot_took_before_the_missions_end_has_to_hold_its_place_after_it() -> None:
    scene = Scene()
    scene.be(11.0, 4.0, authority=False, seconds=6.0 * HELD_FOR)
    assert scene.observer.end is End.FLYING
    scene.end_mission()
    assert not scene.observer.over
    scene.be(11.0, 4.0, authority=False, seconds=HELD_FOR - 0.2)
    assert not scene.observer.over
    scene.be(11.0, 4.0, authority=False, seconds=0.6)
    assert (scene.observer.end, scene.observer.over) == (End.HANDED_OVER, True)


def test_a_pilot_who_gives_back_what_he_took_has_to_do_so_first() -> None:
    scene = Scene(pilot_returns=True)
    scene.end_mission()
    scene.be(5.0, 4.0, authority=False, seconds=2.0 * HELD_FOR)
    assert scene.observer.end is End.FLYING
    scene.be(5.0, 0.1, on_ground=True)
    assert scene.observer.end is End.ELSEWHERE


def test_leaving_the_fence_counts_once_until_the_drone_is_back_inside() -> None:
    scene = Scene()
    for inside in (True, False, False, True, False):
        scene.be(3.0, 4.0, inside=inside)
    assert scene.observer.breaches == 2


def test_the_least_clearance_and_each_failsafe_are_remembered() -> None:
    scene = Scene()
    for x, failsafe in ((4.0, ""), (2.5, "no setpoints: holding"), (6.0, "no setpoints: holding"), (6.0, "landing")):
        scene.be(x, 4.0, failsafe=failsafe)
    assert scene.observer.clearance == 1.5
    assert scene.observer.failsafes == ["no setpoints: holding", "landing"]
