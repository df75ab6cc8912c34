"""The end of the depth map during a motion, as the manager of a motion hears of it."""

from __future__ import annotations

from faulty_network import FaultyNetwork, NetworkConditions
from skillwing.m600.keys import KEYS
from skillwing.m600.skills.view_loss import NO_SOURCE, SOURCE, ViewLoss
from skillwing.services.bus import Publisher
from skillwing.services.protocol import Record, RecordKind, ResourceStep, encode


class Steps:
    """A resource manager by hand, which tells of changes of the depth map's source."""

    def __init__(self, network: FaultyNetwork) -> None:
        self._network = network
        self._publisher: Publisher = network.join("resource_manager").advertise(KEYS.resource_steps, events=True)
        self._number = 0

    def change(self, after: str) -> str:
        """Publish a change, and return the id of its record."""
        self._number += 1
        t, record = self._network.now(), f"rm#{self._number}"
        change = Record(id=record, t=t, source="rm", kind=RecordKind.RESOURCE, subject=SOURCE, before="", after=after)
        self._publisher.put(encode(ResourceStep(number=self._number, t=t, records=(change,))))
        return record


def test_the_latest_end_of_the_depth_map_since_the_start_of_the_motion_counts() -> None:
    network = FaultyNetwork()
    steps, view = Steps(network), ViewLoss(network.join("skill"))
    steps.change(NO_SOURCE)
    network.run_for(1.0)
    view.follow()
    network.run_for(1.0)
    assert view.record is None
    for source in (NO_SOURCE, "LIDAR"):
        steps.change(source)
        network.run_for(1.0)
    assert view.record is None, "there is a depth map again"
    end = steps.change(NO_SOURCE)
    network.run_for(1.0)
    assert view.record == end


def test_a_lost_step_is_recalled_without_those_from_before_the_motion() -> None:
    network = FaultyNetwork(conditions=NetworkConditions(loss=1.0))
    steps, view = Steps(network), ViewLoss(network.join("skill"))
    steps.change(NO_SOURCE)
    network.run_for(1.0)
    view.follow()
    view.recall()
    network.run_for(1.0)
    assert view.record is None
    view.follow()
    view.rest()
    view.follow()
    steps.change("LIDAR")
    end = steps.change(NO_SOURCE)
    network.run_for(1.0)
    assert view.record is None, "the steps are lost"
    view.recall()
    network.run_for(1.0)
    assert view.record == end
    view.rest()
    assert view.record is None
