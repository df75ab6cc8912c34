"""The recorder: a process that listens to a run and writes its files.

It always writes `timeline.jsonl`, `goals.jsonl` and `missions.jsonl`. With Rerun it also writes `recording.rrd`, and
can show the run live. No other process waits for it. Its memory does not grow with the run, and its files have numbered
parts, of which it deletes the oldest ones. A full disk costs what would have been written meanwhile.

A recorder that starts again with the same run directory reads the latest parts and continues them. It draws into a new
part of the recording, which a viewer shows as one with the first.
"""

from __future__ import annotations

import logging
import os
import time
from collections import deque
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from skillwing.dsl import load
from skillwing.dsl.model import Skillset
from skillwing.services.bus import Bus
from skillwing.services.bus.reading import message_reader
from skillwing.services.client.causal_feed import follow_records
from skillwing.services.disk import has_room
from skillwing.services.errors import BadRecordingError
from skillwing.services.history.files import (
    GOALS_FILE,
    MISSIONS_FILE,
    TIMELINE_FILE,
    UNBOUNDED,
    JsonLines,
    M,
    last_parts,
)
from skillwing.services.history.goal_ends import status_of_loss
from skillwing.services.history.history import PHASES
from skillwing.services.history.mission_intervals import writer_of
from skillwing.services.history.recent_history import RecentHistory
from skillwing.services.history.recording_state import Gap, gap_sentence
from skillwing.services.names import MISSION, RESOURCE_MANAGER
from skillwing.services.protocol import (
    GoalStatus,
    Keys,
    MissionPhase,
    MissionStatus,
    Record,
    RecordKind,
    TreeSnapshot,
)
from skillwing.services.recording.options import RecorderOptions, part, read_options
from skillwing.services.recording.recording_lock import RecordingLock
from skillwing.services.recording.retention import RECORDING_FILE, RECORDING_PARTS, Retention, part_bytes
from skillwing.services.recording.upkeep import Upkeep
from skillwing.services.timeline import Timeline

if TYPE_CHECKING:
    from skillwing.services.recording.rerun_stream import Recording

CHECK_PERIOD = 1.0
"""Wall seconds between two checks of the files."""
RETENTION_CHECKS = 10
"""Checks between two deletions of old parts."""
PHASES_KEPT = 1000
"""Phases of missions for the next part of their file, of those that a full disk took."""
RERUN_ENVIRONMENT = {"RUST_LOG": "warn,re_log_encoding=error", "MIMALLOC_PURGE_DELAY": "0"}
"""Settings of Rerun, unless the user has others. It warns of each file without an index, which is intended. Its
allocator would keep the pages of peaks in use: 12 bytes for each message, without an end in sight."""
WRITES, FAILS = "RECORDING", "FAILED"
"""States of the recorder in the timeline."""

log = logging.getLogger("skillwing.recorder")


class Collector(Protocol):
    """A further writer into the run directory, made by a factory `(run_dir: Path, part_bytes: int) -> Collector`.

    part_bytes: size at which a part of its files is full.
    """

    @property
    def files(self) -> tuple[JsonLines[Any], ...]:
        """Files in parts, which the recorder checks and shortens."""
        ...

    def attach(self, bus: Bus) -> None: ...

    def close(self) -> None: ...


