"""The flight log keeps the map as the mapping node has it, also when a message of the stream was lost."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from skillwing.evaluation.judge.flight_log import FlightLog, read_flight, read_map
from skillwing.onboard.topics.mapping import MAP, MAP_SNAPSHOT, MAPPING_STATUS, MapHeader, MappingStatus
from skillwing.onboard.topics.truth import TRUTH, Truth
from skillwing.services.bus import Bus, Request
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.protocol import Keys, MissionPhase, MissionStatus, encode

A, B, C = (0.2, 0.2, 0.2), (0.6, 0.2, 0.2), (0.2, 1.4, 2.2)


def put_map(bus: Bus, *centres: tuple[float, float, float], complete: bool = False) -> None:
    header = MapHeader(t=bus.now(), voxel_size=0.4, count=len(centres), complete=complete)
    bus.advertise(MAP).put(np.array(centres, np.float32).tobytes(), encode(header))


def kept(run_dir: Path) -> list[tuple[float, ...]]:
    saved = read_map(run_dir)
    assert saved is not None
    return sorted(tuple(round(x, 3) for x in centre) for centre in saved.centres.tolist())


def opened(run_dir: Path) -> tuple[InProcessNetwork, FlightLog, Bus]:
    network, flight_log = InProcessNetwork(), FlightLog(run_dir)
    flight_log.attach(network.bus("recorder"))
    return network, flight_log, network.bus("drone")


def test_additions_and_whole_maps_are_kept(tmp_path: Path) -> None:
    network, flight_log, drone = opened(tmp_path)
    put_map(drone, A, B)
    put_map(drone, B, C)
    status = MappingStatus(t=0.0, running=True, diverged=False, scans=1, voxels=3, pose_source="simulated")
    drone.advertise(MAPPING_STATUS).put(encode(status))
    network.run_for(11.0)
    assert kept(tmp_path) == sorted([A, B, C])
    put_map(drone, A, complete=True)
    network.run_for(1.0)
    flight_log.close()
    assert kept(tmp_path) == [A]
    saved = read_map(tmp_path)
    assert saved is not None
    assert (saved.voxel_size, saved.pose_source) == (0.4, "simulated")


def test_at_the_end_the_whole_map_is_fetched(tmp_path: Path) -> None:
    network, flight_log, drone = opened(tmp_path)

    def answer(request: Request) -> None:
        header = MapHeader(t=0.0, voxel_size=0.4, count=2, complete=True)
        request.reply(np.array([A, C], np.float32).tobytes(), encode(header))

    drone.serve(MAP_SNAPSHOT, answer)
    put_map(drone, B)
    over = MissionStatus(mission="mapping", phase=MissionPhase.SUCCEEDED, t=0.0, text="done")
    drone.advertise(Keys("m600").mission_status, events=True).put(encode(over))
    network.run_for(1.0)
    assert kept(tmp_path) == sorted([A, C])
    flight_log.close()


@pytest.mark.parametrize(
    ("payload", "attachment"),
    [
        (b"", b"\xc1"),
        (b"too short", encode(MapHeader(t=0.0, voxel_size=0.4, count=2, complete=True))),
    ],
)
def test_a_whole_map_that_cannot_be_read_leaves_what_is_known(
    tmp_path: Path, payload: bytes, attachment: bytes
) -> None:
    network, flight_log, drone = opened(tmp_path)
    drone.serve(MAP_SNAPSHOT, lambda request: request.reply(payload, attachment))
    put_map(drone, A, B)
    over = MissionStatus(mission="mapping", phase=MissionPhase.SUCCEEDED, t=0.0, text="done")
    drone.advertise(Keys("m600").mission_status, events=True).put(encode(over))
    network.run_for(1.0)
    assert kept(tmp_path) == sorted([A, B])
    flight_log.close()


def test_truth_is_kept_line_by_line(tmp_path: Path) -> None:
    network, flight_log, drone = opened(tmp_path)
    truth = Truth(
        t=1.0,
        position=(1.0, 2.0, 3.0),
        quaternion=(1.0, 0.0, 0.0, 0.0),
        velocity=(0.0, 0.0, 0.0),
        collisions=0,
        clearance=2.5,
        inside_fence=True,
    )
    drone.advertise(TRUTH).put(encode(truth))
    network.run_for(0.1)
    assert read_flight(tmp_path) == [truth]
    flight_log.close()


def test_a_run_without_a_map_has_none(tmp_path: Path) -> None:
    network, flight_log, _ = opened(tmp_path)
    network.run_for(11.0)
    flight_log.close()
    assert read_map(tmp_path) is None
    assert read_flight(tmp_path) == []


def test_a_log_that_is_begun_again_has_the_map_of_before(tmp_path: Path) -> None:
    network, flight_log, drone = opened(tmp_path)
    put_map(drone, A)
    network.run_for(11.0)
    flight_log.close()
    network, flight_log, drone = opened(tmp_path)
    header = MapHeader(t=0.0, voxel_size=0.4, count=2, complete=True)
    drone.serve(MAP_SNAPSHOT, lambda request: request.reply(np.array([A, B], np.float32).tobytes(), encode(header)))
    put_map(drone, C)
    network.run_for(1.0)
    flight_log.close()
    assert {A, B} <= set(kept(tmp_path))
