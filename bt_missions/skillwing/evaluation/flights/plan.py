"""Plan of one campaign flight: it determines the whole flight."""

from __future__ import annotations

import math
import shlex
from collections.abc import Sequence
from enum import StrEnum
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeAlias

import msgspec

from skillwing.evaluation.flights.conditions import Condition, draw
from skillwing.services.errors import InvalidOptionError
from skillwing.sim_mujoco.launching import inspection_mission, mapping_mission
from skillwing.sim_mujoco.world.kinds import make_site
from skillwing.sim_mujoco.world.site import Site

CRUISE_SPEED = 2.0
"""Default cruise speed of missions [m/s]."""

CORNERS = 48
"""Number of corners of a circle that is flown in straight legs."""
PILOT_PATIENCE = 30.0
"""Time that missions wait for the authority while the safety pilot has it [robot s]; he returns it within 15 s."""

ALTERNATIVES = Path(__file__).parent / "alternatives"

Place: TypeAlias = tuple[float, float, float]
"""Position in ENU, with home at the origin [m]."""


class FlightNetwork(StrEnum):
    """Network of a flight: one process and virtual time, or real processes over Zenoh."""

    IN_PROCESS = "in-process"
    ZENOH = "zenoh"


class FlightPlan(msgspec.Struct, frozen=True, kw_only=True):
    """Plan of a flight. world: kind of world. watched: obstacle detection runs; without it drones collide.

    The other fields are for comparisons. happens: options of the functional layer, instead of those that `condition`
    draws from the seed. alternative: fly the mission of the same name in `alternatives/`. options: of the mission, in
    addition to those of the site. label: distinguishes such flights.
    """

    mission: str
    world: str
    seed: int
    condition: Condition
    watched: bool = True
    network: FlightNetwork = FlightNetwork.IN_PROCESS
    happens: dict[str, Any] | None = None
    alternative: bool = False
    options: dict[str, Any] = {}
    label: str = ""

    @property
    def flown(self) -> str:
        """Name of the flown mission, or the path of its file."""
        return str(ALTERNATIVES / f"{self.mission}.py") if self.alternative else self.mission

    @property
    def name(self) -> str:
        """Name of the flight, unique within a campaign and valid as a file name."""
        kind = ("" if self.watched else "-unwatched") + (
            "" if self.network is FlightNetwork.IN_PROCESS else f"-{self.network}"
        )
        kind += f"-{self.label}" if self.label else ""
        return f"{self.mission}-{self.world}-{self.condition}-{self.seed}{kind}"

    @property
    def command(self) -> str:
        """Command that repeats and records this flight; a flight of a comparison is repeated without a recording."""
        if self.label:
            return f"python -m skillwing.evaluation.campaign.worker {shlex.quote(msgspec.json.encode(self).decode())}"
        kind = "" if self.watched else " --without-obstacles"
        kind += "" if self.network is FlightNetwork.IN_PROCESS else f" --on {self.network}"
        return (
            f"skillwing campaign {self.mission} --seeds {self.seed}:{self.seed + 1} --faults {self.condition} "
            f"--worlds {self.world}{kind} --record"
        )

    def site(self) -> Site:
        """Prior knowledge of the flight's world."""
        return make_site(self.seed, self.world)

    def circumstances(self) -> dict[str, Any]:
        """Faults of the flight, as options of the functional layer."""
        if self.happens is not None:
            return self.happens
        return draw(self.condition, self.seed, way_time(planned_way(self.site(), self.mission)))

    def robot_options(self) -> dict[str, Any]:
        """Options of the robot's functional layer."""
        return {
            "seed": self.seed,
            "world": self.world,
            "watch": self.watched,
            **self.circumstances(),
        }

    def mission_options(self) -> dict[str, Any]:
        """Options of the mission. A mission that is not listed here needs none of the site."""
        match self.mission:
            case "mapping" | "inspection":
                return {**options_on(self.site(), self.mission), "pilot_patience": PILOT_PATIENCE, **self.options}
            case _:
                return dict(self.options)


def usual_world(mission: str) -> str:
    """Usual kind of world for a mission."""
    return "inspection" if mission == "inspection" else "courtyard"


def options_on(site: Site, mission: str) -> dict[str, Any]:
    """Options of a mission at this site. Raises InvalidOptionError if the mission has nothing to do there."""
    if mission == "mapping":
        return mapping_mission(site)
    circle = inspection_mission(site)
    if circle is None:
        sentence = f"A world of kind `{site.kind}` has no building to inspect. Give `--worlds inspection`."
        raise InvalidOptionError("worlds", sentence)
    return circle


def planned_way(site: Site, mission: str) -> tuple[Place, ...]:
    """Planned way of a mission: the site's route, or the circle round its building and home."""
    circle = planned_circle(site, mission)
    if not circle:
        return site.way
    over_home = (*site.home, circle[0][2])
    return over_home, *circle, circle[0], over_home


def planned_circle(site: Site, mission: str) -> tuple[Place, ...]:
    """Corners of the circle round the building, from the one next to home on; none for other missions."""
    if mission != "inspection" or site.target is None:
        return ()
    (x, y), radius, height = site.target.centre, site.target.radius, site.target.height
    angles = (math.pi + 2.0 * math.pi * step / CORNERS for step in range(CORNERS))
    return tuple((x + radius * math.cos(angle), y + radius * math.sin(angle), height) for angle in angles)


def way_time(way: Sequence[Place]) -> float:
    """Duration of a way at cruise speed without stops [s of robot time]."""
    return sum(math.dist(a, b) for a, b in pairwise(way)) / CRUISE_SPEED
