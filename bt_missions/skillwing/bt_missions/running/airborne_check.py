"""Where a mission has found the drone, and where it leaves it."""

from __future__ import annotations

from skillwing.bt_missions.leaves.claims import taken_by
from skillwing.bt_missions.leaves.interface import RobotInterface
from skillwing.bt_missions.leaves.takeoff_and_landing import FLIGHT_STATUS, IN_AIR, LAND, flies, may_land
from skillwing.dsl.model import Skillset


class AirborneCheck:
    """What it tells, on a robot that flies; others are never in the air."""

    def __init__(self, interface: RobotInterface, skillset: Skillset) -> None:
        self._interface = interface
        self._skillset = skillset
        self._began_in_air = False

    def begin(self) -> None:
        """The mission begins: it may leave the drone in the air if it is there now."""
        self._began_in_air = self.is_in_air

    @property
    def leaves_drone_in_air(self) -> bool:
        """Whether the mission has brought the drone up and not down again, and could: no safety pilot has it."""
        return self.is_in_air and not self._began_in_air and may_land(self._skillset, self._interface.states)

    @property
    def nobody_flies(self) -> bool:
        """Whether the drone is in the air, no skill has hold of it, and it could be landed."""
        states = self._interface.states
        if not self.is_in_air or not may_land(self._skillset, states):
            return False
        return not any(states.get(resource) == state for resource, state in taken_by(self._skillset, LAND).items())

    @property
    def is_in_air(self) -> bool:
        """As far as is known here."""
        return flies(self._skillset) and self._interface.state(FLIGHT_STATUS) == IN_AIR
