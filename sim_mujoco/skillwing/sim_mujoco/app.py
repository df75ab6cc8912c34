"""Factories that process tables name: from an options dictionary to a node.

Engines are imported inside the factories, so that the guidance process carries neither MuJoCo nor Embree.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeVar

import msgspec

if TYPE_CHECKING:
    from .guidance_node import GuidanceNode
    from .sim_node import SimNode

Vector3 = tuple[float, float, float]
S = TypeVar("S", bound=msgspec.Struct)


class FaultOptions(msgspec.Struct, frozen=True, forbid_unknown_fields=True, rename={"duration": "for"}):
    """A scheduled fault: `{"sensor": "zed", "kind": "blackout", "at": 60.0}`, optionally with `for` seconds."""

    sensor: str
    kind: str
    at: float = 0.0
    duration: float | None = None
    magnitude: float | None = None


class SimOptions(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Options of `make_sim`. `factor` is the pace that the clock announces; `authority` is who has it at the start."""

    seed: int = 1
    world: str = "courtyard"
    faults: tuple[FaultOptions, ...] = ()
    wind: Vector3 = (0.0, 0.0, 0.0)
    battery: float = 100.0
    factor: float = 1.0
    authority: bool = True
    sensors: tuple[str, ...] = ("zed", "lidar", "imu", "range")


class FenceOptions(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    low: Vector3
    high: Vector3


class GuidanceOptions(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Options of `make_guidance`. Without a geofence that of the courtyard holds."""

    geofence: FenceOptions | None = None


class OptionsError(ValueError):
    """Options that do not fit a node; `str()` says which and why."""


def make_sim(options: dict[str, Any]) -> SimNode:
    """The simulator node. Raises OptionsError."""
    from .corruptors import Fault, UnknownFaultError  # noqa: PLC0415
    from .sim_node import SimNode  # noqa: PLC0415
    from .simulator import Simulator  # noqa: PLC0415
    from .world import make_world  # noqa: PLC0415

    wanted = _read(options, SimOptions)
    faults = [Fault(f.sensor, f.kind, f.at, f.duration, f.magnitude) for f in wanted.faults]
    try:
        simulator = Simulator(
            make_world(wanted.seed, wanted.world),
            faults=faults,
            wind=wanted.wind,
            battery_percent=wanted.battery,
            sensors=wanted.sensors,
        )
    except (UnknownFaultError, ValueError) as error:
        raise OptionsError(str(error)) from error
    simulator.autopilot.authority = wanted.authority
    return SimNode(simulator, wanted.factor)


def make_guidance(options: dict[str, Any]) -> GuidanceNode:
    """The guidance node. Raises OptionsError."""
    from .geofence import COURTYARD_FENCE, Box  # noqa: PLC0415
    from .guidance import GuidanceCore  # noqa: PLC0415
    from .guidance_node import GuidanceNode  # noqa: PLC0415

    wanted = _read(options, GuidanceOptions).geofence
    return GuidanceNode(GuidanceCore(Box(wanted.low, wanted.high) if wanted else COURTYARD_FENCE))


def _read(options: dict[str, Any], kind: type[S]) -> S:
    try:
        return msgspec.convert(options, kind)
    except msgspec.ValidationError as error:
        known = ", ".join(field.encode_name for field in msgspec.structs.fields(kind))
        raise OptionsError(f"these options do not fit: {error}; known are {known}") from error
