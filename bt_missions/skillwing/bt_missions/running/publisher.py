"""Publisher of a mission: its status, its tree, and its records in the timeline."""

from __future__ import annotations

from collections.abc import Callable

from py_trees.behaviour import Behaviour

from skillwing.bt_missions.mission.mission import Progress
from skillwing.bt_missions.running.tree_snapshot import SnapshotBuilder
from skillwing.services.bus import Bus, Publisher
from skillwing.services.protocol import Keys, MissionPhase, MissionStatus, RecordKind, TreeSnapshot, encode
from skillwing.services.timeline import Timeline


class MissionPublisher:
    """Publishes for one mission. `status` is the latest that was published; each one goes to `on_status` too.

    rescue: as in the status.
    """

    rescue = ""

    def __init__(self, mission: str, keys: Keys, on_status: Callable[[MissionStatus], None]) -> None:
        self.status = MissionStatus(mission=mission, phase=MissionPhase.IDLE, t=0.0, text="not started")
        self._keys = keys
        self._on_status = on_status

    def attach(self, bus: Bus) -> None:
        self._bus = bus
        self._timeline = Timeline(bus, self._keys)
        self._status_out: Publisher = bus.advertise(self._keys.mission_status, events=True)
        self._tree_out: Publisher = bus.advertise(self._keys.mission_tree, events=True)

    def show(self, tree: Behaviour, progress: Callable[[], Progress]) -> None:
        """Publish this tree and this progress from now on."""
        self._tree = SnapshotBuilder(tree)
        self._progress = progress

    def record(self, subject: str, before: str | None, after: str, text: str, cause: str | None) -> str:
        """Write a record of kind MISSION to the timeline; returns its id. A `RecordWriter` for leaves."""
        return self._timeline.record(RecordKind.MISSION, subject, before, after, text=text, cause=cause)

    # --- status

    def enter(self, phase: MissionPhase, text: str, cause: str | None = None) -> str:
        """Publish another phase, and record it in the timeline. Returns the id of the record."""
        record = self.record(self.status.mission, self.status.phase, phase, text, cause)
        self.publish(phase, text)
        return record

    def publish(self, phase: MissionPhase, text: str) -> None:
        progress = self._progress()
        self.status = MissionStatus(
            mission=self.status.mission,
            phase=phase,
            t=self._bus.now(),
            text=text,
            rescue=self.rescue,
            waypoint=progress.waypoint,
            waypoints=progress.waypoints,
            goal=progress.goal,
        )
        self._status_out.put(encode(self.status))
        self._on_status(self.status)

    def publish_if_changed(self, phase: MissionPhase, text: str) -> None:
        """Publish the text and progress of a phase if they differ from the latest status."""
        progress = self._progress()
        if (text, progress.waypoint, progress.goal) != (self.status.text, self.status.waypoint, self.status.goal):
            self.publish(phase, text)

    # --- tree

    @property
    def snapshot(self) -> TreeSnapshot:
        """The latest tree that was published."""
        return TreeSnapshot(mission=self.status.mission, t=self._bus.now(), nodes=self._tree.nodes)

    def publish_tree(self) -> bool:
        """Publish the tree if it has changed. Returns True if it has."""
        if not self._tree.update():
            return False
        self._tree_out.put(encode(self.snapshot))
        return True
