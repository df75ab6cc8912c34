"""Content of the picture of a flight's map: the map, the flown path, and the places of events."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from skillwing.evaluation.flights.saved_map import SavedMap
from skillwing.evaluation.judge.map_picture import Flown, Happening, MapScene
from skillwing.onboard.topics.common import Vector3
from skillwing.onboard.topics.truth import Truth
from skillwing.services.history.history import History
from skillwing.services.recording.palette import is_trouble
from skillwing.sim_mujoco.world.world import World

DEPTH_MAP, FLIGHT = "depthmap_source", "flight_status"
"""The resources that tell which sensor looks ahead, and whether the drone flies."""
ON_GROUND = "ON_GROUND"
STOPPED = ("S_BLOCKED", "N_BLOCKED")


def map_scene(
    world: World, route: Sequence[Vector3], history: History, flight: Sequence[Truth], saved: SavedMap | None
) -> MapScene:
    """Content of the picture. The flown path is divided where another sensor takes over the depth map."""
    positions = np.array([truth.position for truth in flight]).reshape(-1, 3)
    times = np.array([truth.t for truth in flight])

    def place(t: float) -> Vector3:
        x, y, z = positions[min(int(np.searchsorted(times, t)), len(times) - 1)].tolist()
        return x, y, z

    flown: list[Flown] = []
    for span in history.lanes[DEPTH_MAP]:
        # From the last sample of the stretch before, so that there is no gap.
        first = max(int(np.searchsorted(times, span.t_start)) - 1, 0)
        end = history.end if span.t_end is None else span.t_end
        path = positions[first : int(np.searchsorted(times, end, side="right"))]
        if len(path) > 1:
            flown.append(Flown(span.state.lower(), path))
    scene = MapScene(
        centres=np.empty((0, 3), np.float32) if saved is None else saved.centres,
        voxel_size=saved.voxel_size if saved else 1.0,
        route=route,
        flown=flown,
        fence=world.geofence,
        obstacles=world.obstacles,
    )
    if not flight:
        return scene
    came_down = len(states := history.lanes.get(FLIGHT, ())) > 1 and states[-1].state == ON_GROUND
    return replace(
        scene,
        ended="came down here" if came_down else scene.ended,
        obstacles_met=[place(bar.t_end) for bar in history.bars if bar.terminal in STOPPED and bar.t_end is not None],
        switches=[
            Happening(place(switch.t), f"at {switch.t:.1f} s {switch.before} -> {switch.after}")
            for switch in history.switches
        ],
        troubles=[Happening(place(t), f"{text} at {t:.1f} s") for text, t in _troubles(history)],
    )


def _troubles(history: History) -> Iterator[tuple[str, float]]:
    """Failures and losses with the time of their first occurrence. Initial states are left out."""
    for name, spans in history.lanes.items():
        firsts: dict[str, float] = {}
        for span in spans[1:]:
            if is_trouble(span.state):
                firsts.setdefault(span.state, span.t_start)
        yield from ((f"{name} {state}", t) for state, t in firsts.items())
