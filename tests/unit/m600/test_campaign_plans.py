"""Plans of campaigns: flights and their faults follow from the seeds alone."""

from __future__ import annotations

import math
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from skillwing.bt_missions.library import find_mission
from skillwing.dsl.model import UnknownNameError
from skillwing.evaluation.campaign.command import make_plans, parse_seeds
from skillwing.evaluation.flights.conditions import EARLIEST, LONGEST, SHORTEST, Condition, draw, met_from
from skillwing.evaluation.flights.plan import FlightPlan, planned_way, way_time
from skillwing.m600.bridge.levels import CRITICAL_BELOW, LOW_BELOW
from skillwing.m600.robot import ROBOT
from skillwing.onboard.sensor_data.names import GNSS, IMU, LIDAR, RANGE, ZED
from skillwing.services.errors import InvalidOptionError
from skillwing.services.processes.node_host import make_node
from skillwing.sim_mujoco.autopilot.failsafes import CRITICAL_CHARGE
from skillwing.sim_mujoco.link.radio import Radio
from skillwing.sim_mujoco.physics.battery import PACKS
from skillwing.sim_mujoco.physics.rotor_faults import ROTOR_NAMES, STOPPED, WEAK
from skillwing.sim_mujoco.scenario.fault_checks import check_fault
from skillwing.sim_mujoco.scenario.format import FaultOptions, RadioOptions
from skillwing.sim_mujoco.sensors.faults import KINDS

WAY_TIME = 48.0
LATEST = LONGEST * WAY_TIME
SEEDS = st.integers(0, 2**32 - 1)


def moments(met: dict[str, Any]) -> list[float]:
    """Start times of the faults. Of the pilot's handovers only the first counts."""
    faults, gusts, pilot = met.get("faults", []), met.get("gusts", []), met.get("pilot", [])
    events = [*faults, *gusts, *pilot[:1], *met.get("packs_fail", []), *met.get("link", {}).get("faults", [])]
    return [event["at"] for event in events]


@given(st.sampled_from(Condition), SEEDS)
def test_the_same_seed_meets_the_same(condition: Condition, seed: int) -> None:
    assert draw(condition, seed, WAY_TIME) == draw(condition, seed, WAY_TIME)


@given(st.sampled_from(Condition), SEEDS)
def test_whatever_happens_happens_in_flight(condition: Condition, seed: int) -> None:
    met = draw(condition, seed, WAY_TIME)
    found = moments(met)
    assert all(EARLIEST <= moment <= LATEST for moment in found)
    assert met_from(met) == (max if condition is Condition.BOTH else min)(found, default=None)
    pilot = met.get("pilot", [])
    assert pilot == sorted(pilot, key=lambda handover: handover["at"])


@given(st.sampled_from(Condition), SEEDS)
def test_the_simulator_can_fail_as_is_drawn(condition: Condition, seed: int) -> None:
    for fault in msgspec.convert(draw(condition, seed, WAY_TIME).get("faults", []), list[FaultOptions]):
        check_fault(fault.sensor, fault.kind, fault.magnitude)
        assert fault.duration is None or 3.0 <= fault.duration <= 30.0


@pytest.mark.parametrize("condition", [each for each in Condition if each is not Condition.NONE])
def test_it_happens_in_each_part_of_even_the_shortest_flight(condition: Condition) -> None:
    begun = [t for seed in range(100) for t in moments(draw(condition, seed, WAY_TIME))]
    end = SHORTEST * WAY_TIME
    parts = [sum(end * k / 5 <= t < end * (k + 1) / 5 for t in begun) / len(begun) for k in range(5)]
    assert min(parts) > 0.08
    assert sum(t > end for t in begun) / len(begun) < 0.4


SLIGHT_AND_BAD = {
    ZED: {"noise": (0.15, 1.5), "bias": (0.4, 1.5)},
    LIDAR: {"noise": (0.15, 1.5), "bias": (0.4, 1.5)},
    GNSS: {"noise": (0.1, 50.0), "bias": (0.1, 50.0)},
    IMU: {"noise": (0.05, 10.0), "bias": (0.05, 10.0)},
    RANGE: {"noise": (0.05, 10.0), "bias": (0.05, 10.0)},
}
"""Magnitudes in units of the sensor: one that no detector finds, and one that none misses."""


