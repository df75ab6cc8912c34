"""The recorder: a process that listens to a run and writes its files.

It always writes `timeline.jsonl` and `goals.jsonl`. With Rerun it also writes `recording.rrd`, and can show the run
live. No other process waits for it.

A recorder that starts again with the same run directory reads these files and continues them. It draws into a new
recording, `recording-2.rrd`, which a viewer shows as one with the first.
"""

from __future__ import annotations

import logging
from itertools import chain, count
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from skillwing.dsl import load
from skillwing.dsl.model import Skillset
from skillwing.services.bus import Bus
from skillwing.services.bus.reading import message_reader
from skillwing.services.client.causal_feed import follow_records
from skillwing.services.errors import PassingError
from skillwing.services.history.files import (
    GOALS_FILE,
    TIMELINE_FILE,
    JsonLines,
    read_goals,
    read_records,
    repair,
)
from skillwing.services.history.goal_ends import status_of_loss
from skillwing.services.history.history import History
from skillwing.services.names import RESOURCE_MANAGER
from skillwing.services.protocol import GoalStatus, Keys, MissionStatus, Record, TreeSnapshot
from skillwing.services.recording.options import RecorderOptions, part, read_options

if TYPE_CHECKING:
    from skillwing.services.recording.rerun_stream import Recording

RECORDING_FILE = "recording.rrd"

log = logging.getLogger("skillwing.recorder")


class Collector(Protocol):
    """A further writer into the run directory, made by a factory `(run_dir: Path) -> Collector`."""

    def attach(self, bus: Bus) -> None: ...

    def close(self) -> None: ...


class Recorder:
    """The node. It folds all messages into one `History`, from which it writes the files and the recording."""

    owns_clock = False

    def __init__(self, options: RecorderOptions, skillset: Skillset) -> None:
        self.name = options.name
        self.history = History(skillset)
        self._options = options
        self._skillset = skillset
        self._run_dir = Path(options.run_dir)
        for file in (TIMELINE_FILE, GOALS_FILE):
            repair(self._run_dir / file)
        self._earlier = read_records(self._run_dir), read_goals(self._run_dir)
        self._records = JsonLines[Record](self._run_dir / TIMELINE_FILE)
        self._goals = JsonLines[GoalStatus](self._run_dir / GOALS_FILE)
        self._collectors: list[Collector] = [part(name)(self._run_dir) for name in options.collectors]
        self._recording: Recording | None = None

    def attach(self, bus: Bus) -> None:
        self._recording = self._open_recording()
        self._show_earlier()
        keys = Keys(self._skillset.name)
        follow_records(bus, keys, self._on_record, self._on_status)
        bus.subscribe(keys.mission_tree, message_reader(TreeSnapshot, self._on_tree), events=True)
        bus.subscribe(keys.mission_status, message_reader(MissionStatus, self._on_mission), events=True)
        if self._recording:
            self._recording.attach(bus)
        for collector in self._collectors:
            collector.attach(bus)

    def detach(self) -> None:
        for collector in self._collectors:
            collector.close()
        if self._recording:
            self._recording.close()
        self._records.close()
        self._goals.close()

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
        path = free_name(self._run_dir / RECORDING_FILE)
        try:
            return Recording(self._options, self._skillset, path)
        except (RuntimeError, OSError) as error:
            raise PassingError(f"{path} cannot be written: {error}.") from error

    def _show_earlier(self) -> None:
        """Show the messages that an earlier recorder of this run has written."""
        records, statuses = self._earlier
        for record in sorted(records, key=lambda record: record.t):
            if self.history.add_record(record):
                self._show_record(record)
        for status in statuses:
            if self.history.add_status(status):
                self._show_goal(status)
        self._earlier = [], []

    def _on_record(self, record: Record) -> None:
        if record.source == RESOURCE_MANAGER and (end := status_of_loss(record)) is not None:
            self._on_status(end)  # the goal's manager does not publish it any more
        if self.history.add_record(record):
            self._records.write(record)
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


def free_name(path: Path) -> Path:
    """`path` if it is free, else with the first number that makes it free."""
    names = (path.with_stem(f"{path.stem}-{number}") for number in count(2))
    return next(name for name in chain([path], names) if not name.exists())


def make_recorder(options: dict[str, Any]) -> Recorder:
    """The recorder described by `RecorderOptions`. Raises InvalidOptionError, SkillsetError or OSError."""
    checked = read_options(options)
    return Recorder(checked, load(Path(checked.skillset)))
