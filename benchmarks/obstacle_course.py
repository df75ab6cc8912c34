"""Obstacle courses, and flights through them with one sensor.

The loop is the real one: physics, ray-cast sensors, obstacle detection, guidance and the mission's route planner;
only skills and resources are left out. One course and seed is one flight, bit for bit.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from skillwing.bt_missions.planning.detour import RoutePlanner
from skillwing.onboard.guidance.node import make_guidance
from skillwing.onboard.obstacles.node import make_obstacles
from skillwing.onboard.topics import common, guidance, obstacles
from skillwing.onboard.topics.guidance import FlyTo, Motion, MotionState, TakeOff, YawMode
from skillwing.onboard.topics.navigation import NAVIGATION, Navigation
from skillwing.onboard.topics.obstacles import ObstacleSource
from skillwing.onboard.topics.truth import TRUTH, Truth
from skillwing.services.bus import Answered, Bus
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.bus.reading import message_reader
from skillwing.services.protocol import encode
from skillwing.sim_mujoco.simulator.node import SimNode
from skillwing.sim_mujoco.simulator.simulator import Simulator
from skillwing.sim_mujoco.world.footprint import Footprint, Point
from skillwing.sim_mujoco.world.things.obstacle import Obstacle, ObstacleKind
from skillwing.sim_mujoco.world.things.plain import block, pole
from skillwing.sim_mujoco.world.world import World, make_world

GOAL: Final = (26.0, 0.0, 4.0)
AREA: Final = (-11.0, -11.0, 41.0, 31.0)
PATIENCE: Final = 600.0
"""Longest robot time of a flight [s]."""
SENSOR_OF: Final = {ObstacleSource.ZED: "zed", ObstacleSource.LIDAR: "lidar"}
_HEIGHT = 7.0


def poles(rng: np.random.Generator) -> list[Obstacle]:
    """One pole on the way and others around it, with room to pass between them."""
    centres: list[Point] = [(float(rng.uniform(9.0, 17.0)), float(rng.uniform(-0.3, 0.3)))]
    while len(centres) < 6:
        place = float(rng.uniform(6.0, 22.0)), float(rng.uniform(-7.0, 9.0))
        if min(math.dist(place, other) for other in centres) > 6.5:
            centres.append(place)
    return [_pole(f"pole-{i}", centre, float(rng.uniform(0.1, 0.4))) for i, centre in enumerate(centres)]


def wall(rng: np.random.Generator) -> list[Obstacle]:
    """A wall of 4 to 10 m across the way."""
    half, aside = float(rng.uniform(2.0, 5.0)), float(rng.uniform(-1.5, 1.5))
    return [_wall("wall", (float(rng.uniform(11.0, 15.0)), aside), (0.2, half))]


def corner(rng: np.random.Generator) -> list[Obstacle]:
    """A wall across the way, joined at one end to a wall along the way: one way round is longer."""
    x, half = float(rng.uniform(11.0, 14.0)), float(rng.uniform(2.5, 4.0))
    side = 1.0 if rng.random() < 0.5 else -1.0
    length = float(rng.uniform(2.0, 3.5))
    return [_wall("wall-across", (x, 0.0), (0.2, half)), _wall("wall-along", (x - length, side * half), (length, 0.2))]


def pocket(rng: np.random.Generator) -> list[Obstacle]:
    """A dead end: three walls that are open towards the drone, with room to fly in."""
    back, half = float(rng.uniform(15.0, 18.0)), float(rng.uniform(3.5, 4.5))
    depth = float(rng.uniform(2.0, 3.5))
    sides = [_wall(f"wall-side-{s}", (back - depth, s * half), (depth, 0.2)) for s in (-1, 1)]
    return [_wall("wall-back", (back, 0.0), (0.2, half)), *sides]


def gap(rng: np.random.Generator) -> list[Obstacle]:
    """A wall across the whole area with one opening of 4 to 5 m, aside of the way."""
    x, width = float(rng.uniform(11.0, 15.0)), float(rng.uniform(4.0, 5.0))
    aside = float(rng.uniform(4.0, 9.0)) * (1.0 if rng.random() < 0.5 else -1.0)
    ends = [(AREA[1] - 2.0, aside - width / 2), (aside + width / 2, AREA[3] + 2.0)]
    return [_wall(f"wall-{i}", (x, (low + high) / 2), (0.2, (high - low) / 2)) for i, (low, high) in enumerate(ends)]


def _pole(name: str, centre: Point, radius: float) -> Obstacle:
    return pole(name, Footprint(centre, radius=radius), _HEIGHT)


def _wall(name: str, centre: Point, half: Point) -> Obstacle:
    return block(name, ObstacleKind.WALL, Footprint(centre, half), _HEIGHT)


COURSES: Final[dict[str, Callable[[np.random.Generator], list[Obstacle]]]] = {
    "poles": poles,
    "wall": wall,
    "corner": corner,
    "pocket": pocket,
    "gap": gap,
}


def make_course(kind: str, seed: int) -> World:
    """Terrain of the courtyard, with this course only."""
    return dataclasses.replace(make_world(seed), obstacles=tuple(COURSES[kind](np.random.default_rng((seed, 77)))))


@dataclass(frozen=True, slots=True)
class Flown:
    """Result of a flight; `clearance`: least distance of the blade tips from anything in the air [m]."""

    arrived: bool
    collisions: int
    clearance: float
    seconds: float
    blocked: int
    account: str


class Pilot:
    """Node that takes off and flies the planner's legs one after the other, as the mission does."""

    name = "pilot"
    owns_clock = False

    def __init__(self, source: ObstacleSource, planner: RoutePlanner, speed: float) -> None:
        self.planner = planner
        self.blocked = 0
        self.flying = False
        self._source, self._speed = source, speed
        self._token = 0
        self._goal = ""
        self._position: common.Vector3 = (0.0, 0.0, 0.0)

    @property
    def done(self) -> bool:
        return self.planner.done

    def attach(self, bus: Bus) -> None:
        self._bus = bus
        bus.subscribe(NAVIGATION, message_reader(Navigation, self._on_navigation), latest_only=True)
        bus.subscribe(
            guidance.GUIDANCE_STATUS, message_reader(guidance.GuidanceStatus, self._on_status), latest_only=True
        )
        bus.after(1.5, lambda: self._fly(TakeOff(height=GOAL[2], speed=1.5)))

    def detach(self) -> None:
        """Do nothing: the flight's network ends with it."""

    def _on_navigation(self, navigation: Navigation) -> None:
        self._position = navigation.position

    def _on_status(self, status: guidance.GuidanceStatus) -> None:
        if status.body.goal_id != self._goal:
            return
        match status.body.state:
            case MotionState.DONE if not self.flying:
                self.flying = True
                self._look()
            case MotionState.DONE:
                self.planner.arrived()
                self._next_leg()
            case MotionState.BLOCKED | MotionState.ABORTED:
                self.blocked += 1
                free = status.free_distance
                self.planner.blocked(self._position, 1000.0 if free is None else free)
                self._next_leg()
            case _:
                pass

    def _look(self) -> None:
        self._goal, self._token = "", self._token + 1
        wanted = obstacles.SelectObstacleSource(goal_id="look", token=self._token, source=self._source)
        self._bus.ask(obstacles.OBSTACLE_COMMAND, encode(wanted), lambda answer: None)
        self._bus.after(1.0, self._next_leg)

    def _next_leg(self) -> None:
        self._goal = ""
        target = self.planner.next_target(self._position)
        if target is not None:
            nose = YawMode.ALONG_TRACK if self._source is ObstacleSource.ZED else YawMode.IN_VIEW
            self._fly(FlyTo(target=target, speed=self._speed, nose=nose))

    def _fly(self, motion: Motion) -> None:
        self._token += 1
        goal = f"goal-{self._token}"
        command = guidance.GuidanceCommand(goal_id=goal, token=self._token, motion=motion)

        def taken(answer: object) -> None:
            if not isinstance(answer, Answered):
                raise RuntimeError(f"guidance refused {motion}: {answer}")
            self._goal = goal

        self._bus.ask(guidance.GUIDANCE_COMMAND, encode(command), taken)


