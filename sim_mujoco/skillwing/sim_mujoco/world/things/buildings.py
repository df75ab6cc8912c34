"""Houses, a church, halls, and the tall building that an inspection flies around."""

from __future__ import annotations

import math

from skillwing.sim_mujoco.world.footprint import Footprint
from skillwing.sim_mujoco.world.things.facade import DWELLING, Windows
from skillwing.sim_mujoco.world.things.obstacle import SINK, Obstacle, ObstacleKind
from skillwing.sim_mujoco.world.things.shapes import Colour, GableRoof, ObjectFrame, Solid, Spire, WindowedBlock

EAVES = 0.4
"""Overhang of a roof beyond the walls [m]."""
BALCONY = 1.3
"""Depth of balconies [m]."""
_SHAFT = Windows(bay=3.2, window=(1.0, 2.2), storey=7.0, opening=(1.6, 5.2))
_BELFRY = Windows(bay=5.4, window=(2.0, 3.4), storey=4.5, opening=(2.2, 4.0))
_WORKS = Windows(bay=5.0, window=(0.8, 4.2), storey=7.0, opening=(4.6, 6.0))
_FLATS = Windows(bay=2.8, window=(0.6, 2.2), storey=3.0, opening=(0.9, 2.4))
_SLATE: Colour = (0.33, 0.35, 0.39)
_STONE: Colour = (0.72, 0.69, 0.62)
_CONCRETE: Colour = (0.70, 0.70, 0.68)


def house(
    name: str,
    outline: Footprint,
    eaves: float,
    rise: float,
    walls: Colour,
    roof: Colour,
    *,
    terraced: bool = False,
) -> Obstacle:
    """A house with a gabled roof, its ridge along x, `rise` above the eaves, and a chimney.

    A terraced house fills its outline along x, so that neighbours touch, and has no windows on those sides.
    """
    place, (x, y) = ObjectFrame.of(outline), outline.half
    inner = (x if terraced else x - EAVES, y - EAVES)
    chimney = eaves + rise + 0.7
    at = 0.55 * inner[0]
    block = WindowedBlock((2 * inner[0], 2 * inner[1], eaves + SINK), DWELLING, blind_ends=terraced)
    solids = (
        place.put(block, (0.0, 0.0, -SINK), "walls", walls),
        place.put(GableRoof(2 * x, 2 * y, rise), (0.0, 0.0, eaves), "roof", roof),
        place.box((at - 0.35, -0.3, eaves), (at + 0.35, 0.3, chimney), "chimney", (0.50, 0.30, 0.24)),
    )
    return Obstacle(name, ObstacleKind.BUILDING, outline, chimney, solids=solids)


def church(name: str, outline: Footprint, height: float) -> Obstacle:
    """A nave along x, and a tower with a spire of this height at its western end."""
    place, (x, y) = ObjectFrame.of(outline), outline.half
    side = min(y - 0.6, 2.7)
    tower = 0.6 * height
    nave, ridge = 0.27 * height, 0.2 * height
    back = x - 2 * side
    solids = (
        place.put(
            WindowedBlock((x + back - EAVES, 2 * (y - EAVES), nave + SINK), _SHAFT),
            ((x - EAVES - back) / 2, 0.0, -SINK),
            "nave",
            _STONE,
        ),
        place.put(GableRoof(x + back, 2 * y, ridge), ((x - back) / 2, 0.0, nave), "roof", _SLATE),
        place.put(WindowedBlock((2 * side, 2 * side, tower + SINK), _BELFRY), (side - x, 0.0, -SINK), "tower", _STONE),
        place.put(Spire((side, side), height - tower), (side - x, 0.0, tower), "spire", _SLATE),
    )
    return Obstacle(name, ObstacleKind.BUILDING, outline, height, solids=solids)


