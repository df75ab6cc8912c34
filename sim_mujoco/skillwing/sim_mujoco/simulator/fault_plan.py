"""Which faults are to be switched when and where."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from skillwing.sim_mujoco.camera.feed import CAMERA
from skillwing.sim_mujoco.frames.vectors import Vector
from skillwing.sim_mujoco.sensors.corruptors import KINDS, Fault, UnknownFaultError
from skillwing.sim_mujoco.sensors.fittings import SENSORS
from skillwing.sim_mujoco.simulator.rotor_faults import ROTOR_NAMES, check_rotor_fault

ROTOR = "rotor/"


def check_fault(sensor: str, kind: str) -> None:
    """Raises UnknownFaultError for a sensor, a rotor or a kind of fault that does not exist."""
    if sensor.startswith(ROTOR):
        check_rotor_fault(sensor, kind)
    elif sensor not in (*SENSORS, CAMERA):
        raise UnknownFaultError("sensor", sensor, (*SENSORS, CAMERA, *ROTOR_NAMES))
    elif kind not in KINDS:
        raise UnknownFaultError("kind of fault", kind, KINDS)


class FaultPlan:
    """Faults that come and go with time and place. What was switched by hand meanwhile stays as it is."""

    def __init__(self, faults: Iterable[Fault]) -> None:
        """Raises UnknownFaultError."""
        self._faults = tuple(faults)
        self._on = [False] * len(self._faults)
        for fault in self._faults:
            check_fault(fault.sensor, fault.kind)

    @property
    def is_empty(self) -> bool:
        """Nothing will ever be switched."""
        return not self._faults

    def switches(self, t: float, position: Vector) -> Iterator[tuple[Fault, bool]]:
        """The faults that have to be switched on (True) or off at `t`, with the drone at `position`."""
        for k, fault in enumerate(self._faults):
            wanted = fault.is_wanted(t, position)
            if wanted is not self._on[k]:
                self._on[k] = wanted
                yield fault, wanted
