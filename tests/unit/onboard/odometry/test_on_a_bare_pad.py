"""Odometry where little is in sight: on the pad of the courtyard that shows the fewest planes of a hundred."""

from __future__ import annotations

from skillwing.onboard.mapping.node import make_mapping
from skillwing.onboard.topics import mapping
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.protocol import decode, encode
from skillwing.sim_mujoco.launching import mapping_options
from skillwing.sim_mujoco.simulator.node import make_sim

BAREST = 39
"""Seed, of 0 to 99, of the courtyard where the fewest points of a scan lie on planes: about 50."""


def test_few_points_on_planes_are_no_divergence() -> None:
    network = InProcessNetwork()
    network.attach(make_sim({"seed": BAREST, "sensors": ["lidar", "imu", "gnss"]}))
    network.attach(make_mapping(mapping_options({})))
    bus = network.bus("pilot")
    states: list[mapping.MappingStatus] = []
    bus.subscribe(mapping.MAPPING_STATUS, lambda sample: states.append(decode(sample.payload, mapping.MappingStatus)))
    command = mapping.ControlMapping(goal_id="map", token=1, run=True)
    bus.ask(mapping.MAPPING_COMMAND, encode(command), lambda answer: None)
    assert network.run_until(lambda: bool(states) and states[-1].scans > 20, 6.0)
    assert not any(status.diverged for status in states), states[-1].text
