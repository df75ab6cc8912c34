"""The robot bridge."""

from __future__ import annotations

import pytest
from drone import SKILLSET, Drone
from hypothesis import given
from hypothesis import strategies as st

from skillwing.m600.bridge.node import RobotBridge
from skillwing.m600.skills.zed_depthmap import ZedDepthmapManager
from skillwing.onboard.topics.faults import fault_id, read_fault_id
from skillwing.onboard.topics.obstacles import ObstacleSource
from skillwing.onboard.topics.sensors import SensorStatus
from skillwing.services.protocol import RecordKind


@pytest.fixture
def drone() -> Drone:
    return Drone(ZedDepthmapManager)


def test_resources_follow_the_robot(drone: Drone) -> None:
    states = drone.states
    assert states["SDK_authority"] == "AVAILABLE"
    assert states["homepoint_status"] == "VALID"
    assert states["flight_status"] == "ON_GROUND"
    assert states["zed_status"] == states["lidar_status"] == "OK"
    drone.layer.fly_at(3.0)
    drone.layer.authority = False
    drone.run(0.2)
    assert states["flight_status"] == "IN_AIR"
    assert states["SDK_authority"] == "UNAVAILABLE"


def test_nobody_flies_a_drone_that_has_fallen_silent(drone: Drone) -> None:
    drone.layer.tells_flight = False
    drone.run(1.9)
    assert drone.states["SDK_authority"] == "AVAILABLE"
    drone.run(1.5)
    assert drone.states["SDK_authority"] == "UNAVAILABLE"
    drone.layer.tells_flight = True
    drone.run(0.3)
    assert drone.states["SDK_authority"] == "AVAILABLE"


@pytest.mark.parametrize(("percent", "status"), [(80.0, "NORMAL"), (29.0, "LOW"), (14.0, "CRITICAL")])
def test_the_battery_has_three_states(drone: Drone, percent: float, status: str) -> None:
    drone.layer.percent = percent
    drone.run(1.2)
    assert drone.states["battery_status"] == status


def test_a_resource_that_was_moved_elsewhere_comes_back(drone: Drone) -> None:
    drone.trigger("zed_status", "FAILED")
    drone.run(0.6)
    assert drone.states["zed_status"] == "OK"


def test_a_change_while_a_request_is_under_way_is_passed_on_with_its_answer(drone: Drone) -> None:
    drone.layer.report_health("zed", SensorStatus.FAILED, "health-1")
    drone.layer.report_health("zed", SensorStatus.UNKNOWN, "health-2")
    drone.run(0.1)
    assert drone.states["zed_status"] == "UNKNOWN", "long before the next comparison"


def test_a_restarted_bridge_finds_out_again(drone: Drone) -> None:
    drone.kill("bridge")
    drone.layer.report_health("zed", SensorStatus.FAILED, "health-1")
    drone.layer.fly_at(3.0)
    drone.run(1.0)
    assert drone.states["flight_status"] == "ON_GROUND"
    drone.network.attach(RobotBridge(SKILLSET))
    drone.run(1.0)
    assert drone.states["flight_status"] == "IN_AIR"
    assert drone.states["zed_status"] == "FAILED"


def test_a_failure_reads_as_one_chain_down_to_the_fault(drone: Drone) -> None:
    goal = drone.start()
    drone.layer.report_health("zed", SensorStatus.FAILED, "sim/health-7", cause="fault/zed/blackout")
    goal.assert_ended("RI")
    chain = drone.history.chain(goal.handle.record)
    assert [record.kind for record in chain[:3]] == [RecordKind.FAULT, RecordKind.HEALTH, RecordKind.RESOURCE]
    assert chain[-1].kind is RecordKind.GOAL
    assert goal.causes == [
        "zed blackout",
        "zed FAILED",
        "zed_status FAILED",
        "zed_depthmap.zed_ok VIOLATED",
        "zed_depthmap RI",
    ]


