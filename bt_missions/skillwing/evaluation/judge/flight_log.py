"""Files for the judge of a flight, beside the timeline: ground truth and the finished map.

The robot knows neither file. `flight.jsonl` grows line by line; `map.npz` is renewed every few seconds, so that a
flight that ends badly can be judged up to its end.
"""

from __future__ import annotations

import logging
import math
from contextlib import suppress
from pathlib import Path

import numpy as np

from skillwing.evaluation.flights.saved_map import SavedMap
from skillwing.onboard.topics.common import Empty
from skillwing.onboard.topics.mapping import MAP, MAP_SNAPSHOT, MAPPING_STATUS, MapHeader, MappingStatus
from skillwing.onboard.topics.truth import TRUTH, Truth
from skillwing.services.bus import Answer, Answered, Bus
from skillwing.services.bus.reading import message_reader, stream_reader
from skillwing.services.history.files import JsonLines, iterate
from skillwing.services.history.parts import PART_BYTES
from skillwing.services.protocol import Keys, MissionStatus, ProtocolError, decode, encode

FLIGHT_FILE = "flight.jsonl"
MAP_FILE = "map.npz"
SAVE_PERIOD = 10.0
_CENTRE_BYTES = 12
_log = logging.getLogger("skillwing.recorder")


class FlightLog:
    """A collector of the recorder. part_bytes: size at which a part of `flight.jsonl` is full."""

    def __init__(self, run_dir: Path, part_bytes: int = PART_BYTES, *, skillset: str = "m600") -> None:
        self._map_path = run_dir / MAP_FILE
        self._flight = JsonLines[Truth](run_dir / FLIGHT_FILE, part_bytes=part_bytes)
        self._keys = Keys(skillset)
        self._centres: dict[bytes, None] = {}
        self._voxel_size = 0.0
        self._pose_source = ""
        self._saved = True

    @property
    def files(self) -> tuple[JsonLines[Truth], ...]:
        return (self._flight,)

    def attach(self, bus: Bus) -> None:
        self._bus = bus
        bus.subscribe(TRUTH, message_reader(Truth, self._flight.write))
        bus.subscribe(MAP, stream_reader(MapHeader, self._on_map))
        bus.subscribe(MAPPING_STATUS, message_reader(MappingStatus, self._on_status), latest_only=True)
        bus.subscribe(self._keys.mission_status, message_reader(MissionStatus, self._on_mission), events=True)
        bus.every(SAVE_PERIOD, self._save)
        if self._map_path.exists():
            # An earlier log of this run had it, and what was mapped then is not published again.
            bus.ask(MAP_SNAPSHOT, encode(Empty()), self._on_snapshot)

    def close(self) -> None:
        self._save()
        self._flight.close()

    def _on_map(self, header: MapHeader, payload: bytes) -> None:
        """Take a map, or what was added to it. Raises ValueError for bytes that are not what the header says."""
        if len(payload) != _CENTRE_BYTES * header.count:
            raise ValueError(f"{header.count} centres cannot come in {len(payload)} bytes")
        if header.complete:
            self._centres.clear()
        # A centre's bytes are its name: the mapping node computes them from the voxel's indices.
        starts = range(0, len(payload), _CENTRE_BYTES)
        self._centres.update((payload[start : start + _CENTRE_BYTES], None) for start in starts)
        self._voxel_size = header.voxel_size
        self._saved = False

    def _on_status(self, status: MappingStatus) -> None:
        self._pose_source = status.pose_source

    def _on_mission(self, status: MissionStatus) -> None:
        """A stream may lose a sample on a busy machine; at the end the whole map is fetched."""
        if status.phase.over:
            self._bus.ask(MAP_SNAPSHOT, encode(Empty()), self._on_snapshot)

    def _on_snapshot(self, answer: Answer) -> None:
        if not isinstance(answer, Answered):
            return
        try:
            self._on_map(decode(answer.attachment, MapHeader), answer.payload)
        except (ProtocolError, ValueError) as error:
            _log.warning("Left out the whole map at the end: %s", error)
        self._save()

    def _save(self) -> None:
        """Save the map. On a full disk the next call tries again; the map of before stays."""
        if self._saved:
            return
        centres = np.frombuffer(b"".join(self._centres), np.float32).reshape(-1, 3)
        unfinished = self._map_path.with_suffix(".part")
        try:
            with unfinished.open("wb") as file:
                np.savez_compressed(file, centres=centres, voxel_size=self._voxel_size, pose_source=self._pose_source)
            unfinished.replace(self._map_path)
            self._saved = True
        except OSError as error:
            _log.warning("%s cannot be written now: %s.", unfinished, error.strerror)
            with suppress(OSError):
                unfinished.unlink()


def make_flight_log(run_dir: Path, part_bytes: int) -> FlightLog:
    return FlightLog(run_dir, part_bytes)


def read_flight(run_dir: Path, begin: float = -math.inf, end: float = math.inf) -> list[Truth]:
    """The ground truth of a run, of at least the time from `begin` to `end`; empty if there is none."""
    return list(iterate(run_dir, FLIGHT_FILE, Truth, begin, end))


def read_map(run_dir: Path) -> SavedMap | None:
    """The map of a run; None if nothing was mapped."""
    path = run_dir / MAP_FILE
    if not path.exists():
        return None
    with np.load(path) as saved:
        return SavedMap(saved["centres"], float(saved["voxel_size"]), str(saved["pose_source"]))