class Recorder:
    """The node. It folds all messages into one `RecentHistory`, from which it writes the files and the recording."""

    owns_clock = False

    def __init__(self, options: RecorderOptions, skillset: Skillset) -> None:
        self.name = options.name
        self.history = RecentHistory(skillset)
        self._options = options
        self._skillset = skillset
        self._run_dir = Path(options.run_dir)
        self._part_bytes = size = part_bytes(options.keep)
        self._records = JsonLines[Record](
            self._run_dir / TIMELINE_FILE, part_bytes=size, head=lambda: self.history.lasting_records
        )
        self._goals = JsonLines[GoalStatus](
            self._run_dir / GOALS_FILE, part_bytes=size, head=lambda: self.history.lasting_statuses
        )
        self._unwritten_phases: deque[Record] = deque(maxlen=PHASES_KEPT)
        self._missions = JsonLines[Record](
            self._run_dir / MISSIONS_FILE, part_bytes=UNBOUNDED, head=lambda: self._unwritten_phases
        )
        self._collectors: list[Collector] = [part(name)(self._run_dir, size) for name in options.collectors]
        self._recording: Recording | None = None
        self._lock = RecordingLock(self._run_dir)
        self._checks = 0

    def attach(self, bus: Bus) -> None:
        keys = Keys(self._skillset.name)
        self._bus, self._timeline = bus, Timeline(bus, keys)
        self._recording = self._open_recording()
        self._upkeep = self._make_upkeep()
        self._show_earlier()
        follow_records(bus, keys, self._on_record, self._on_status)
        bus.subscribe(keys.mission_tree, message_reader(TreeSnapshot, self._on_tree), events=True)
        bus.subscribe(keys.mission_status, message_reader(MissionStatus, self._on_mission), events=True)
        self._upkeep.mission_is_over(time.time())  # unless it shows that it runs
        bus.watch_alive(keys.alive(MISSION), self._on_alive)
        if self._recording:
            self._recording.attach(bus)
        for collector in self._collectors:
            collector.attach(bus)
        self._check_files()

    def detach(self) -> None:
        for collector in self._collectors:
            collector.close()
        if self._recording:
            self._recording.close()
        self._upkeep.check(self._bus.now())
        for file in (self._records, self._goals, self._missions):
            file.close()
        self._lock.release()

    # --- files -------------------------------------------------------------------------------------------------------

    def _open_recording(self) -> Recording | None:
        try:
            from skillwing.services.recording.rerun_stream import Recording  # noqa: PLC0415  Rerun is optional
        except ModuleNotFoundError as missing:
            log.warning(
                "%s is not installed; only the timeline is recorded. For %s: pip install 'skillwing[viewer]'.",
                missing.name,
                RECORDING_FILE,
            )
            return None
        size = RECORDING_PARTS * self._part_bytes
        return Recording(self._options, self._skillset, self._run_dir / RECORDING_FILE, size)

    def _make_upkeep(self) -> Upkeep:
        further = [file.parts for collector in self._collectors for file in collector.files]
        own = (self._records.parts, self._goals.parts, self._missions.parts)
        recordings = () if self._recording is None else (self._recording,)
        retention = Retention(self._run_dir, self._options.keep, [each.name for each in further])
        return Upkeep(self._run_dir, (*own, *further, *recordings), retention, lambda: has_room(self._run_dir))

    def _check_files(self) -> None:
        if (gap := self._upkeep.check(self._bus.now())) is not None:
            self._report(gap)
        if self._checks % RETENTION_CHECKS == 0:
            self._upkeep.delete_old_parts(time.time())
            self._lock.hold()
        self._checks += 1
        if self._recording:
            self._recording.begin_part_if_full()
        self._bus.after(CHECK_PERIOD, self._check_files, wall=True)

    def _report(self, gap: Gap) -> None:
        """Tell the log and the timeline that nothing can be written, or that writing works again."""
        before, after = (WRITES, FAILS) if gap.end is None else (FAILS, WRITES)
        log.warning("%s", gap_sentence(gap))
        self._timeline.record(RecordKind.PROCESS, self.name, before, after, text=gap_sentence(gap))

    def _show_earlier(self) -> None:
        """Show the latest messages that an earlier recorder of this run has written. Damaged files are left out."""
        for record in sorted(self._earlier(TIMELINE_FILE, Record), key=lambda record: record.t):
            if self.history.add_record(record):
                self._show_record(record)
        for status in self._earlier(GOALS_FILE, GoalStatus):
            if self.history.add_status(status):
                self._show_goal(status)

    def _earlier(self, name: str, kind: type[M]) -> list[M]:
        try:
            return last_parts(self._run_dir, name, kind)
        except BadRecordingError as error:
            log.warning("What was recorded before is not shown. %s", error)
            return []

    # --- messages ----------------------------------------------------------------------------------------------------

    def _on_record(self, record: Record) -> None:
        if record.source == RESOURCE_MANAGER and (end := status_of_loss(record)) is not None:
            self._on_status(end)  # the goal's manager does not publish it any more
        if not self.history.add_record(record):
            return
        self._records.write(record)
        if record.kind is RecordKind.MISSION and record.after in PHASES:
            if not self._missions.write(record):
                self._unwritten_phases.append(record)
            over = MissionPhase(record.after).over
            (self._upkeep.mission_is_over if over else self._upkeep.mission_runs)(time.time(), writer_of(record))
        self._show_record(record)

    def _show_record(self, record: Record) -> None:
        if self._recording:
            self._recording.mission.show_record(record, self.history)
            if record.goal_id and record.goal_id in self.history:
                self._recording.mission.show_goal(self.history.bar(record.goal_id))

    def _on_status(self, status: GoalStatus) -> None:
        if self.history.is_late(status):
            return  # its record is in the timeline
        if self.history.add_status(status):
            self._goals.write(status)
            self._show_goal(status)

    def _show_goal(self, status: GoalStatus) -> None:
        if self._recording:
            self._recording.mission.show_goal(self.history.bar(status.goal_id))

    def _on_tree(self, snapshot: TreeSnapshot) -> None:
        if self._recording:
            try:
                self._recording.mission.show_tree(snapshot)
            except ValueError as error:
                log.warning("A tree of %s is left out: %s.", snapshot.mission, error)

    def _on_mission(self, status: MissionStatus) -> None:
        if self._recording:
            self._recording.mission.show_mission(status)

    def _on_alive(self, key: str, alive: bool) -> None:
        """Keep the files of a mission while its process is there, whatever else is known of it."""
        del key
        (self._upkeep.mission_runs if alive else self._upkeep.mission_is_over)(time.time())


def make_recorder(options: dict[str, Any]) -> Recorder:
    """The recorder described by `RecorderOptions`. Raises InvalidOptionError, SkillsetError or OSError."""
    for name, value in RERUN_ENVIRONMENT.items():
        os.environ.setdefault(name, value)  # Rerun reads it when it is imported, which comes later
    checked = read_options(options)
    return Recorder(checked, load(Path(checked.skillset)))
