"""Faults of rotors, which are called `rotor/1` to `rotor/6`.

Rotor 1 is ahead on the left; they are counted counter-clockwise as seen from above.
"""

from __future__ import annotations

from skillwing.sim_mujoco.sensors.faults import UnknownFaultError, check_magnitude, check_no_magnitude

ROTORS = 6
ROTOR = "rotor/"
ROTOR_NAMES = tuple(f"{ROTOR}{number}" for number in range(1, ROTORS + 1))
STOPPED, WEAK = "stopped", "weak"
ROTOR_FAULTS = (STOPPED, WEAK)
_USUALLY_LEFT = 0.5


class RotorFaults:
    """Share of the commanded thrust that each rotor gives."""

    def __init__(self) -> None:
        self.shares = [1.0] * ROTORS
        self._active: dict[str, dict[str, float]] = {name: {} for name in ROTOR_NAMES}

    def switch(self, name: str, kind: str, on: bool, magnitude: float | None = None) -> None:
        """Stop a rotor, weaken it to the share `magnitude` of its thrust (half by default), or end that.

        Raises UnknownFaultError and MagnitudeError.
        """
        check_rotor_fault(name, kind, magnitude)
        active = self._active[name]
        if not on:
            active.pop(kind, None)
        elif kind == STOPPED:
            active[kind] = 0.0
        else:
            active[kind] = _USUALLY_LEFT if magnitude is None else magnitude
        self.shares[ROTOR_NAMES.index(name)] = min(active.values(), default=1.0)

    def active(self, name: str) -> tuple[str, ...]:
        """Kinds of fault that a rotor has now."""
        return tuple(self._active[name])


def check_rotor_fault(name: str, kind: str, magnitude: float | None = None) -> None:
    """Raise UnknownFaultError for a rotor or a kind that does not exist, MagnitudeError for a wrong magnitude.

    A weak rotor has a share from 0 to 1; a stopped one has no magnitude.
    """
    if name not in ROTOR_NAMES:
        raise UnknownFaultError("rotor", name, ROTOR_NAMES)
    if kind not in ROTOR_FAULTS:
        raise UnknownFaultError("kind of rotor fault", kind, ROTOR_FAULTS)
    if kind == WEAK:
        check_magnitude(kind, magnitude, 0.0, 1.0)
    else:
        check_no_magnitude(kind, magnitude)
