"""Fence, bounds and occlusion zone of the chosen site, as the launching side hands them to the nodes."""

from __future__ import annotations

import pytest

from skillwing.onboard.frames.extent import Box
from skillwing.onboard.guidance.limits import GuidanceLimits
from skillwing.onboard.guidance.node import make_guidance
from skillwing.onboard.mapping.node import MappingOptions
from skillwing.onboard.topics import guidance
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.bus.reading import message_reader
from skillwing.services.options import OptionsError, read_options
from skillwing.sim_mujoco.launching import guidance_options, mapping_options
from skillwing.sim_mujoco.link.node import make_link
from skillwing.sim_mujoco.world.kinds import KINDS, make_site


@pytest.mark.parametrize("kind", KINDS)
def test_guidance_keeps_to_the_fence_and_the_map_to_the_bounds_of_the_chosen_site(kind: str) -> None:
    network, site, chosen = InProcessNetwork(), make_site(4, kind), {"site": {"seed": 4, "kind": kind}}
    network.attach(make_guidance(guidance_options(chosen)))
    told: list[guidance.Geofence] = []
    network.bus("listener").subscribe(guidance.GEOFENCE, message_reader(guidance.Geofence, told.append), events=True)
    network.run_for(0.1)
    assert [Box(targets.low, targets.high) for targets in told] == [GuidanceLimits(site.fence).targets]
    wanted = read_options(mapping_options(chosen), MappingOptions)
    assert Box(wanted.low, wanted.high) == site.bounds


def test_a_corner_that_is_given_counts_before_that_of_the_site() -> None:
    wanted = mapping_options({"site": {"kind": "village"}, "low": [-1.0, -2.0, -3.0]})
    assert wanted == {"low": [-1.0, -2.0, -3.0], "high": make_site(1, "village").bounds.high}


def test_only_a_site_with_a_building_shadows_the_link() -> None:
    assert make_link({"site": {"kind": "inspection"}, "shadow": True}).name == "link"
    for site in ({}, {"site": {"kind": "street"}}):
        with pytest.raises(OptionsError, match="no building to occlude the link"):
            make_link({**site, "shadow": True})


def test_a_site_that_there_is_not_is_refused() -> None:
    with pytest.raises(OptionsError, match="known are courtyard"):
        guidance_options({"site": {"kind": "moon"}})