def hall(name: str, outline: Footprint, eaves: float, walls: Colour, roof: Colour) -> Obstacle:
    """A factory hall with a shallow roof, a band of windows, and gates on the side towards -y."""
    place, (x, y) = ObjectFrame.of(outline), outline.half
    rise = 0.12 * 2 * y
    solids: list[Solid] = [
        place.put(
            WindowedBlock((2 * (x - EAVES), 2 * (y - EAVES), eaves + SINK), _WORKS), (0, 0, -SINK), "walls", walls
        ),
        place.put(GableRoof(2 * x, 2 * y, rise), (0.0, 0.0, eaves), "roof", roof),
    ]
    gates = max(1, int(2 * x // 9))
    for gate in range(gates):
        middle = -x + (gate + 0.5) * 2 * x / gates
        front = EAVES - y
        solids.append(
            place.box(
                (middle - 1.8, front - 0.2, -SINK), (middle + 1.8, front, 3.8), f"gate-{gate}", (0.25, 0.33, 0.42)
            )
        )
        solids.append(
            place.box((middle - 0.8, -0.8, eaves), (middle + 0.8, 0.8, eaves + rise + 0.8), f"vent-{gate}", _CONCRETE)
        )
    return Obstacle(name, ObstacleKind.BUILDING, outline, eaves + rise + 0.8, solids=tuple(solids))


def flat_house(name: str, outline: Footprint, height: float, walls: Colour, *, terraced: bool = False) -> Obstacle:
    """A house with a flat roof and a parapet."""
    place, (x, y) = ObjectFrame.of(outline), outline.half
    solids = (
        place.put(
            WindowedBlock((2 * x, 2 * (y - 0.2), height - 0.5 + SINK), blind_ends=terraced),
            (0, 0, -SINK),
            "walls",
            walls,
        ),
        *_parapet(place, (x, y), height - 0.5, height, _CONCRETE),
    )
    return Obstacle(name, ObstacleKind.BUILDING, outline, height, solids=solids)


def tower_block(name: str, outline: Footprint, height: float, mast: float, walls: Colour) -> Obstacle:
    """A tall block of flats: balconies on the sides along x, parapet, machine room and a mast (its height in m)."""
    place, (x, y) = ObjectFrame.of(outline), outline.half
    inner = (x - 0.3, y - BALCONY)
    solids: list[Solid] = [
        place.put(
            WindowedBlock((2 * inner[0], 2 * inner[1], height + SINK), _FLATS), (0.0, 0.0, -SINK), "walls", walls
        ),
        place.box((-3.0, -2.2, height), (3.0, 2.2, height + 2.8), "machine-room", _CONCRETE),
        place.box((2.0, -1.0, height), (4.4, 1.0, height + 1.2), "cooler", (0.52, 0.55, 0.57)),
        place.rod((-4.5, 0.0, height), (-4.5, 0.0, height + mast - 0.06), 0.06, "mast", (0.55, 0.2, 0.18)),
        place.box((-2.0, -y, 2.9), (2.0, -inner[1], 3.2), "canopy", _CONCRETE),
        *_parapet(place, (inner[0] + 0.3, inner[1] + 0.3), height, height + 0.9, _CONCRETE),
    ]
    columns = int(2 * inner[0] // 5.6)
    for storey in range(1, int(height // _FLATS.storey)):
        floor = storey * _FLATS.storey - SINK
        for column in range(columns):
            middle = -inner[0] + (column + 0.5) * 2 * inner[0] / columns
            for side in (-1, 1):
                edges = sorted((side * inner[1], side * y))
                number = f"{storey}-{column}-{'front' if side < 0 else 'back'}"
                solids.append(
                    place.box(
                        (middle - 1.4, edges[0], floor),
                        (middle + 1.4, edges[1], floor + 0.2),
                        f"slab-{number}",
                        _CONCRETE,
                    )
                )
                rail = sorted((side * (y - 0.1), side * y))
                solids.append(
                    place.box(
                        (middle - 1.4, rail[0], floor + 0.2),
                        (middle + 1.4, rail[1], floor + 1.2),
                        f"rail-{number}",
                        (0.45, 0.52, 0.56),
                    )
                )
    return Obstacle(name, ObstacleKind.BUILDING, outline, height + max(mast, 2.8), solids=tuple(solids))


def _parapet(place: ObjectFrame, half: tuple[float, float], low: float, high: float, colour: Colour) -> list[Solid]:
    """A wall of 0.3 m around a flat roof."""
    (x, y), thick = half, 0.3
    return [
        place.box((-x, -y, low), (x, thick - y, high), "parapet-front", colour),
        place.box((-x, y - thick, low), (x, y, high), "parapet-back", colour),
        place.box((-x, thick - y, low), (thick - x, y - thick, high), "parapet-left", colour),
        place.box((x - thick, thick - y, low), (x, y - thick, high), "parapet-right", colour),
    ]


def reach_of(outline: Footprint) -> float:
    """Distance of an outline's corners from its centre [m]."""
    return math.hypot(*outline.half) + outline.radius
