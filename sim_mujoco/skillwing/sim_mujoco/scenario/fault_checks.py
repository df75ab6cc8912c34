"""Checks of a scenario against the simulated drone: sensors, rotors, libraries. Loads neither MuJoCo nor Embree."""

from __future__ import annotations

from collections.abc import Iterator
from typing import cast

from skillwing.onboard.sensor_data.names import CAMERA
from skillwing.onboard.topics.common import LARGEST_COMPONENT
from skillwing.onboard.topics.mapping import Poses
from skillwing.sim_mujoco.physics.rotor_faults import ROTOR, ROTOR_NAMES, check_rotor_fault
from skillwing.sim_mujoco.sensors.faults import UnknownFaultError, check_kind
from skillwing.sim_mujoco.sensors.table import SENSORS


def check_fault(sensor: str, kind: str, magnitude: float | None = None) -> None:
    """Raise UnknownFaultError for a sensor, rotor or kind of fault that does not exist, MagnitudeError for a magnitude
    that the kind cannot have."""
    if sensor.startswith(ROTOR):
        check_rotor_fault(sensor, kind, magnitude)
    elif sensor == CAMERA:
        check_kind(kind, magnitude)
    elif sensor in SENSORS:
        check_kind(kind, magnitude, SENSORS[sensor].largest)
    else:
        raise UnknownFaultError("sensor", sensor, (*SENSORS, CAMERA, *ROTOR_NAMES))


def fault_errors(content: object) -> Iterator[str]:
    """A clause for each impossible fault of a scenario, whatever other errors it has."""
    match content:
        case {"fault": [*faults]}:
            pass
        case _:
            return
    for number, fault in enumerate(cast("list[object]", faults), 1):
        match fault:
            case {"sensor": "link"}:
                yield f"fault {number}: the link is no sensor; write its faults as `[[link.faults]]`"
            case {"sensor": str(sensor), "kind": str(kind), **rest}:
                try:
                    check_fault(sensor, kind, _magnitude(rest.get("magnitude")))
                except ValueError as error:
                    yield f"fault {number}: {error}"
            case _:
                pass


def _magnitude(value: object) -> float | None:
    """A value that is a magnitude at all; the format reports all others."""
    return value if isinstance(value, int | float) and abs(value) <= LARGEST_COMPONENT else None


def require_library(poses: Poses | None) -> None:
    """Raise MissingLibraryError for poses that need a library which is not installed."""
    if poses == "small-gicp":
        from skillwing.onboard.odometry.gicp import gicp_matcher  # noqa: PLC0415 - loads all of odometry

        gicp_matcher()