@pytest.mark.parametrize(
    ("condition", "sensor"),
    [
        (Condition.CAMERA, ZED),
        (Condition.LIDAR, LIDAR),
        (Condition.GNSS, GNSS),
        (Condition.IMU, IMU),
        (Condition.RANGE, RANGE),
    ],
)
def test_sensors_fail_in_all_ways_slightly_and_badly(condition: Condition, sensor: str) -> None:
    faults = [fault for seed in range(400) for fault in draw(condition, seed, WAY_TIME)["faults"]]
    assert {fault["sensor"] for fault in faults} == {sensor}
    assert {fault["kind"] for fault in faults} == set(KINDS)
    for kind, (slight, bad) in {**SLIGHT_AND_BAD[sensor], "dropout": (0.5, 0.8), "slow": (2.0, 8.0)}.items():
        sizes = [abs(fault["magnitude"]) for fault in faults if fault["kind"] == kind]
        assert min(sizes) <= slight
        assert max(sizes) >= bad
    assert all("magnitude" not in fault for fault in faults if fault["kind"] in ("blackout", "freeze"))
    assert 0.4 < sum("for" in fault for fault in faults) / len(faults) < 0.6


def test_every_rotor_stops_for_good_or_loses_little_or_much_of_its_thrust() -> None:
    faults = [fault for seed in range(400) for fault in draw(Condition.ROTOR, seed, WAY_TIME)["faults"]]
    stopped = [fault for fault in faults if fault["kind"] == STOPPED]
    weak = [fault for fault in faults if fault["kind"] == WEAK]
    assert {fault["sensor"] for fault in stopped} == {fault["sensor"] for fault in weak} == set(ROTOR_NAMES)
    assert 0.4 < len(stopped) / len(faults) < 0.6
    assert not any("for" in fault for fault in stopped)
    assert 0.4 < sum("for" in fault for fault in weak) / len(weak) < 0.6
    left = [fault["magnitude"] for fault in weak]
    assert min(left) < 0.1
    assert max(left) > 0.9


def test_batteries_fail_down_to_where_the_mission_and_where_the_autopilot_lands() -> None:
    met = [draw(Condition.BATTERY, seed, WAY_TIME) for seed in range(100)]
    left = [each["battery"] * (1.0 - each["packs_fail"][0]["packs"] / PACKS) for each in met]
    for low, high in ((0.0, CRITICAL_CHARGE), (CRITICAL_CHARGE, CRITICAL_BELOW), (CRITICAL_BELOW, LOW_BELOW)):
        assert sum(low <= percent < high for percent in left) >= 8
    assert min(each["battery"] for each in met) > LOW_BELOW


def test_each_sensor_fails_once_where_both_do() -> None:
    assert {fault["sensor"] for fault in draw(Condition.BOTH, 4, WAY_TIME)["faults"]} == {ZED, LIDAR}


def test_a_flight_without_fault_meets_nothing() -> None:
    assert draw(Condition.NONE, 4, WAY_TIME) == {}


def test_the_pilot_who_returns_gives_the_authority_back() -> None:
    assert [each["authority"] for each in draw(Condition.PILOT_RETURNS, 4, WAY_TIME)["pilot"]] == [False, True]


@pytest.mark.parametrize("condition", [Condition.BOTH, Condition.GUST, Condition.BATTERY, Condition.ROTOR])
def test_the_robot_and_the_mission_take_what_a_plan_tells_them(condition: Condition) -> None:
    plan = FlightPlan(mission="mapping", world="courtyard", seed=5, condition=condition, watched=False)
    for spec in ROBOT.functional_layer(plan.robot_options()):
        assert make_node(spec).name == spec.name
    assert way_time(plan.site().way) > 30.0


REACHES = {
    Condition.NONE: ("sim", set[str]()),
    Condition.CAMERA: ("sim", {"faults"}),
    Condition.LIDAR: ("sim", {"faults"}),
    Condition.BOTH: ("sim", {"faults"}),
    Condition.GUST: ("sim", {"wind", "turbulence", "gusts"}),
    Condition.BATTERY: ("sim", {"battery", "packs_fail"}),
    Condition.LINK: ("link", {"faults"}),
    Condition.GNSS: ("sim", {"faults"}),
    Condition.IMU: ("sim", {"faults"}),
    Condition.RANGE: ("sim", {"faults"}),
    Condition.ROTOR: ("sim", {"faults"}),
    Condition.PILOT: ("sim", {"pilot"}),
    Condition.PILOT_RETURNS: ("sim", {"pilot"}),
}
"""Process and options that each condition changes."""


@pytest.mark.parametrize("condition", Condition)
def test_a_condition_is_an_option_of_only_the_process_that_causes_it(
    condition: Condition,
) -> None:
    plan = FlightPlan(mission="mapping", world="courtyard", seed=5, condition=condition)
    told = {spec.name: spec.options for spec in ROBOT.functional_layer(plan.robot_options())}
    calm = replace(plan, condition=Condition.NONE)
    usual = {spec.name: spec.options for spec in ROBOT.functional_layer(calm.robot_options())}
    process, names = REACHES[condition]
    met = plan.circumstances()
    assert {name: told[process][name] for name in names} == met.get("link", met)
    for name in names:
        told[process].pop(name)
    assert told == usual


