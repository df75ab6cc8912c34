"""Faults that come by time, place and file, and what a file can be wrong in."""

from __future__ import annotations

import json
import subprocess
import sys
from itertools import product
from pathlib import Path
from typing import get_args

import msgspec
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from skillwing.services.options import OptionsError
from skillwing.sim_mujoco.scenario.fault_checks import check_fault
from skillwing.sim_mujoco.scenario.field_errors import field_errors
from skillwing.sim_mujoco.scenario.format import Scenario
from skillwing.sim_mujoco.scenario.reading import ScenarioError, read_scenario
from skillwing.sim_mujoco.sensors.faults import KINDS, Fault, FaultSchedule, MagnitudeError, UnknownFaultError, Zone
from skillwing.sim_mujoco.sensors.receivers import RECEIVERS, ReceiverName
from skillwing.sim_mujoco.sensors.table import SENSORS
from skillwing.sim_mujoco.simulator.node import make_sim
from skillwing.sim_mujoco.simulator.simulator import Simulator
from skillwing.sim_mujoco.world.world import make_world

EXAMPLE = """
wind = [3, 0, 0]
battery = 80

[[fault]]
sensor = "gnss"
kind = "blackout"
zone = { center = [10.0, 0.0], radius = 5.0 }

[[fault]]
sensor = "zed"
kind = "noise"
at = 3
for = 4
magnitude = 1.5

[[gust]]
at = 30
velocity = [6, 0, 0]
for = 4

[[pilot]]
at = 0.5
authority = false
"""
NAMES = [
    "fault",
    "gust",
    "pilot",
    "wind",
    "link",
    "zone",
    "sensor",
    "kind",
    "at",
    "for",
    "velocity",
    "zones",
    "low",
    "high",
]
HERE, AWAY = (10.0, 1.0, 4.0), (30.0, 1.0, 4.0)


@pytest.fixture
def write(tmp_path: Path):
    def write(text: str, name: str = "scenario.toml") -> Path:
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_a_fault_by_place_is_on_while_the_drone_is_inside() -> None:
    plan = FaultSchedule([Fault("gnss", "freeze", at=5.0, zone=Zone(center=(10.0, 0.0), radius=5.0))])
    where = [(0.0, HERE), (4.9, HERE), (5.0, HERE), (6.0, HERE), (7.0, AWAY), (8.0, AWAY), (9.0, HERE)]
    seen = [(t, on) for t, position in where for _, on in plan.switches(t, position)]
    assert seen == [(5.0, True), (7.0, False), (9.0, True)]


@given(
    at=st.floats(0.0, 50.0),
    duration=st.none() | st.floats(0.0, 50.0),
    inside=st.lists(st.booleans(), min_size=1, max_size=60),
)
def test_a_plan_switches_exactly_where_what_is_wanted_changes(
    at: float, duration: float | None, inside: list[bool]
) -> None:
    fault = Fault("zed", "blackout", at, duration, zone=Zone(low=(5.0, -5.0, 0.0), high=(15.0, 5.0, 9.0)))
    plan, on = FaultSchedule([fault]), False
    for t, within in enumerate(inside):
        position = HERE if within else AWAY
        for _, switched in plan.switches(float(t), position):
            assert switched is not on
            on = switched
        assert on is fault.is_wanted(float(t), position)


FAULTS = st.builds(
    Fault,
    st.sampled_from(["zed", "lidar"]),
    st.sampled_from(["noise", "bias"]),
    st.integers(0, 20).map(float),
    st.none() | st.integers(1, 20).map(float),
    st.sampled_from([0.5, 1.0, 2.0]),
)


@given(st.lists(FAULTS, max_size=6))
def test_where_faults_of_one_kind_overlap_one_of_them_is_on_as_long_as_any_is_wanted(faults: list[Fault]) -> None:
    plan, on = FaultSchedule(faults), dict[tuple[str, str], float | None]()
    for t in map(float, range(45)):
        for fault, switched in plan.switches(t, HERE):
            if switched:
                on[fault.sensor, fault.kind] = fault.magnitude
            else:
                del on[fault.sensor, fault.kind]
        wanted = [fault for fault in faults if fault.is_wanted(t, HERE)]
        assert on.keys() == {(fault.sensor, fault.kind) for fault in wanted}
        for (sensor, kind), magnitude in on.items():
            same = [fault for fault in wanted if (fault.sensor, fault.kind) == (sensor, kind)]
            latest = max(fault.at for fault in same)
            assert magnitude in [fault.magnitude for fault in same if fault.at == latest]


