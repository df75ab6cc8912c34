"""One flight of a campaign, before it is flown: everything about it follows from its plan."""

from __future__ import annotations

import math
import shlex
from collections.abc import Sequence
from enum import StrEnum
from itertools import pairwise
from typing import Any, TypeAlias

import msgspec

from skillwing.evaluation.campaign.besides import ROOT, name_in_repository
from skillwing.evaluation.campaign.conditions import Condition, draw
from skillwing.m600.mission_context import inspection_options, mapping_options
from skillwing.services.errors import InvalidOptionError
from skillwing.sim_mujoco.world.kinds import make_site
from skillwing.sim_mujoco.world.site import Site

CRUISE_SPEED = 2.0
"""At which missions fly if nobody says otherwise [m/s]."""

CORNERS = 48
"""Of a circle as a way of straight legs."""
PILOT_PATIENCE = 30.0
"""For how long missions wait for a drone that the safety pilot has taken [s of robot time]; he returns it within 15."""

Place: TypeAlias = tuple[float, float, float]
"""ENU, home at the origin [m]."""


class Network(StrEnum):
    """What the processes of a flight live on: one process and virtual time, or real ones over Zenoh."""

    IN_PROCESS = "in-process"
    ZENOH = "zenoh"


class FlightPlan(msgspec.Struct, frozen=True, kw_only=True):
    """world: the kind of world. watched: obstacle detection watches the way; without it drones collide.

    What follows is for comparisons. happens: options of the functional layer in place of what `condition` makes of the
    seed. flown_as: a mission's file that is flown in place of `mission`, with `options` besides those of the site; one
    of the repository is called the same wherever that lies. label: tells such flights apart.
    """

    mission: str
    world: str
    seed: int
    condition: Condition
    watched: bool = True
    network: Network = Network.IN_PROCESS
    happens: dict[str, Any] | None = None
    flown_as: str = ""
    options: dict[str, Any] = {}
    label: str = ""

    def __post_init__(self) -> None:
        # The same flight has the same plan wherever the repository lies, and any other file is flown from anywhere.
        msgspec.structs.force_setattr(self, "flown_as", name_in_repository(self.flown_as))

    @property
    def flown(self) -> str:
        """The mission that is flown: its name, or the path of its file."""
        return str(ROOT / self.flown_as) if self.flown_as else self.mission

    @property
    def name(self) -> str:
        """Unique within a campaign, and fit for a file name."""
        kind = ("" if self.watched else "-unwatched") + (
            "" if self.network is Network.IN_PROCESS else f"-{self.network}"
        )
        kind += f"-{self.label}" if self.label else ""
        return f"{self.mission}-{self.world}-{self.condition}-{self.seed}{kind}"

    @property
    def command(self) -> str:
        """What flies this flight again, and records it; one of a comparison is not recorded."""
        if self.label:
            return f"python -m skillwing.evaluation.campaign.worker {shlex.quote(msgspec.json.encode(self).decode())}"
        kind = "" if self.watched else " --without-obstacles"
        kind += "" if self.network is Network.IN_PROCESS else f" --on {self.network}"
        return (
            f"skillwing campaign {self.mission} --seeds {self.seed}:{self.seed + 1} --faults {self.condition} "
            f"--worlds {self.world}{kind} --record"
        )

    def site(self) -> Site:
        """What is known of its world beforehand."""
        return make_site(self.seed, self.world)

    def circumstances(self) -> dict[str, Any]:
        """What befalls the drone, as options of the functional layer."""
        if self.happens is not None:
            return self.happens
        return draw(self.condition, self.seed, way_time(planned_way(self.site(), self.mission)))

    def robot_options(self) -> dict[str, Any]:
        """What the robot's functional layer is told."""
        return {
            "seed": self.seed,
            "world": self.world,
            "watch": self.watched,
            **self.circumstances(),
        }

    def mission_options(self) -> dict[str, Any]:
        """What the mission is told; one that is not listed here knows everything by itself."""
        match self.mission:
            case "mapping" | "inspection":
                return {**options_on(self.site(), self.mission), "pilot_patience": PILOT_PATIENCE, **self.options}
            case _:
                return dict(self.options)


def usual_world(mission: str) -> str:
    """The kind of world in which a mission has something to do."""
    return "inspection" if mission == "inspection" else "courtyard"


def options_on(site: Site, mission: str) -> dict[str, Any]:
    """What a mission planner tells a mission of this site. Raises InvalidOptionError where it has nothing to do."""
    if mission == "mapping":
        return mapping_options(site)
    circle = inspection_options(site)
    if circle is None:
        sentence = f"A world of kind `{site.kind}` has no building to inspect. Give `--worlds inspection`."
        raise InvalidOptionError("worlds", sentence)
    return circle


def planned_way(site: Site, mission: str) -> tuple[Place, ...]:
    """Where a mission is meant to fly: along the site's route, or round its building and home."""
    circle = planned_circle(site, mission)
    if not circle:
        return site.way
    over_home = (*site.home, circle[0][2])
    return over_home, *circle, circle[0], over_home


def planned_circle(site: Site, mission: str) -> tuple[Place, ...]:
    """Corners of the way round the building, beginning with the one next to home; none for any other mission."""
    if mission != "inspection" or site.target is None:
        return ()
    (x, y), radius, height = site.target.centre, site.target.radius, site.target.height
    angles = (math.pi + 2.0 * math.pi * step / CORNERS for step in range(CORNERS))
    return tuple((x + radius * math.cos(angle), y + radius * math.sin(angle), height) for angle in angles)


def way_time(way: Sequence[Place]) -> float:
    """How long a way takes at cruise speed, without a stop [s of robot time]."""
    return sum(math.dist(a, b) for a, b in pairwise(way)) / CRUISE_SPEED
