"""Drawing of a drone in the dashboard."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import rerun as rr


def draw_drone(recording: rr.RecordingStream, entity: str, nose: Sequence[int] = (255, 255, 255)) -> None:
    """Draw six arms and rotors, a nose, and a dot that is visible at any distance. nose: colour of both."""
    tips = [(0.6 * math.cos(a), 0.6 * math.sin(a), 0.1) for a in np.arange(6) * math.pi / 3 + math.pi / 6]
    arms = rr.LineStrips3D([[(0, 0, 0.05), tip] for tip in tips], colors=[[230, 232, 235]], radii=0.04)
    recording.log(f"{entity}/arms", arms, static=True)
    discs = rr.Ellipsoids3D(
        centers=tips, half_sizes=[(0.26, 0.26, 0.02)] * 6, colors=[[120, 190, 255]], fill_mode="solid"
    )
    recording.log(f"{entity}/rotors", discs, static=True)
    dot = rr.Points3D([(0, 0, 0)], colors=[nose], radii=rr.Radius.ui_points(4.0))
    recording.log(f"{entity}/dot", dot, static=True)
    arrow = rr.Arrows3D(vectors=[(2.0, 0, 0)], colors=[nose], radii=0.07)
    recording.log(f"{entity}/nose", arrow, static=True)
