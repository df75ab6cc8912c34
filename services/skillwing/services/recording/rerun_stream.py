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

    path: of the first part. part_bytes: size at which a part is full.
    """

    def __init__(self, options: RecorderOptions, skillset: Skillset, path: Path, part_bytes: int) -> None:
        batching = rr.ChunkBatcherConfig(flush_tick=FILE_TICK if options.viewer == "none" else LIVE_TICK)
        # With the same name, a viewer shows all recordings of a run as one.
        name = options.recording_id or path.parent.name
        self.stream = rr.RecordingStream(APPLICATION, recording_id=name, batcher_config=batching)
        self._scene = _make_scene(options, self.stream)
        from_zero = self._scene is not None
        panels = MissionView.panels(from_zero=from_zero)
        blueprint = self._scene.blueprint(panels) if self._scene else plain_blueprint(panels)
        self.file = RecordingFile(path.parent, path.name, part_bytes)
        self.stream.set_sinks(rr.FileSink(self.file.sink), *_live_sinks(options), default_blueprint=blueprint)
        self.file.opened()
        self.stream.send_blueprint(blueprint)
        self._flush()
        self.file.end_prefix()
        self.mission = MissionView(self.stream, skillset, from_zero=from_zero)

    def attach(self, bus: Bus) -> None:
        if self._scene:
            self._scene.attach(bus)

    def restate(self) -> None:
        """Log again what a part that has begun needs from the parts before. Call it every few seconds."""
        if self.file.take_restate():
            self.mission.restate()
            if self._scene:
                self._scene.restate()

    def close(self) -> None:
        if self._scene:
            self._scene.close()
        self._flush()
        self.stream.disconnect()
        self.file.close()

    def _flush(self) -> None:
        try:
            self.stream.flush(timeout_sec=FLUSH_TIMEOUT)
        except RuntimeError as error:
            # The viewer or the server is gone; the file is complete anyway.
            log.warning("The viewer did not receive the end of the recording: %s.", error)


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
