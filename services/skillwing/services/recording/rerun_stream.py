"""`recording.rrd`: one Rerun stream with files as its first sink and, if asked for, a viewer as its second."""

from __future__ import annotations

import logging
from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb

from skillwing.dsl.model import Skillset
from skillwing.services.bus import Bus
from skillwing.services.recording.mission_view import TIMELINE, MissionPanels, MissionView, Scene
from skillwing.services.recording.options import RecorderOptions, part
from skillwing.services.recording.recording_file import RecordingFile

APPLICATION = "skillwing"
FILE_TICK, LIVE_TICK = 1.0, 0.1
"""Wall seconds for which rows are collected into chunks. A viewer needs them soon; in a file each chunk costs a
kilobyte."""
FLUSH_TIMEOUT = 2.0

log = logging.getLogger("skillwing.recorder")


class Recording:
    """The open recording: the mission's view, and the robot's scene where the options name one.

    path: of the first part. part_bytes: size at which another part begins. Each part can be opened alone. A server for
    viewers lives as long as its sinks, so with `serve` there is one part, which a full disk ends.
    """

    def __init__(self, options: RecorderOptions, skillset: Skillset, path: Path, part_bytes: int) -> None:
        self._tick = FILE_TICK if options.viewer == "none" else LIVE_TICK
        batching = rr.ChunkBatcherConfig(flush_tick=self._tick)
        # With the same name, a viewer shows all recordings of a run as one.
        recording_id = options.recording_id or path.parent.name
        self.name = path.name
        self.stream = rr.RecordingStream(APPLICATION, recording_id=recording_id, batcher_config=batching)
        self._path, self._part_bytes = path, part_bytes
        self._single = options.viewer == "serve"
        self._lost = 0
        self._scene = _make_scene(options, self.stream)
        from_zero = self._scene is not None
        panels = MissionView.panels(from_zero=from_zero)
        self._blueprint = self._scene.blueprint(panels) if self._scene else plain_blueprint(panels)
        self._live = _live_sinks(options)
        self._file = self._open_file()
        self.stream.send_blueprint(self._blueprint)
        self.mission = MissionView(self.stream, skillset, from_zero=from_zero)

    @property
    def failure(self) -> str:
        """The reason why the file cannot be written; empty while it can."""
        return self._file.failure

    def take_lost(self) -> int:
        """The number of lost messages of Rerun, which is set back."""
        lost, self._lost = self._lost + self._file.take_lost(), 0
        return lost

    def attach(self, bus: Bus) -> None:
        rows = self.mission.rows
        rows.send()
        rows.wake = lambda: bus.after(self._tick, rows.send, wall=True)
        if self._scene:
            self._scene.attach(bus)

    def begin_part_if_full(self) -> None:
        """Begin another part if this one is full. Call it every few seconds."""
        if self._file.size >= self._part_bytes:
            self.retry()

    def retry(self) -> None:
        """Begin another part, with all that it needs from the parts before."""
        if self._single:
            return
        self.mission.rows.send()
        before = self._file
        self._file = self._open_file()
        before.close()
        self._lost += before.take_lost()
        self.mission.restate()
        if self._scene:
            self._scene.restate()

    def close(self) -> None:
        if self._scene:
            self._scene.close()
        self.mission.rows.send()
        try:
            self.stream.flush(timeout_sec=FLUSH_TIMEOUT)
        except RuntimeError as error:
            # The viewer or the server is gone; the file is complete anyway.
            log.warning("The viewer did not receive the end of the recording: %s.", error)
        self.stream.disconnect()
        self._file.close()

    def _open_file(self) -> RecordingFile:
        """Turn the stream to another part.

        The parts have no index. Rerun would collect it in memory until the end of a part: some 2 kB for each chunk of
        1 kB, so that the recorder would grow by 125 MB with a part of 64 MB.
        """
        file = RecordingFile(self._path.parent, self._path.name)
        sink = rr.FileSink(file.sink, write_footer=False)
        self.stream.set_sinks(sink, *self._live, default_blueprint=self._blueprint)
        file.opened()
        return file


def plain_blueprint(panels: MissionPanels) -> rrb.Blueprint:
    """The mission's panels alone, for a robot without a scene."""
    return framed(
        rrb.Vertical(panels.tree, rrb.Horizontal(panels.skills, panels.resources, panels.log), row_shares=[2, 3])
    )


def framed(content: rrb.Container) -> rrb.Blueprint:
    """A dashboard without Rerun's own panels around it; time follows the run."""
    return rrb.Blueprint(
        content,
        rrb.TimePanel(timeline=TIMELINE, state="collapsed", play_state="following"),
        rrb.SelectionPanel(state="hidden"),
        rrb.BlueprintPanel(state="hidden"),
        rrb.TopPanel(state="hidden"),
        auto_views=False,
    )


def _make_scene(options: RecorderOptions, stream: rr.RecordingStream) -> Scene | None:
    return part(options.scene)(stream, options.scene_options) if options.scene else None


def _live_sinks(options: RecorderOptions) -> list[rr.GrpcSink | rr.GrpcServerSink]:
    match options.viewer:
        case "none":
            return []
        case "serve":
            return [rr.GrpcServerSink(bind_ip=options.bind, port=options.port, server_memory_limit="512MiB")]
        case "connect":
            return [rr.GrpcSink(options.url)]
        case "spawn":
            try:
                rr.spawn(port=options.port, connect=False, hide_welcome_screen=True)
            except RuntimeError as error:
                log.warning("No viewer window: %s. The recording is written anyway.", error)
                return []
            return [rr.GrpcSink(f"rerun+http://127.0.0.1:{options.port}/proxy")]
