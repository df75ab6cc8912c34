"""Latest readings of the robot's data, and of their fields."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, cast

from skillwing.bt_missions.leaves.blackboard_entry import MissingValueError
from skillwing.bt_missions.leaves.context import MissionContext


def read_latest(context: MissionContext, datum: str, fields: Sequence[str] = ()) -> Any:
    """The latest value of a datum, or of a field of it. Raises MissingValueError if it is stale or not known."""
    path = ".".join([datum, *fields])
    if context.absence:
        raise MissingValueError(f"{path} is not known: {context.absence}")
    reading = context.interface.reading(datum)
    if reading.stale:
        raise MissingValueError(f"{path} is not known" if reading.t is None else f"{path} is stale")
    found: Any = reading.value
    for field in fields:
        found = cast(Mapping[str, Any], found)[field]
    return found


class LatestReading:
    """Input of a skill: the latest reading of a datum at its start. `position.x` names a field of a datum.

    The leaf fails if the reading is stale or not known then. robot: its name, in a mission on several robots.
    """

    def __init__(self, context: MissionContext, path: str, *, robot: str | None = None) -> None:
        self._context = context.of(robot)
        self.robot = self._context.robot
        self.skillset = self._context.skillset
        self.datum, *self.fields = path.split(".")

    @property
    def path(self) -> str:
        return ".".join([self.datum, *self.fields])

    def __call__(self) -> Any:
        """The value now. Raises MissingValueError."""
        return read_latest(self._context, self.datum, self.fields)
