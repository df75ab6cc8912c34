"""Publisher of a mission: its status, its tree, and its records in the timeline."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType

from msgspec.structs import replace
from py_trees.behaviour import Behaviour

from skillwing.bt_missions.leaves.context import RecordWriter
from skillwing.bt_missions.mission.mission import Progress
from skillwing.bt_missions.running.tree_snapshot import SnapshotBuilder
from skillwing.services.bus import Bus
from skillwing.services.protocol import Keys, MissionPhase, MissionStatus, RecordKind, TreeSnapshot, encode
from skillwing.services.timeline import Timeline

_log = logging.getLogger(__name__)


class MissionPublisher:
    """Publishes for one mission: records to each of its robots, status and tree to those that it occupies. `status` is
    the latest that was published; each one goes to `on_status` too. Times are those of the first robot.

    rescue, request_id: as in the status. keys: of the robots, by name. occupied: names of those that no other mission
    may use.
    """

    rescue = ""

    def __init__(
        self,
        mission: str,
        keys: Mapping[str, Keys],
        occupied: Sequence[str],
        on_status: Callable[[MissionStatus], None],
        request_id: str = "",
    ) -> None:
        self.status = MissionStatus(
            mission=mission, phase=MissionPhase.IDLE, t=0.0, text="not started", request_id=request_id
        )
        self._keys = dict(keys)
        self._occupied = tuple(occupied)
        self._on_status = on_status
        self._latest_progress = Progress()
        self._progress_fails = False

    def attach(self, buses: Mapping[str, Bus]) -> None:
        self._buses = dict(buses)
        keys = self._keys
        self._timelines = {name: Timeline(bus, keys[name]) for name, bus in buses.items()}
        here = self._occupied
        self._status_out = {name: buses[name].advertise(keys[name].mission_status, events=True) for name in here}
        self._tree_out = {name: buses[name].advertise(keys[name].mission_tree, events=True) for name in here}

    def show(self, tree: Behaviour, progress: Callable[[], Progress]) -> None:
        """Publish this tree and this progress from now on."""
        self._tree = SnapshotBuilder(tree)
        self._progress = progress

    @property
    def progress(self) -> Progress:
        """Progress as the mission tells it; the latest one if its function raises, which is logged once."""
        try:
            self._latest_progress = self._progress()
        except Exception as error:  # noqa: BLE001 - a wrong text must not end a running mission
            if not self._progress_fails:
                words = "The function `progress` of the mission raised; its latest result is published."
                _log.error(words, exc_info=error)
            self._progress_fails = True
        return self._latest_progress

    def records(
        self, subject: str, before: str | None, after: str, text: str, causes: Mapping[str, str | None]
    ) -> dict[str, str]:
        """Write a record of kind MISSION to the timeline of each robot; returns its id in each. A cause is a record of
        the same robot."""
        return {
            name: timeline.record(RecordKind.MISSION, subject, before, after, text=text, cause=causes.get(name))
            for name, timeline in self._timelines.items()
        }

    def writer(self, robot: str) -> RecordWriter:
        """Function that writes such a record for the leaves of one robot."""

        def write(subject: str, before: str | None, after: str, text: str, cause: str | None) -> str:
            return self.records(subject, before, after, text, {robot: cause})[robot]

        return write

    # --- status

    def enter(
        self, phase: MissionPhase, text: str, causes: Mapping[str, str | None] = MappingProxyType({})
    ) -> Mapping[str, str]:
        """Publish another phase, and record it in the timelines. Returns the ids of the records."""
        records = self.records(self.status.mission, self.status.phase, phase, text, causes)
        self.publish(phase, text)
        return records

    def publish(self, phase: MissionPhase, text: str) -> None:
        progress = self.progress
        self.status = MissionStatus(
            mission=self.status.mission,
            phase=phase,
            t=self._now(),
            text=text,
            rescue=self.rescue,
            waypoint=progress.waypoint,
            waypoints=progress.waypoints,
            goal=progress.goal,
            request_id=self.status.request_id,
        )
        for name, out in self._status_out.items():
            out.put(encode(replace(self.status, t=self._buses[name].now())))
        self._on_status(self.status)

    def publish_if_changed(self, phase: MissionPhase, text: str) -> None:
        """Publish the text and progress of a phase if they differ from the latest status."""
        progress = self.progress
        if (text, progress.waypoint, progress.goal) != (self.status.text, self.status.waypoint, self.status.goal):
            self.publish(phase, text)

    # --- tree

    @property
    def snapshot(self) -> TreeSnapshot:
        """The latest tree that was published."""
        return TreeSnapshot(mission=self.status.mission, t=self._now(), nodes=self._tree.nodes)

    def publish_tree(self) -> bool:
        """Publish the tree if it has changed. Returns True if it has."""
        if not self._tree.update():
            return False
        for name, out in self._tree_out.items():
            out.put(encode(replace(self.snapshot, t=self._buses[name].now())))
        return True

    def _now(self) -> float:
        return next(iter(self._buses.values())).now()
