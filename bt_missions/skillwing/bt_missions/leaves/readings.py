"""Latest readings of the robot's data, and of their fields."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, cast

from skillwing.bt_missions.leaves.blackboard_entry import MissingValueError
from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.leaves.interface import RobotInterface


def read_latest(interface: RobotInterface, datum: str, fields: Sequence[str] = ()) -> Any:
    """The latest value of a datum, or of a field of it. Raises MissingValueError if it is stale or not known."""
    path = ".".join([datum, *fields])
    reading = interface.reading(datum)
    if reading.stale:
        raise MissingValueError(f"{path} is not known" if reading.t is None else f"{path} is stale")
    found: Any = reading.value
    for field in fields:
        found = cast(Mapping[str, Any], found)[field]
    return found


class LatestReading:
    """Input of a skill: the latest reading of a datum at its start. `position.x` names a field of a datum.

    The leaf fails if the reading is stale or not known then.
    """

    def __init__(self, context: MissionContext, path: str) -> None:
        self._context = context
        self.datum, *self.fields = path.split(".")

    @property
    def path(self) -> str:
        return ".".join([self.datum, *self.fields])

    def __call__(self) -> Any:
        """The value now. Raises MissingValueError."""
        return read_latest(self._context.interface, self.datum, self.fields)
