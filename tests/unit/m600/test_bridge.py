"""The robot bridge."""

from __future__ import annotations

import pytest
from robot_rig import SKILLSET, RobotRig

from skillwing.m600.bridge.node import RobotBridge
from skillwing.services.protocol import Record, RecordKind
from skillwing.sim_mujoco.topics import ObstacleSource, SensorStatus


@pytest.fixture
def rig() -> RobotRig:
    return RobotRig("zed_depthmap")


def test_resources_follow_the_robot(rig: RobotRig) -> None:
    states = rig.interface.states
    assert states["SDK_authority"] == "AVAILABLE"
    assert states["homepoint_status"] == "VALID"
    assert states["flight_status"] == "ON_GROUND"
    assert states["zed_status"] == states["lidar_status"] == "OK"
    rig.layer.fly_at(3.0)
    rig.layer.authority = False
    rig.run(0.2)
    assert states["flight_status"] == "IN_AIR"
    assert states["SDK_authority"] == "UNAVAILABLE"


@pytest.mark.parametrize(("percent", "status"), [(80.0, "NORMAL"), (29.0, "LOW"), (14.0, "CRITICAL")])
def test_the_battery_has_three_states(rig: RobotRig, percent: float, status: str) -> None:
    rig.layer.percent = percent
    rig.run(1.2)
    assert rig.interface.state("battery_status") == status


def test_a_resource_that_was_moved_elsewhere_comes_back(rig: RobotRig) -> None:
    rig.trigger("zed_status", "FAILED")
    rig.run(0.6)
    assert rig.interface.state("zed_status") == "OK"


def test_a_change_while_a_request_is_under_way_is_passed_on_with_its_answer(rig: RobotRig) -> None:
    rig.layer.report_health("zed", SensorStatus.FAILED, "health-1")
    rig.layer.report_health("zed", SensorStatus.UNKNOWN, "health-2")
    rig.run(0.1)
    assert rig.interface.state("zed_status") == "UNKNOWN", "long before the next comparison"


def test_a_restarted_bridge_finds_out_again(rig: RobotRig) -> None:
    rig.bridge_bus.close()
    rig.layer.report_health("zed", SensorStatus.FAILED, "health-1")
    rig.layer.fly_at(3.0)
    rig.run(1.0)
    assert rig.interface.state("flight_status") == "ON_GROUND"
    rig.network.attach(RobotBridge(SKILLSET))
    rig.run(1.0)
    assert rig.interface.state("flight_status") == "IN_AIR"
    assert rig.interface.state("zed_status") == "FAILED"


def test_a_failure_reads_as_one_chain_down_to_the_fault(rig: RobotRig) -> None:
    goal = rig.start("zed_depthmap")
    rig.layer.report_health("zed", SensorStatus.FAILED, "sim/health-7", cause="fault/zed/blackout")
    rig.end(goal)
    records = {record.id: record for record in rig.records}
    assert goal.record is not None
    chain: list[Record] = [records[goal.record]]
    while (cause := chain[-1].cause) is not None:
        chain.append(records[cause])
    kinds = [record.kind for record in chain]
    assert kinds[0] is RecordKind.GOAL
    assert kinds[-3:] == [RecordKind.RESOURCE, RecordKind.HEALTH, RecordKind.FAULT]
    assert [record.subject for record in chain[-3:]] == ["zed_status", "zed", "zed"]
    assert chain[-1].after == "blackout"


def test_the_same_fault_is_told_once(rig: RobotRig) -> None:
    for number, status in enumerate((SensorStatus.FAILED, SensorStatus.OK, SensorStatus.FAILED)):
        rig.layer.report_health("zed", status, f"health-{number}", cause="fault/zed/blackout")
        rig.run(0.1)
    assert [record.id for record in rig.records if record.kind is RecordKind.FAULT] == ["fault/zed/blackout"]


def test_telemetry_becomes_data_that_stay_fresh(rig: RobotRig) -> None:
    rig.layer.source = ObstacleSource.ZED
    rig.layer.position, rig.layer.heading = (1.0, 2.0, 3.0), 0.5
    rig.run(3.0)
    values = {}
    for item in SKILLSET.data:
        reading = rig.interface.reading(item.name)
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


def test_a_measurement_that_is_not_renewed_turns_stale(rig: RobotRig) -> None:
    rig.layer.source = ObstacleSource.ZED
    rig.run(1.0)
    rig.layer.measures = False
    rig.run(1.0)
    assert rig.interface.reading("obstacle_distance").stale
    assert not rig.interface.reading("position").stale


def test_what_cannot_be_read_is_dropped(rig: RobotRig) -> None:
    bus = rig.network.bus("vandal")
    for key in (
        "fl/flight",
        "fl/health/zed",
        "fl/battery",
        "fl/navigation",
        "fl/mapping/map",
        "m600/resource/verdict/goto",
    ):
        bus.advertise(key, events=True).put(b"\xc1 nonsense", b"\xc1")
    rig.run(1.0)
    assert rig.interface.state("SDK_authority") == "AVAILABLE"
    assert not rig.interface.reading("position").stale