def test_the_same_fault_is_reported_once(drone: Drone) -> None:
    for number, status in enumerate((SensorStatus.FAILED, SensorStatus.OK, SensorStatus.FAILED)):
        drone.layer.report_health("zed", status, f"health-{number}", cause="fault/zed/blackout")
        drone.run(0.1)
    assert [record.id for record in drone.history.records if record.kind is RecordKind.FAULT] == ["fault/zed/blackout"]


def test_a_fault_has_the_time_of_its_injection_and_tells_when_it_was_discovered(drone: Drone) -> None:
    drone.run(3.0)
    since = drone.now() - 1.25
    drone.layer.report_health("zed", SensorStatus.FAILED, "health-1", cause=fault_id("zed", "blackout", since))
    drone.run(0.1)
    [fault] = [record for record in drone.history.records if record.kind is RecordKind.FAULT]
    assert fault.t == pytest.approx(since, abs=0.001)
    assert (fault.after, fault.text) == ("blackout", "blackout of zed is on, discovered after 1.25 s")


def test_a_second_injection_of_a_fault_is_a_record_of_its_own(drone: Drone) -> None:
    for number, since in enumerate((0.5, 0.5, 0.75)):
        cause = fault_id("zed", "blackout", since)
        drone.layer.report_health("zed", SensorStatus.FAILED, f"failed-{number}", cause=cause)
        drone.run(0.1)
        drone.layer.report_health("zed", SensorStatus.OK, f"ok-{number}")
        drone.run(0.1)
    assert [record.t for record in drone.history.records if record.kind is RecordKind.FAULT] == [0.5, 0.75]


@given(part=st.sampled_from(["zed", "link", "rotor/2"]), kind=st.sampled_from(["blackout", "cut"]), t=st.floats(0, 2e9))
def test_the_id_of_a_fault_has_its_kind_and_its_time(part: str, kind: str, t: float) -> None:
    read, since = read_fault_id(fault_id(part, kind, t))
    assert read == kind
    assert since == pytest.approx(t, abs=0.001)


def test_the_timeline_tells_what_the_autopilot_does_by_itself(drone: Drone) -> None:
    for failsafe in ("no setpoints: holding position", "no setpoints: landing", ""):
        drone.layer.failsafe = failsafe
        drone.run(0.5)
    told = [(r.before, r.after, r.text) for r in drone.history.records if r.subject == "autopilot"]
    assert told == [
        ("NORMAL", "FAILSAFE", "no setpoints: holding position"),
        ("FAILSAFE", "FAILSAFE", "no setpoints: landing"),
        ("FAILSAFE", "NORMAL", ""),
    ]


def test_telemetry_becomes_data_that_stay_fresh(drone: Drone) -> None:
    drone.layer.source = ObstacleSource.ZED
    drone.layer.position, drone.layer.heading = (1.0, 2.0, 3.0), 0.5
    drone.run(3.0)
    values = {}
    for item in SKILLSET.data:
        reading = drone.reading(item.name)
        if item.name not in ("link_bandwidth", "video_quality"):
            assert not reading.stale, item.name
            values[item.name] = reading.value
        else:
            assert reading.stale
    assert values["position"] == {"x": 1.0, "y": 2.0, "z": 3.0}
    assert values["heading"] == 0.5
    assert values["battery"] == 100.0
    assert values["obstacle_distance"] == 7.0
    assert values["map_statistics"] == {"voxels": 10, "volume": 1.25, "scans": 3}


def test_a_measurement_that_is_not_renewed_turns_stale(drone: Drone) -> None:
    drone.layer.source = ObstacleSource.ZED
    drone.run(1.0)
    drone.layer.measures = False
    drone.run(1.0)
    assert drone.reading("obstacle_distance").stale
    assert not drone.reading("position").stale


def test_what_cannot_be_read_is_dropped(drone: Drone) -> None:
    bus = drone.network.bus("vandal")
    for key in (
        "fl/flight",
        "fl/health/zed",
        "fl/battery",
        "fl/navigation",
        "fl/mapping/map",
        "m600/resource/verdict/goto",
    ):
        bus.advertise(key, events=True).put(b"\xc1 nonsense", b"\xc1")
    drone.run(1.0)
    assert drone.states["SDK_authority"] == "AVAILABLE"
    assert not drone.reading("position").stale
