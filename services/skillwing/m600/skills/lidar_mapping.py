"""The manager of `lidar_mapping`."""

from __future__ import annotations

from skillwing.m600.generated.managers import AbstractLidarMappingManager
from skillwing.m600.generated.types import LidarMappingFeedback, LidarMappingInputs
from skillwing.m600.keys import KEYS
from skillwing.m600.latest import Latest
from skillwing.m600.skills.switch import Switch
from skillwing.onboard.topics.mapping import MAPPING_COMMAND, MAPPING_STATUS, ControlMapping, MappingStatus
from skillwing.services.bus import Handle
from skillwing.services.managers.skill_manager import Goal
from skillwing.services.protocol import RecordKind, Terminal
from skillwing.services.timeline import Timeline

PATIENCE = 4.0
"""Time without a status after which the goal fails [s]."""
UNDER_WAY = 1.0
"""Time after switching the node on in which a status may still be an old one [s]."""


class LidarMappingManager(AbstractLidarMappingManager):
    """Mapping by the mapping node until the skill ends. The map outlives the goal."""

    def setup(self) -> None:
        self.mapping = Switch(self, MAPPING_COMMAND, _control, node="mapping node")
        self.status = Latest(self.bus, MAPPING_STATUS, MappingStatus, self._on_status)
        self._watchdog: Handle | None = None
        self._timeline = Timeline(self.bus, KEYS)
        self._given_up = ""

    def on_dispatch(self, goal: Goal[LidarMappingInputs]) -> None:
        dispatched_at = self.bus.now()
        self._watchdog = self.bus.every(PATIENCE / 4, lambda: self._watch(goal, dispatched_at))
        self.mapping.on(goal)

    def progress(self, goal: Goal[LidarMappingInputs]) -> LidarMappingFeedback | None:
        status = self.status.value
        return None if status is None else LidarMappingFeedback(voxels=status.voxels)

    def on_interrupt(self, goal: Goal[LidarMappingInputs]) -> None:
        self.mapping.off(goal)

    def on_ended(self, goal: Goal[LidarMappingInputs], terminal: Terminal) -> None:
        if self._watchdog is not None:
            self._watchdog.cancel()
        self.mapping.release(goal)

    def _on_status(self, status: MappingStatus) -> None:
        goal, on_since = self.current, self.mapping.on_since
        if goal is None or goal.id == self._given_up:
            return
        if status.running and status.diverged:
            self._given_up = goal.id
            record = self._timeline.record(RecordKind.HEALTH, "map", None, "DIVERGED", text=status.text)
            self.terminated_DIVERGED(goal.id, cause=record, why=status.text)
        elif not status.running and on_since is not None and status.t > on_since + UNDER_WAY:
            self._given_up = goal.id
            self.failed(goal.id, "The mapping node was started again, and has lost the map. Start the skill again.")

    def _watch(self, goal: Goal[LidarMappingInputs], dispatched_at: float) -> None:
        if self.bus.now() - dispatched_at >= PATIENCE and not self.status.is_fresh(PATIENCE):
            self.failed(goal.id, f"The mapping node has not reported for {PATIENCE:g} s. Check that its process runs.")


def _control(goal: Goal[LidarMappingInputs], on: bool) -> ControlMapping:
    return ControlMapping(goal_id=goal.id, token=goal.token, run=on)