def test_a_fault_that_nothing_can_have_is_refused() -> None:
    for sensor, kind in (("nose", "blackout"), ("zed", "gremlin"), ("rotor/9", "stopped"), ("rotor/1", "freeze")):
        with pytest.raises(UnknownFaultError):
            check_fault(sensor, kind)


@pytest.mark.parametrize("magnitude", [1e39, float("inf"), float("nan")])
def test_options_with_a_magnitude_that_is_none_are_refused(magnitude: float) -> None:
    for sensor, kind in product(SENSORS, KINDS):
        with pytest.raises(OptionsError, match="magnitude"):
            make_sim({"faults": [{"sensor": sensor, "kind": kind, "magnitude": magnitude}]})
        with pytest.raises(MagnitudeError):
            check_fault(sensor, kind, magnitude)


@pytest.mark.parametrize("option", [{"wind": (0.0, 60.0, 0.0)}, {"turbulence": 51.0}, {"receiver": "gps"}])
def test_options_have_the_bounds_of_a_scenario(option: dict[str, object]) -> None:
    with pytest.raises(OptionsError, match=f"these options do not fit: .*{next(iter(option))}"):
        make_sim(option)


def test_a_file_becomes_faults_wind_battery_and_a_pilot(write) -> None:
    node = make_sim({"seed": 2, "scenario": str(write(EXAMPLE)), "sensors": ["range"]})
    simulator = node._sim
    assert 79.0 < simulator.battery.percent <= 80.0
    simulator.advance(0.4)
    assert simulator.autopilot.authority
    simulator.advance(0.6)
    assert not simulator.autopilot.authority


def test_json_says_the_same_as_toml(write) -> None:
    toml = read_scenario(write(EXAMPLE))
    content = {
        "wind": [3, 0, 0],
        "battery": 80,
        "fault": [
            {"sensor": "gnss", "kind": "blackout", "zone": {"center": [10, 0], "radius": 5}},
            {"sensor": "zed", "kind": "noise", "at": 3, "for": 4, "magnitude": 1.5},
        ],
        "gust": [{"at": 30, "velocity": [6, 0, 0], "for": 4}],
        "pilot": [{"at": 0.5, "authority": False}],
    }
    assert read_scenario(write(json.dumps(content), "scenario.json")) == toml