def fly(
    world: World,
    source: ObstacleSource,
    *,
    speed: float = 2.0,
    watch: bool = True,
    turbulence: float = 0.0,
    wind: common.Vector3 = (0.0, 0.0, 0.0),
    route: tuple[common.Vector3, ...] = (GOAL,),
) -> Flown:
    """Fly a route with one obstacle sensor. speed: the highest [m/s]. watch: guidance uses the obstacle reports."""
    network = InProcessNetwork()
    sensors = ("range", "imu", SENSOR_OF[source])
    network.attach(SimNode(Simulator(world, sensors=sensors, turbulence=turbulence, wind=wind)))
    fence = {"low": world.geofence.low, "high": world.geofence.high}
    network.attach(make_guidance({"geofence": fence, "watch": watch}))
    network.attach(make_obstacles({}))
    pilot = Pilot(source, RoutePlanner(route, area=AREA), speed)
    truths: list[Truth] = []
    network.bus("judge").subscribe(TRUTH, message_reader(Truth, truths.append))
    network.attach(pilot)
    network.run_until(lambda: pilot.done or bool(truths and truths[-1].collisions), PATIENCE)
    return Flown(
        arrived=pilot.planner.reached == len(route) and not truths[-1].collisions,
        collisions=truths[-1].collisions,
        clearance=min((truth.clearance for truth in truths if truth.position[2] > 1.5), default=math.inf),
        seconds=network.now(),
        blocked=pilot.blocked,
        account=pilot.planner.summary,
    )
