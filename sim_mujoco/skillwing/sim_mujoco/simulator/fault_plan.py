"""Which faults the simulated drone can have, and when and where they are to be switched."""

from __future__ import annotations

from collections.abc import Iterable

from skillwing.sim_mujoco.camera.feed import CAMERA
from skillwing.sim_mujoco.physics.rotor_faults import ROTOR_NAMES, check_rotor_fault
from skillwing.sim_mujoco.sensors.corruptors import Fault, UnknownFaultError, check_kind
from skillwing.sim_mujoco.sensors.fault_schedule import FaultSchedule
from skillwing.sim_mujoco.sensors.fittings import FITTINGS, SENSORS

ROTOR = "rotor/"


def check_fault(sensor: str, kind: str, magnitude: float | None = None) -> None:
    """Raises UnknownFaultError for a sensor, a rotor or a kind of fault that does not exist, MagnitudeError for a
    magnitude that its kind of fault cannot have."""
    if sensor.startswith(ROTOR):
        check_rotor_fault(sensor, kind, magnitude)
    elif sensor == CAMERA:
        check_kind(kind, magnitude)
    elif sensor in FITTINGS:
        check_kind(kind, magnitude, FITTINGS[sensor].largest)
    else:
        raise UnknownFaultError("sensor", sensor, (*SENSORS, CAMERA, *ROTOR_NAMES))


class FaultPlan(FaultSchedule):
    """The schedule of faults that the sensors and rotors of the drone can have."""

    def __init__(self, faults: Iterable[Fault]) -> None:
        """Raises UnknownFaultError and MagnitudeError."""
        super().__init__(faults)
        for fault in self._faults:
            check_fault(fault.sensor, fault.kind, fault.magnitude)