def test_options_add_to_a_scenario_and_count_before_it(write) -> None:
    options = {"scenario": str(write(EXAMPLE)), "battery": 50.0, "sensors": ["range"]}
    node = make_sim({**options, "faults": [{"sensor": "range", "kind": "slow"}]})
    assert node._sim.battery.percent <= 50.0
    node._sim.advance(0.1)
    assert node._sim.active_faults("range") == ("slow",)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("wind = 3", "fit: `wind` has to be a list of 3 numbers.*, not 3$"),
        ("turbulence = 'much'", '`turbulence` has to be a number from 0 to 50, not "much"$'),
        ("battery = nan", "`battery` has to be a number from 0 to 100, not NaN$"),
        ("poses = 'best'", '`poses` has to be one of .*odometry.*, not "best"$'),
        ("receiver = 2024-01-01", '`receiver` has to be one of rtk, standalone, not "2024-01-01"$'),
        ("receiver = 'gps'", '`receiver` has to be one of rtk, standalone, not "gps"$'),
        ("wind = [0, -60, 0]", "`wind` has to be a list of 3 numbers from -50 to 50, not \\[0, -60, 0\\]$"),
        (
            "[[gust]]\nat=1\nvelocity=[1000,0,0]\nfor=2",
            "gust 1: `velocity` has to be a list of 3 numbers from -50 to 50, not",
        ),
        ("pilot = 3", "`pilot` has to be a list of sections, not 3$"),
        ("fault = [1]", "fault 1: this has to be a section, not 1$"),
        ("[[pilot]]\nat=1\nauthority=1", "pilot 1: `authority` has to be true or false, not 1$"),
        ("[[gust]]\nat=1\nvelocity=[1,2,3]\nfor=0", "gust 1: `for` has to be a number above 0 and up to 1,000,000"),
        ("[[gust]]\nat=1\nvelocity=[1,2,3]", "gust 1: `for` is missing$"),
        ("[link]\nloss = 2", "link: `loss` has to be a number from 0 to 1, not 2$"),
        ("[[link.faults]]\nkind = 'cutt'", "link faults 1: `kind` has to be one of cut, narrow, not"),
        (
            "[[link.faults]]\nkind = 'cut'\nat = -1",
            "fit: link faults 1: `at` has to be a number from 0 to 1,000,000, not -1$",
        ),
        ("[[link.faults]]\nkind = 'cut'\nfor = 1e300", "fit: link faults 1: `for` has .* to 1,000,000, not 1e\\+300$"),
        ("[[link.faults]]\nkind = 'cut'\nat = nan", "fit: link faults 1: `at` has .* to 1,000,000, not NaN$"),
        ("[[link.faults]]\nkind = 'cut'\nfor = inf", "fit: link faults 1: `for` has .* to 1,000,000, not Infinity$"),
        (
            '[[fault]]\nsensor="zed"\nkind="freeze"\n[[fault]]\nkind="slow"\nsensr="x"',
            "fit: fault 2: there is no `sensr`; did you mean `sensor`; known are sensor, kind",
        ),
        (
            '[[fault]]\nsensor="zed"\nkind="freeze"\nat=-1',
            "fault 1: `at` has to be a number from 0 to 1,000,000, not -1",
        ),
        ('[[fault]]\nsensor="zed"\nkind="freeze"\nzone={center=[1,2]}', "fault 1 zone: .*`center` and `radius`"),
        (
            '[[fault]]\nsensor="zed"\nkind="freeze"\nzone={low=[0,0,9],high=[9,9,0]}',
            "fault 1 zone: `low` of a zone has to be below `high` in x, y and z$",
        ),
        (
            "[[link.zones]]\nlow=[0,0,0]\nhigh=[9,0,9]",
            "link zones 1: `low` of a zone has to be below `high` in x, y and z$",
        ),
        ('[[fault]]\nsensor="nose"\nkind="freeze"', "fault 1: there is no sensor 'nose'; choose one of zed"),
        (
            '[[fault]]\nsensor="zde"\nkind="freeze"',
            "fault 1: there is no sensor 'zde'; did you mean `zed`; choose one of zed",
        ),
        (
            '[[fault]]\nsensor="zed"\nkind="blakout"',
            "fault 1: there is no kind of fault 'blakout'; did you mean `blackout`; choose one of",
        ),
        (
            '[[fault]]\nsensor="link"\nkind="cut"',
            "fault 1: the link is no sensor; write its faults as `\\[\\[link.faults\\]\\]`$",
        ),
        ('[[fault]]\nsensor="zed"\nkind="freeze"\nmagnitude=3', "fault 1: freeze has no magnitude$"),
        ("[[link.faults]]\nkind = 'cut'\nmagnitude = 1", "link faults 1: cut has no magnitude$"),
        (
            '[[fault]]\nsensor="gnss"\nkind="noise"\nmagnitude=1e39',
            "fit: fault 1: `magnitude` has to be a number from -1,000,000 to 1,000,000, not 1e\\+39$",
        ),
        ('[[fault]]\nsensor="range"\nkind="slow"\nmagnitude=nan', "fit: fault 1: `magnitude` has .* not NaN$"),
        ('[[fault]]\nsensor="imu"\nkind="bias"\nmagnitude=-inf', "fit: fault 1: `magnitude` has .* not -Infinity$"),
        (
            '[[fault]]\nsensor="zed"\nkind="dropout"\nmagnitude=2',
            "fit: fault 1: the magnitude of dropout has to be from 0 to 1, not 2$",
        ),
        (
            '[[fault]]\nsensor="rotor/2"\nkind="weak"\nmagnitude=-0.1',
            "fit: fault 1: the magnitude of weak has to be from 0 to 1, not -0.1$",
        ),
        (
            '[[fault]]\nsensor="gnss"\nkind="bias"\nmagnitude=-1e6',
            "fit: fault 1: the magnitude of bias has to be from -100,000 to 100,000, not -1,000,000$",
        ),
        ("winds = [1, 2, 3]", "there is no `winds`; did you mean `wind`; known are fault, gust, pilot, wind"),
        ("wind = = 3", "is no TOML"),
    ],
)
def test_a_file_that_does_not_fit_is_refused_in_words(write, text: str, words: str) -> None:
    with pytest.raises(ScenarioError, match=words):
        read_scenario(write(text))
    with pytest.raises(OptionsError, match=words):
        make_sim({"scenario": str(write(text))})


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("list.json", "[1, 2]", "fit: this has to be a section, not \\[1, 2\\]$"),
        ("deep.json", "[" * 100_000, "cannot be read: sections or lists nest too deep in it$"),
        ("deep.toml", f"wind = {'[' * 10_000}", "cannot be read: sections or lists nest too deep in it$"),
        ("digits.json", f'{{"battery": {"9" * 5000}}}', "cannot be read: a number in it has thousands of digits$"),
        ("digits.toml", f"battery = {'9' * 5000}", "cannot be read: a number in it has thousands of digits$"),
        ("hexadecimal.toml", f"battery = 0x{'f' * 10_000}", "from 0 to 100, not something too large to be shown$"),
        ("dotted.toml", f"{'.'.join(['wind'] * 2000)} = 1", "list of 3 numbers.* not something too large to be shown$"),
    ],
)
def test_what_no_scenario_looks_like_is_refused_in_words(write, name: str, text: str, words: str) -> None:
    with pytest.raises(ScenarioError, match=words):
        read_scenario(write(text, name))


