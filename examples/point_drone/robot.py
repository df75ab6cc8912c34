"""The M600's skills, managers, bridge and guidance, unchanged, on another vehicle in wall time."""

from __future__ import annotations

from typing import Any

from skillwing.m600.generated.processes import HOOKS, SKILLSET
from skillwing.services.robot import ProcessSpec, Robot

FENCE = {"low": [-50.0, -50.0, 0.0], "high": [50.0, 50.0, 40.0]}


def functional_layer(options: dict[str, Any]) -> tuple[ProcessSpec, ...]:
    """The vehicle in place of the simulator. It has no sensors, so there are no depth maps, no map and no video.

    An existing vehicle, on a computer of its own, would not be listed here: it only has to reach the router.
    """
    return (
        # A new one would begin on the ground at the origin, wherever the old one was.
        ProcessSpec("vehicle", "point_drone.node:make_vehicle", restart="never"),
        ProcessSpec("guidance", "skillwing.onboard.guidance.node:make_guidance", {"geofence": FENCE}),
        ProcessSpec("bridge", "skillwing.m600.bridge.node:make_bridge", {"skillset": str(SKILLSET)}),
    )


ROBOT = Robot(
    name="point_drone",
    skillset=SKILLSET,
    hooks=HOOKS,
    functional_layer=functional_layer,
    clock="wall",
)
