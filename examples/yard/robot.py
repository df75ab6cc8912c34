"""The table of the yard: a resource manager for places, the managers of the leases, and the watch of the places."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from skillwing.services.robot import ProcessSpec, Robot

SKILLSET = Path(__file__).with_name("yard.skillset")
ROBOTS = {"left": "m600", "right": "m600"}
"""The robots of the yard: name of the skillset of each."""
PLACES = {"pad": [-2.0, -2.0, 2.0, 2.0], "corridor": [2.0, -2.0, 12.0, 2.0], "charger": [-12.0, -2.0, -8.0, 2.0]}
"""Borders of the places in m, ENU: west, south, east, north."""
HOOKS = {
    "hold_pad": "yard.holds:HoldPad",
    "hold_corridor": "yard.holds:HoldCorridor",
    "hold_way": "yard.holds:HoldWay",
    "hold_charger": "yard.holds:HoldCharger",
}


def functional_layer(options: dict[str, Any]) -> tuple[ProcessSpec, ...]:
    """The watch of the places. options: `places` for others than these."""
    given = {"skillset": str(SKILLSET), "places": options.get("places", PLACES), "robots": ROBOTS}
    return (ProcessSpec("places", "yard.watch:make_places", given, essential=False),)


ROBOT = Robot(name="yard", skillset=SKILLSET, hooks=HOOKS, functional_layer=functional_layer, clock="wall", shared=True)