@pytest.mark.parametrize(("name", "text"), [("bom.toml", "battery = 50"), ("bom.json", '{"battery": 50}')])
def test_a_byte_order_mark_is_no_part_of_the_text(write, name: str, text: str) -> None:
    assert read_scenario(write(f"\ufeff{text}", name)).battery == 50.0


def test_all_problems_of_a_file_are_reported_at_once(write) -> None:
    text = 'winds = 1\n[[fault]]\nsensor="nose"\nkind="freeze"\nat="soon"\n[[gust]]\nat=1\nvelocity=[1]\nfor=2'
    with pytest.raises(ScenarioError) as caught:
        read_scenario(write(text))
    first, *wrong = str(caught.value).splitlines()
    assert first.endswith("does not fit:")
    places = [
        "there is no `winds`",
        "fault 1: `at` has",
        "gust 1: `velocity` has",
        "fault 1: there is no sensor 'nose'",
    ]
    assert [line.strip().startswith(place) for line, place in zip(wrong, places, strict=True)] == [True] * 4


JUNK = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.sampled_from([*NAMES, "x"]), inner, max_size=4),
    max_leaves=12,
)


@example({"link": None})
@given(st.dictionaries(st.sampled_from([*NAMES, "x"]), JUNK, max_size=5))
def test_errors_are_found_exactly_where_the_reader_finds_one(content: dict[str, object]) -> None:
    try:
        msgspec.convert(content, Scenario)
        fits = True
    except msgspec.ValidationError:
        fits = False
    assert (not list(field_errors(content, Scenario))) is fits


def test_a_file_that_is_not_there_is_refused_in_words(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="cannot be read"):
        read_scenario(tmp_path / "nothing.toml")


def test_a_scenario_may_name_each_receiver_that_there_is() -> None:
    assert set(get_args(ReceiverName)) == RECEIVERS.keys()


def test_a_unit_of_noise_or_bias_suits_each_value_of_a_sensor() -> None:
    simulator = Simulator(make_world(1), sensors=("imu",))
    simulator.advance(0.5)
    simulator.set_fault("imu", "bias", on=True)
    still = [m.data for m in simulator.advance(0.54).measurements if m.sensor == "imu"][-1]
    assert still[:, :3].mean(axis=0) == pytest.approx([1.0, 1.0, 10.81], abs=0.3)
    assert still[:, 3:].mean(axis=0) == pytest.approx([0.1, 0.1, 0.1], abs=0.02)


@pytest.mark.parametrize(
    ("imported", "absent"),
    [
        ("scenario.format", ("numpy", "mujoco", "embreex")),
        ("scenario.reading", ("mujoco", "embreex")),
        ("launching", ("mujoco", "embreex")),
    ],
)
def test_a_scenario_is_read_and_checked_without_physics(imported: str, absent: tuple[str, ...], tmp_path: Path) -> None:
    file = tmp_path / "scenario.toml"
    file.write_text('[[fault]]\nsensor = "zed"\nkind = "blackuot"\n', encoding="utf-8")
    lines = ["import sys", f"from skillwing.sim_mujoco.{imported} import *"]
    if imported.endswith("reading"):
        lines += ["try:", f"    read_scenario(__import__('pathlib').Path({str(file)!r}))"]
        lines += ["except ScenarioError as error:", "    print(error)"]
    lines += [f"print([name for name in {absent!r} if name in sys.modules])"]
    done = subprocess.run([sys.executable, "-c", "\n".join(lines)], capture_output=True, text=True, check=True)
    *said, loaded = done.stdout.splitlines()
    assert loaded == "[]"
    assert not said or "did you mean `blackout`" in said[-1]