@pytest.mark.parametrize("watched", [True, False])
def test_an_unwatched_flight_is_one_in_which_guidance_ignores_obstacles(watched: bool) -> None:
    plan = FlightPlan(mission="mapping", world="courtyard", seed=5, condition=Condition.NONE, watched=watched)
    told = {spec.name: spec.options for spec in ROBOT.functional_layer(plan.robot_options())}
    assert told["guidance"]["watch"] is watched
    assert not any("watch" in options for name, options in told.items() if name != "guidance")


def test_every_seed_is_flown_under_every_condition_before_the_next_one() -> None:
    plans = make_plans("mapping", "3:5", "none,pilot", "courtyard", watched=True)
    assert [(plan.seed, plan.condition) for plan in plans] == [(3, "none"), (3, "pilot"), (4, "none"), (4, "pilot")]
    assert len({plan.name for plan in plans}) == len(plans)


def test_the_command_of_a_flight_flies_that_flight() -> None:
    plan = make_plans("mapping", "17", "both", "courtyard", watched=False)[0]
    words = plan.command.split()
    assert words[:3] == ["skillwing", "campaign", "mapping"]
    options = dict(zip(words[3::2], words[4::2], strict=False))
    assert make_plans("mapping", options["--seeds"], options["--faults"], options["--worlds"], watched=False) == [plan]
    assert "--without-obstacles" in words


@pytest.mark.parametrize("text", ["", "a", "5:", ":5", "5:5", "7:3", "-1:3", "1:2:3"])
def test_what_are_no_seeds_is_refused(text: str) -> None:
    with pytest.raises(InvalidOptionError, match="seed"):
        parse_seeds(text)


@pytest.mark.parametrize("text", ["4294967296", "0:4294967297", "0:99999999999", "9" * 5000])
def test_a_seed_that_is_too_large_is_called_that(text: str) -> None:
    with pytest.raises(InvalidOptionError, match=r"^A seed is too large in --seeds\. The largest is 4294967295\.$"):
        parse_seeds(text)
    assert list(parse_seeds("4294967295")) == list(parse_seeds("4294967295:4294967296")) == [4294967295]


def test_more_flights_than_anybody_can_mean_are_refused_before_they_are_listed() -> None:
    with pytest.raises(
        InvalidOptionError, match=r"These are 8,000,000,000 flights, and a campaign has 100,000 at most"
    ):
        make_plans("mapping", "0:4000000000", "none,camera", None)


@pytest.mark.parametrize(("conditions", "worlds"), [("", None), ("none", "")])
def test_a_list_without_a_name_is_not_the_usual_one(conditions: str, worlds: str | None) -> None:
    with pytest.raises(UnknownNameError):
        make_plans("mapping", "0", conditions, worlds)


@pytest.mark.parametrize(
    ("arguments", "meant"),
    [
        (("maping", "1", "none", "courtyard"), "mapping"),
        (("mapping", "1", "camra", "courtyard"), "camera"),
        (("mapping", "1", "none", "courtyad"), "courtyard"),
    ],
)
def test_a_typing_error_is_named(arguments: tuple[str, str, str, str], meant: str) -> None:
    with pytest.raises(UnknownNameError, match=f"did you mean `{meant}`"):
        make_plans(*arguments, watched=True)


# --- other missions --------------------------------------------------------------------------------------------------


def test_each_mission_flies_in_its_usual_world_and_meets_what_it_notices() -> None:
    plans = make_plans("inspection", "3", "all", None)
    assert {plan.world for plan in plans} == {"inspection"}
    assert set(Condition) - {plan.condition for plan in plans} == {Condition.CAMERA, Condition.IMU}
    plans = make_plans("mapping", "3", "all", None)
    assert set(Condition) - {plan.condition for plan in plans} == {Condition.LINK}


def test_an_inspection_knows_its_building_and_flies_round_it() -> None:
    plan = make_plans("inspection", "3", "none", None)[0]
    options = plan.mission_options()
    find_mission("inspection").read_options(options)
    site = plan.site()
    assert site.target is not None
    way = planned_way(site, "inspection")
    distances = [math.dist(place[:2], site.target.centre) for place in way[1:-1]]
    assert distances == pytest.approx([site.target.radius] * len(distances))
    assert way[0] == way[-1] == (0.0, 0.0, options["height"])


def test_a_world_without_a_building_is_refused_before_anything_flies() -> None:
    with pytest.raises(InvalidOptionError, match="no building to inspect"):
        make_plans("inspection", "3", "none", "inspection,courtyard")


@given(SEEDS)
def test_a_link_that_narrows_carries_less_than_the_video_needs_at_its_best(seed: int) -> None:
    link = msgspec.convert(draw(Condition.LINK, seed, WAY_TIME)["link"], RadioOptions)
    assert [fault.kind for fault in link.faults] == ["narrow"]
    assert Radio(link).at(link.faults[0].at, (0.0, 0.0, 10.0)).bandwidth <= 0.3e6
