"""The yard of a flight: the judge that lends the shared places, and a witness of who was there."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Final, TypeAlias

from skillwing.onboard.topics.truth import TRUTH, Truth
from skillwing.services.bus import Bus, MultiRobotBus
from skillwing.services.bus.reading import message_reader
from skillwing.services.errors import InvalidOptionError
from skillwing.services.protocol import GoalStatus, Keys, State
from skillwing.services.robot import ProcessSpec, Robot, find_robot

Borders: TypeAlias = tuple[float, float, float, float]
"""West, south, east and north border of a place [m]."""

YARD = "yard"
"""Name of the robot, and of its skillset."""
PAD_LEASE = "hold_pad"
FOLDER = Path(__file__).parents[4] / "examples" / "yard"
PLACES: Final[Mapping[str, Borders]] = MappingProxyType(
    {"pad": (-2.2, -2.2, 2.2, 2.2), "corridor": (3.2, -0.8, 5.2, 1.2)}
)
"""Borders of the places, which are open upwards. The yard adds a margin of 1 m; the drones stand 4 m from the pad.

The corridor is the way to the pad, from the east. A drone on the pad is not in the margin of the corridor. No planned
way of mapping comes nearer to a place than 0.8 m (`plan.halves`).
"""
GATE = (4.8, 0.2)
"""Place in the corridor over which each drone enters and leaves [m]. The ground around pad and corridor is free."""
SAME_TIME = 0.05
"""Largest difference in s between two positions that count as of one moment."""
ON_GROUND = 1.0
"""Height of a drone above the pad that stands on it, at most [m]."""


def yard_table() -> Robot:
    """The table of `examples/yard`. Raises InvalidOptionError without the folder, as in an installed package."""
    if not FOLDER.is_dir():
        raise InvalidOptionError(
            "robot", f"There is no folder {FOLDER}. Fly two drones from a clone of the repository."
        )
    return find_robot(str(FOLDER))


def yard_processes(run_dir: Path) -> tuple[ProcessSpec, ...]:
    """The processes of the yard with these places. run_dir: gets the journal of the judge."""
    table, places = yard_table(), {name: list(borders) for name, borders in PLACES.items()}
    options = {"places": places, "run_dir": str(run_dir)}
    run_dir.mkdir(parents=True, exist_ok=True)
    return (*table.functional_layer(options), *table.managers(options))


class YardWitness:
    """Node that receives the true positions of the drones. It belongs to the yard, and no process knows of it.

    met: times at which two drones were in one place, at any height, in s. visits: landings on the pad, by drone.
    held_at_kill: a drone held the pad when a process was killed; None before.
    """

    name = "witness"
    owns_clock = False

    def __init__(self, drones: tuple[str, ...]) -> None:
        self._latest: dict[str, Truth] = {}
        self._stands: dict[str, bool] = dict.fromkeys(drones, False)
        self.met: list[float] = []
        self.visits = dict.fromkeys(drones, 0)
        self.held_at_kill: bool | None = None
        self._leases: set[str] = set()

    def attach(self, bus: Bus) -> None:
        if not isinstance(bus, MultiRobotBus):
            raise TypeError(f"{self.name} watches several robots, and needs a bus that reaches them")
        for drone in self.visits:
            take = message_reader(Truth, lambda truth, drone=drone: self.take(drone, truth))
            bus.beside(drone).subscribe(TRUTH, take)
        lease = Keys(YARD).status(PAD_LEASE)
        bus.beside(YARD).subscribe(lease, message_reader(GoalStatus, self._note_lease), events=True)

    def detach(self) -> None:
        """Do nothing: the witness holds no resources."""

    def note_kill(self) -> None:
        """Note that a process is killed now."""
        self.held_at_kill = bool(self._leases)

    def _note_lease(self, status: GoalStatus) -> None:
        (self._leases.add if status.state is State.RUNNING else self._leases.discard)(status.goal_id)

    def take(self, drone: str, truth: Truth) -> None:
        """Note the true state of a drone."""
        self._latest[drone] = truth
        now = [each for each in self._latest.values() if abs(each.t - truth.t) <= SAME_TIME]
        if any(inside(place, truth) and sum(inside(place, each) for each in now) > 1 for place in PLACES):
            self.met.append(truth.t)
        stands = inside("pad", truth) and truth.position[2] < ON_GROUND
        if stands and not self._stands[drone]:
            self.visits[drone] += 1
        self._stands[drone] = stands


def inside(place: str, truth: Truth) -> bool:
    """True for a drone in a place, at any height."""
    (x, y, _), (west, south, east, north) = truth.position, PLACES[place]
    return west <= x <= east and south <= y <= north
